"""Every function of FMI with each of its pointers NULL in turn: a C program made from FMI's own headers.

The program says what it is about to call before it calls it, so that a crash names its function.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import fmpy
import pytest

from plant_fmu.compiling.compiler import find_compiler
from plant_fmu.compiling.sources import all_sources
from plant_fmu.component import Component
from plant_fmu.description import token

SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
HEADERS = Path(fmpy.__file__).parent / "c-code"
NO_ARGUMENT = "-"  # a call without a NULL
NONE_OF_ALL = "n = 0"  # a call for no values at all, with and without arrays

# what the standard lets be NULL (2.1.5 and 2.1.8 of FMI 2.0.4, 2.3.1 and 2.2.10 of FMI 3.0.2), and what it does not use
MAY_BE_NULL = {
    "fmuResourceLocation", "resourcePath", "instanceEnvironment", "logMessage", "intermediateUpdate", "clockUpdate",
    "lockPreemption", "unlockPreemption", "requiredIntermediateVariables",
}  # fmt: skip
IGNORED = {"fmi2FreeFMUstate", "fmi3FreeFMUState", "fmi2FreeInstance", "fmi3FreeInstance"}  # a NULL to be freed

# what is passed where it is not to be NULL, by the argument's name, type and rest of its declaration
_GIVEN = (
    ("functions .*", "&callbacks"), ("logMessage .*", "log_callback"), ("instanceName .*", '"x"'),
    ("(fmuGUID|instantiationToken) .*", "TOKEN"), (r"\w+ (fmi2Component|fmi3Instance) ", "c"),
    (r"\w+ (fmi2FMUstate|fmi3FMUState) \*", "&slot"), (r"\w+ (fmi2FMUstate|fmi3FMUState) ", "saved"),
    ("(nx|nContinuousStates) size_t ", "SOME_STATES"), ("size size_t ", "size"),
    ("nRequiredIntermediateVariables size_t ", "0"), (r"\w+ size_t ", "1"), (r"\w+ fmi\dString \[\]", "names"),
    (r".* (\*|\[\]|\*\[\])", "(void *)area"), (".*", "0"),
)  # fmt: skip
_POINTERS = re.compile(r"fmi2(Component|FMUstate|String)|fmi3(Instance|FMUState|String|InstanceEnvironment)|.*Callback")

Arguments = list[tuple[str, str, str]]  # name, type, rest of the declaration


def functions(fmi: int) -> dict[str, tuple[str, Arguments]]:
    """Return what each function returns and takes, of all that FMI's header declares the types of."""
    text = re.sub(r"/\*.*?\*/", "", (HEADERS / f"fmi{fmi}FunctionTypes.h").read_text(), flags=re.S)
    found = {}
    for returns, name, inside in re.findall(r"typedef\s+([\w ]+\*?)\s*(fmi\d\w+)TYPE\s*\(([^;]*)\)\s*;", text):
        declared = [part for part in re.sub(r"\s+", " ", inside).strip().split(",") if part.strip() != "void"]
        parts = [re.fullmatch(r"\s*(?:const )?(\w+) ?(\*?) ?(\w*)(\[\])?\s*", part).groups("") for part in declared]
        arguments = [(label or "serializedState", kind, stars + array) for kind, stars, label, array in parts]
        found[name] = returns.strip(), arguments
    return found


def exports(fmi: int) -> set[str]:
    """Return the names that FMI's header declares functions under."""
    text = (HEADERS / f"fmi{fmi}Functions.h").read_text()
    return {f"fmi{fmi}{name}" for name in re.findall(rf"^\s*FMI{fmi}_Export fmi{fmi}(\w+)TYPE", text, re.MULTILINE)}


def _calls(function: str, arguments: Arguments) -> list[tuple[str, str]]:
    """Return what is called: the argument that is NULL, and the call."""
    given = {a[0]: next(text for form, text in _GIVEN if re.fullmatch(form, " ".join(a))) for a in arguments}

    def call(**changed: str) -> str:
        return f"{function}({', '.join((given | changed).values())})"

    found = [(NO_ARGUMENT, call())]
    found += [(name, call(**{name: "NULL"})) for name, kind, rest in arguments if rest or _POINTERS.fullmatch(kind)]
    arrays = {a[0]: "NULL" for a in arguments if a[2] == "[]" and not a[0].startswith("serializedState")}
    if arrays:
        none = {name: "0" for name, kind, rest in arguments if kind == "size_t" and not rest}
        found += [(NONE_OF_ALL, call(**none)), (NONE_OF_ALL, call(**none, **arrays))]
    return found


def program(fmi: int, token: str, states: int) -> str:
    """Return the C program, which prints a line for each call: mode, function, argument, status and what was logged."""
    cases = []
    for function, (returns, arguments) in functions(fmi).items():
        for argument, call in _calls(function, arguments):
            if function.endswith("FreeInstance") and argument == NO_ARGUMENT:
                continue  # each call ends so
            made = returns in ("fmi2Component", "fmi3Instance")
            done = f"taken({call})" if made else f"(int){call}" if "Status" in returns else f"({call}, 0)"
            cases.append(f'    if (begin(mode, "{function}", "{argument}")) status = {done}, end(status);')
    instantiate = {
        2: 'fmi2Instantiate("x", mode > 3 ? fmi2ModelExchange : fmi2CoSimulation, TOKEN, NULL, &callbacks, 0, 0)',
        3: 'mode > 3 ? fmi3InstantiateModelExchange("x", TOKEN, NULL, 0, 0, NULL, log_callback)\n'
        '    : fmi3InstantiateCoSimulation("x", TOKEN, NULL, 0, 0, 0, 0, NULL, 0, NULL, log_callback, NULL)',
    }[fmi]
    start = {2: "fmi2SetupExperiment(c, 0, 0, 0, 0, 0), fmi2EnterInitializationMode(c)",
             3: "fmi3EnterInitializationMode(c, 0, 0, 0, 0, 0)"}[fmi]  # fmt: skip
    values = {
        "FMI": str(fmi), "TOKEN": token, "STATES": str(states), "INSTANTIATE": instantiate, "START": start,
        "CASES": "\n".join(cases), "FMUSTATE": "state" if fmi == 2 else "State",
    }  # fmt: skip
    return re.sub(r"@(\w+)@", lambda match: values[match[1]], (Path(__file__).parent / "nulls.c").read_text())


def sweep(folder: Path, fmi: int, token: str, states: int, with_: list[str]) -> list[list[str]]:
    """Build the program with what is to be called, run it, and return its lines split at tabs.

    The line of a call that ended the program is the last and has no status.
    """
    source, built = folder / "nulls.c", folder / "nulls"
    source.write_text(program(fmi, token, states))
    command = [*find_compiler(), "-std=c99", "-g", f"-I{folder}", f"-I{HEADERS}", str(source), *with_]
    subprocess.run([*command, "-lm", "-o", str(built)], check=True, capture_output=True, text=True)
    done = subprocess.run([built], capture_output=True, text=True, check=False)
    rows = [line.split("\t") for line in done.stdout.splitlines()]
    if done.returncode != 0:
        rows[-1] = [*rows[-1][:3], f"signal {-done.returncode} {done.stderr[-3000:]}"]
    return rows


def write_sources(folder: Path, fmi: int, component: Component) -> list[str]:
    """Write a component's C sources, and return the files to compile and the macro for FMI's plain names."""
    for name, data in all_sources(component, fmi, token(component, fmi)).items():
        (folder / name).write_bytes(data)
    return [*sorted(map(str, folder.glob("*.c"))), f"-DFMI{fmi}_OVERRIDE_FUNCTION_PREFIX"]


def sweep_sources(folder: Path, fmi: int, component: Component) -> list[list[str]]:
    """Sweep a component's C sources under AddressSanitizer and UndefinedBehaviorSanitizer, if there are any."""
    states = sum(v.role == "state" for v in component.variables)
    sources = write_sources(folder, fmi, component)
    try:
        return sweep(folder, fmi, token(component, fmi), states, [*sources, "-O1", *SANITIZERS])
    except subprocess.CalledProcessError as error:
        pytest.skip(f"the compiler has no sanitizers: {error.stderr[-300:]}")


def faults(rows: list[list[str]]) -> list[str]:
    """Return what is wrong: a crash, a NULL that is not refused, or one refused without a reason."""
    found, before = [], []
    for row in rows:
        if len(row) != 5:
            return [*found, f"crashed: {' '.join(row)}"]
        mode, function, argument, status, said = row
        names_null = " is NULL" in said
        if argument == NONE_OF_ALL:
            wrong = before[:3] == row[:3] and before != row
        elif argument in (NO_ARGUMENT, *MAY_BE_NULL) or (function in IGNORED and argument not in ("c", "instance")):
            wrong = names_null
        elif function in ("fmi2FreeInstance", "fmi3FreeInstance"):
            wrong = False
        else:
            heard = argument not in ("c", "instance", "functions") and not mode.startswith("silent")
            reasons = (f"{function}: {argument} is NULL", "instance name is NULL", 'token is "NULL"', "not offered",
                       "alone", "not scheduled execution")  # fmt: skip
            wrong = int(status) < 3 or any(reason in said for reason in reasons) != heard
        if wrong:
            found.append(f"{function} with {argument} NULL, mode {mode}: {status} {said}")
        before = row
    return found
