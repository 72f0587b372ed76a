"""The page runner: incorrect pages fail, and correct ones pass."""

import re

import pytest

from tests.docs.comparing import same_output, same_value, shown_result
from tests.docs.directives import PageError
from tests.docs.ledger import entries
from tests.docs.pages import blocks
from tests.docs.runner import check_unrun, run_blocks


@pytest.fixture
def run(tmp_path):
    """Return a function that runs a page of a given text, in a folder of its own, which it returns."""

    def run_text(text):
        page = tmp_path / "page.md"
        page.write_text(text)
        folder = tmp_path / "folder"
        folder.mkdir()
        run_blocks(blocks(page), folder)
        return folder

    return run_text


def fence(language, text, *directives):
    return "\n".join(["", *(f"<!-- {directive} -->" for directive in directives), f"```{language}", text, "```", ""])


RIGHT = {
    "a result": fence("python", "1 / 3  # 0.333"),
    "a result after words": fence("python", "1 / 3  # a third: 0.333"),
    "words": fence("python", "1 / 3  # a third"),
    "what is assigned": fence("python", "x = [1, 0.5]  # [1, 0.5]"),
    "a result inside a function": fence("python", "for x in (1, 1):\n    x + 1  # 2"),
    "what is printed": fence("python", "print(1, 2.5)  # '1 2.50'")
    + fence("python", "print([1])")
    + fence("text", "[1]"),
    "names that stay": fence("python", "x = 1") + "words\n" + fence("python", "x  # 1"),
    "output of a command": fence("sh", "python -m plant_fmu list")
    + fence("text", "bluerov2_heavy ...\n...\nrexrov ..."),
    "output of a setup": fence("text", "5", "setup python\nprint(5)\n"),
    "a status": fence("sh", "cosim show nothing", "exits: 2"),
    "a file": fence("toml", "[hull]\nradius = 0.5", "vehicle onto: odin", "file: mine.toml")
    + fence("sh", "python -m plant_fmu ssv --vehicle mine.toml --out mine.ssv\nls mine.ssv"),
    "a script": fence("python", "import sys\nprint(sys.argv[1])", "file: twice.py")
    + fence("sh", "python twice.py 7 > seven.txt\ncat seven.txt")
    + fence("text", "7"),
    "a scenario": fence("toml", "[time]\nduration = 5.0", "scenario onto: docking"),
    "an arbiter": fence("toml", 'criteria = [{ name = "a" }, { name = "b" }]', "arbiter"),
    "lines of JSON": fence("json", '{"a": 1}\n{"a": 2}'),
    "commands": fence("json", '{"command": "arm", "armed": true}\n{"command": "reset"}', "commands of: harbour"),
    "XML": fence("xml", "<a><b/></a>"),
    "C": fence("c", "#include <math.h>\ndouble half(double x) { return x / 2; }"),
    "a file of the repository": fence("sh", "cat plain.jsonl", "given: tests/data/scenes/plain.jsonl as plain.jsonl")
    + fence("text", '{"seed":...'),
    "what is not run": fence("sh", "sim_vehicle.py -v ArduSub", "not run: needs ArduPilot"),
    "one line that is not run": fence("sh", "ardusub\nls", 'not run "ardusub": needs ArduPilot'),
    "what pip and make do": fence("sh", "pip install '.[mcap,dev]'\nmake run"),
    "a line that goes on": fence("sh", "python -m fuzzy_arbiter eval \\\n  section-vi 1 0 0"),
    "a place to go": fence(
        "sh", "mkdir there\ncd there\npython -m plant_fmu plot odin thrusters --out a.svg\nls a.svg"
    ),
    "a hidden flag": fence(
        "sh", "python -m plant_fmu build --vehicle odin", 'run with "python -m plant_fmu build": --out a.fmu'
    )
    + fence("sh", "ls a.fmu"),
    "a setup for one command": fence("sh", "mkdir a\nls a", 'setup sh "ls"\ncp ../page.md a/\n')
    + fence("text", "page.md"),
    "a block alone": fence("python", "print(__name__)", "alone") + fence("text", "__main__"),
    "a comment of another kind": "<!-- figures: all -->\n\nwords\n",
    "a port that is taken": fence("python", "print(14550)", "setup python\nassert 14550 != 4000 * 3 + 2550\n")
    + fence("text", "14550"),
}

WRONG = {
    "a wrong result": (fence("python", "1 / 3  # 0.334"), "shows 0.334, is 0.333"),
    "a wrong result of one inside": (fence("python", "if True:\n    'a'  # 'b'"), "page.md:4: shows 'b', is 'a'"),
    "a wrong print": (fence("python", "print(2)  # 3"), "shows 3, printed 2"),
    "a wrong assignment": (fence("python", "x = 2  # 3"), "shows 3, is 2"),
    "half a result": (fence("python", "(1, 2)  # (1, 2"), "looks like a result"),
    "a result that nobody checks": (fence("python", "x = [\n  2,  # 3\n]"), "nobody checks"),
    "Python that fails": (fence("python", "x = 1\nx / 0"), "page.md:3: ZeroDivisionError"),
    "Python that is none": (fence("python", "x = = 1"), "no Python"),
    "Python that fails alone": (fence("python", "1 / 0", "alone"), "ZeroDivisionError"),
    "a result alone": (fence("python", "1  # 1", "alone"), "print them"),
    "names of nobody": (fence("python", "y"), "NameError"),
    "a command that fails": (fence("sh", "cosim show nothing"), "ends with 2, expected 0"),
    "a command that does not fail": (fence("sh", "python -m plant_fmu list", "exits: 1"), "ends with 0, expected 1"),
    "a verb of nobody": (fence("sh", "cosim fly"), "ends with 2"),
    "a tool that fails": (fence("sh", "ls nothing"), "ends with 2"),
    "a tool of nobody": (fence("sh", "frobnicate"), "no command that the tests run"),
    "a pipe": (fence("sh", "ls | cat"), "one command a line"),
    "a prompt": (fence("sh", "$ ls"), "one command a line"),
    "an open quote": (fence("sh", "ls 'a"), "No closing quotation"),
    "a line that ends": (fence("sh", "ls \\"), "nothing follows"),
    "an extra of nobody": (fence("sh", "pip install '.[sails]'"), "no extra sails"),
    "an extra of the other": (fence("sh", "pip install './fuzzy_arbiter[mcap]'"), "fuzzy_arbiter/.* no extra mcap"),
    "a target of nobody": (fence("sh", "make sail"), "no target sail"),
    "wrong output": (fence("python", "print(1)") + fence("text", "2"), "printed was"),
    "output of nobody": (fence("text", "2"), "output of no block"),
    "output of a block that is not run": (
        fence("sh", "ardusub", "not run: needs it") + fence("text", "2"),
        "of no block",
    ),
    "no language": (fence("", "x"), "without a language"),
    "an indented block": ("words\n\n    cosim run paper\n", "indented"),
    "an unknown language": (fence("cobol", "x"), "nobody checks blocks of 'cobol'"),
    "a language that cannot be run": (fence("matlab", "x"), "nobody checks"),
    "an unknown directive": (fence("python", "x = 1", "skip"), "unknown directive 'skip'"),
    "a directive without a block": ("<!-- not run: needs it -->\n\nwords\n", "no block follows"),
    "an unknown reason": (fence("python", "x = 1", "not run: later"), "unknown reason"),
    "a flag of nobody, not run": (fence("sh", "cosim run paper --quick", "not run: takes minutes"), "know --quick"),
    "a place-holder that is none": (fence("sh", "cosim rerun DIR ROW", "not run: takes minutes"), "invalid int"),
    "TOML of nothing": (fence("toml", "a = 1"), "expected one of"),
    "TOML that is none": (fence("toml", "a = = 1", "scenario"), "block.toml"),
    "a key of nobody": (fence("toml", "[time]\nduratoin = 1.0", "scenario onto: paper"), "duratoin"),
    "a vehicle that cannot be": (fence("toml", "[hull]\nradius = -1.0", "vehicle onto: odin"), "radius"),
    "JSON that is none": (fence("json", '{"a": 1'), "page.md:3"),
    "an unknown command": (fence("json", '{"command": "fly"}', "commands of: harbour"), "is refused"),
    "a scene that is none": (fence("json", '{"seed": 1}', "scenes"), "start"),
    "XML that is none": (fence("xml", "<a>"), "no element|unclosed"),
    "C that is none": (fence("c", "int f( { }"), "error"),
    "a setup for no command": (fence("sh", "ls", 'setup sh "cosim"\nls\n'), "no command begins with 'cosim'"),
}


@pytest.mark.slow
@pytest.mark.parametrize("text", RIGHT.values(), ids=RIGHT)
def test_correct_blocks_pass(text, run):
    run(text)


@pytest.mark.parametrize(("text", "why"), WRONG.values(), ids=WRONG)
def test_incorrect_blocks_fail(text, why, run):
    with pytest.raises(PageError, match=why):
        run(text)


def test_file_block_is_written_with_its_base_scenario(run):
    folder = run(fence("toml", "[time]\nduration = 5.0", "scenario onto: docking", "file: mine.toml"))
    assert (folder / "mine.toml").read_text().startswith('base = "docking"\n[time]')


def test_ledger_lists_unrun_blocks_with_reasons(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        fence("sh", "ardusub --model JSON\nls", 'not run "ardusub": needs ArduPilot')
        + fence("matlab", "load('a.mat')", "not run: needs MATLAB")
        + fence("sh", "make run")
    )
    assert entries(page) == [
        "page.md | needs ArduPilot | ardusub --model JSON",
        "page.md | needs MATLAB | matlab: load('a.mat')",
        "page.md | changes the machine; its extras or targets are looked up | make run",
    ]


def test_unrun_commands_are_checked_for_unknown_flags(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(fence("sh", "cosim run paper --outt runs/a"))
    (block,) = blocks(page)
    with pytest.raises(PageError, match=re.escape("does not know --outt")):
        check_unrun(block)


@pytest.mark.parametrize(
    ("shown", "value", "same"),
    [
        ("0.5", 0.54, True),
        ("0.5", 0.56, False),
        ("0.50", 0.54, False),
        ("1", 1.0000001, False),
        ("1e3", 1000.4, True),
        ("(0.1, ..., 0.3)", (0.1, 5, 6, 0.3), True),
        ("(0.1, ..., 0.3)", (0.1, 5, 6, 0.4), False),
        ("{'a': -0.5}", {"a": -0.5}, True),
        ("{'a': -0.5}", {"a": 0.5}, False),
        ('"alpha_3"', "alpha_3", True),
        ('"alpha_3"', "alpha_2", False),
        ("True", False, False),
        ("[1, 2]", [1, 2, 3], False),
        ("[1, 2, 3]", [1, 2], False),
    ],
)
def test_values_are_compared_to_their_shown_digits(shown, value, same):
    assert same_value(shown, value) is same


def test_only_literals_in_comments_are_results():
    assert shown_result("array([1.0, 2.0])") == "array([1.0, 2.0])"
    assert shown_result("inside: (1, 2)") == "(1, 2)"
    assert shown_result("meters") is None
    assert shown_result("f(2)") is None
    assert shown_result("[deg C]") is None


def test_output_is_compared_by_lines():
    assert same_output("a\n...\nd", "a  \nb\nc\nd\n")
    assert same_output("took ... s", "took 0.3 s\n")
    assert not same_output("a\nb", "a b\n")
    assert not same_output("a", "a\nb\n")


def test_directives_may_be_in_a_separate_file(run, tmp_path, monkeypatch):
    monkeypatch.setattr("tests.docs.pages.BESIDE", tmp_path)
    (tmp_path / "page.toml").write_text('"cosim show" = ["exits: 2"]\n')
    run(fence("sh", "cosim show nothing"))


def test_separate_directive_without_a_block_is_rejected(tmp_path, monkeypatch):
    monkeypatch.setattr("tests.docs.pages.BESIDE", tmp_path)
    (tmp_path / "page.toml").write_text('"cosim show" = ["slow"]\n"cosim fly" = ["slow"]\n')
    (tmp_path / "page.md").write_text(fence("sh", "cosim show paper"))
    with pytest.raises(PageError, match=re.escape("page.md: no block begins with 'cosim fly'")):
        blocks(tmp_path / "page.md")
