import net.sourceforge.jFuzzyLogic.*;
import java.util.*;
public class Evaluate {
  public static void main(String[] args) throws Exception {
    FunctionBlock block = FIS.load(args[0], false).getFunctionBlock(null);
    Scanner scanner = new Scanner(System.in);
    while (scanner.hasNext()) {
      for (String name : args[1].split(",")) block.setVariable(name, Double.parseDouble(scanner.next()));
      block.evaluate();
      String row = "row";
      for (String name : args[2].split(",")) row += " " + block.getVariable(name).getValue();
      System.out.println(row);
    }
  }
}
