"""Every function of FMI with each of its pointers NULL in turn: a C program made from FMI's own headers.

The program says what it is about to call before it calls it, so that a crash names its function.
"""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import fmpy
import pytest

from plant_fmu.build import neutral_members
from plant_fmu.compiling.compiler import find_compiler
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

_HANDLES = {"fmi2Component", "fmi3Instance"}
_STATES = {"fmi2FMUstate", "fmi3FMUState"}
_POINTERS = _HANDLES | _STATES | {"fmi2String", "fmi3String", "fmi3InstanceEnvironment"}
_GIVEN = {
    "functions": "&callbacks", "logMessage": "log_callback", "instanceName": '"x"',
    "fmuGUID": "TOKEN", "instantiationToken": "TOKEN",
}  # fmt: skip
_COUNTS = {
    "nx": "SOME_STATES",
    "nContinuousStates": "SOME_STATES",
    "size": "size",
    "nRequiredIntermediateVariables": "0",
}


@dataclass(frozen=True)
class Argument:
    """Of a function, as the header declares it."""

    kind: str
    name: str
    stars: str  # the rest of its declaration

    @property
    def is_pointer(self) -> bool:
        """Whether it can be NULL."""
        return bool(self.stars) or self.kind in _POINTERS or self.kind.endswith("Callback")

    @property
    def is_counted(self) -> bool:
        """Whether another argument gives the number of values."""
        return self.stars == "[]" and not self.name.startswith("serializedState")

    def given(self) -> str:
        """What is passed where it is not to be NULL."""
        if self.name in _GIVEN:
            return _GIVEN[self.name]
        if self.kind in _HANDLES:
            return "c"
        if self.kind in _STATES:
            return "&slot" if self.stars else "saved"
        if self.kind == "size_t" and not self.stars:
            return _COUNTS.get(self.name, "1")
        if self.stars == "[]" and self.kind.endswith("String"):
            return "names"
        return "(void *)area" if self.stars else "0"


@dataclass(frozen=True)
class Function:
    """Of FMI."""

    name: str
    returns: str
    arguments: tuple[Argument, ...]


def functions(fmi: int) -> list[Function]:
    """Return all functions that FMI's header declares the types of."""
    text = re.sub(r"/\*.*?\*/", "", (HEADERS / f"fmi{fmi}FunctionTypes.h").read_text(), flags=re.S)
    found = []
    for returns, name, inside in re.findall(r"typedef\s+([\w ]+\*?)\s*(fmi\d\w+)TYPE\s*\(([^;]*)\)\s*;", text):
        arguments = []
        for declared in re.sub(r"\s+", " ", inside).strip().split(","):
            if declared.strip() == "void":
                continue
            kind, stars, label, array = re.fullmatch(r"\s*(?:const )?(\w+) ?(\*?) ?(\w*)(\[\])?\s*", declared).groups(
                ""
            )
            arguments.append(Argument(kind, label or "serializedState", stars + array))
        found.append(Function(name, returns.strip(), tuple(arguments)))
    return found


def exports(fmi: int) -> set[str]:
    """Return the names that FMI's header declares functions under."""
    text = (HEADERS / f"fmi{fmi}Functions.h").read_text()
    return {f"fmi{fmi}{name}" for name in re.findall(rf"^\s*FMI{fmi}_Export fmi{fmi}(\w+)TYPE", text, re.MULTILINE)}


def _calls(function: Function) -> list[tuple[str, str]]:
    """Return what is called: the argument that is NULL, and the call."""
    given = {a.name: a.given() for a in function.arguments}

    def call(**changed: str) -> str:
        return f"{function.name}({', '.join({**given, **changed}.values())})"

    found = [(NO_ARGUMENT, call())]
    found += [(a.name, call(**{a.name: "NULL"})) for a in function.arguments if a.is_pointer]
    if any(a.is_counted for a in function.arguments):
        none = {a.name: "0" for a in function.arguments if a.kind == "size_t" and not a.stars}
        found.append((NONE_OF_ALL, call(**none)))
        found.append((NONE_OF_ALL, call(**none, **{a.name: "NULL" for a in function.arguments if a.is_counted})))
    return found


def program(fmi: int, token: str, states: int) -> str:
    """Return the C program, which prints a line for each call: mode, function, argument, status and what was logged."""
    cases = []
    for function in functions(fmi):
        for argument, call in _calls(function):
            made = {"fmi2Component": f"taken({call})", "fmi3Instance": f"taken({call})"}
            done = made.get(function.returns) or (f"(int){call}" if "Status" in function.returns else f"({call}, 0)")
            if function.name.endswith("FreeInstance") and argument == NO_ARGUMENT:
                continue  # each call ends so
            cases.append(f'    if (begin(mode, "{function.name}", "{argument}")) status = {done}, end(status);')
    instantiate = {
        2: 'fmi2Instantiate("x", mode > 3 ? fmi2ModelExchange : fmi2CoSimulation, TOKEN, NULL, &callbacks, 0, 0)',
        3: 'mode > 3 ? fmi3InstantiateModelExchange("x", TOKEN, NULL, 0, 0, NULL, log_callback)\n'
        '    : fmi3InstantiateCoSimulation("x", TOKEN, NULL, 0, 0, 0, 0, NULL, 0, NULL, log_callback, NULL)',
    }[fmi]
    start = {2: "fmi2SetupExperiment(c, 0, 0, 0, 0, 0), fmi2EnterInitializationMode(c)",
             3: "fmi3EnterInitializationMode(c, 0, 0, 0, 0, 0)"}[fmi]  # fmt: skip
    text = (Path(__file__).parent / "nulls.c").read_text()
    values = {
        "FMI": str(fmi), "TOKEN": token, "STATES": str(states), "INSTANTIATE": instantiate, "START": start,
        "CASES": "\n".join(cases), "FMUSTATE": "state" if fmi == 2 else "State",
    }  # fmt: skip
    return re.sub(r"@(\w+)@", lambda match: values[match[1]], text)


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


def sweep_sources(folder: Path, fmi: int, component: Component) -> list[list[str]]:
    """Sweep a component's C sources under AddressSanitizer and UndefinedBehaviorSanitizer, if there are any."""
    for name, data in neutral_members(component, fmi).items():
        if name.startswith("sources/"):
            (folder / Path(name).name).write_bytes(data)
    sources = sorted(str(path) for path in folder.glob("*.c"))
    states = sum(v.role == "state" for v in component.variables)
    plain_names = f"-DFMI{fmi}_OVERRIDE_FUNCTION_PREFIX"
    try:
        return sweep(folder, fmi, token(component, fmi), states, [*sources, plain_names, "-O1", *SANITIZERS])
    except subprocess.CalledProcessError as error:
        pytest.skip(f"the compiler has no sanitizers: {error.stderr[-300:]}")


def faults(rows: list[list[str]]) -> list[str]:
    """Return what is wrong: a crash, a NULL that is not refused, or one refused without a reason."""
    found, before = [], []
    for row in rows:
        if len(row) != 5:
            return [*found, f"crashed: {' '.join(row)}"]
        mode, function, argument, status, said = row
        where = f"{function} with {argument} NULL, mode {mode}: {status} {said}"
        if argument == NO_ARGUMENT and " is NULL" in said:
            found.append(where)
        elif argument == NONE_OF_ALL:
            if before[:3] == row[:3] and before != row:
                found.append(where)
        elif argument in MAY_BE_NULL or (function in IGNORED and argument not in ("c", "instance")):
            if " is NULL" in said:
                found.append(where)
        elif argument != NO_ARGUMENT and function not in ("fmi2FreeInstance", "fmi3FreeInstance"):
            heard = argument not in ("c", "instance", "functions") and not mode.startswith("silent")
            words = (
                f"{function}: {argument} is NULL",
                "instance name is NULL",
                'token is "NULL"',
                "not offered",
                "alone",
            )
            reason = any(word in said for word in (*words, "not scheduled execution"))
            if int(status) < 3 or reason != heard:
                found.append(where)
        before = row
    return found
