"""The project's own commands: run within the tests' process, and their flags looked up."""

import argparse
import io
import re
import runpy
import sys
import tomllib
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from functools import cache
from pathlib import Path
from unittest import mock

import matplotlib.pyplot as plt

import benchmarks.__main__
import cosim.command_line.cli
import fuzzy_arbiter.__main__
import plant_fmu.__main__
from cosim.run.progress import COMPILING_NOTICE
from tests.docs.directives import PageError
from tests.docs.pages import ROOT

MODULES = {
    "cosim": cosim.command_line.cli,
    "plant_fmu": plant_fmu.__main__,
    "fuzzy_arbiter": fuzzy_arbiter.__main__,
    "benchmarks": benchmarks.__main__,
}


def program(words: Sequence[str]) -> tuple[str, list[str]] | None:
    """Return the project's program that a command calls, and its arguments; None for others."""
    if words[:1] in (["cosim"], [".venv/bin/cosim"]):
        return "cosim", list(words[1:])
    if list(words[:2]) in (["python", "-m"], ["python3", "-m"]) and len(words) > 2 and words[2] in MODULES:
        return words[2], list(words[3:])
    return None


def run_program(name: str, arguments: list[str]) -> tuple[int, str, str]:
    """Run one of our programs and return its exit status, standard output and standard error."""
    return _captured(lambda: MODULES[name].main(arguments))


def run_script(script: str, arguments: list[str]) -> tuple[int, str, str]:
    """Run a script, of the folder or else of the repository, as a program of its own would be."""
    path = next((path for path in (Path(script), ROOT / script) if path.exists()), None)
    if path is None:
        raise PageError(f"there is no script {script}")
    with mock.patch.object(sys, "argv", [str(path), *arguments]):
        return _captured(lambda: runpy.run_path(str(path), run_name="__main__") and None)


def _captured(call: Callable[[], int | None]) -> tuple[int, str, str]:
    output = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True)
    errors = io.StringIO()
    with redirect_stdout(output), redirect_stderr(errors):
        try:
            status = call() or 0
        except SystemExit as ended:
            status = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
            if isinstance(ended.code, str):
                errors.write(ended.code)
        finally:
            plt.close("all")
    compiled = f"cosim: {COMPILING_NOTICE}\n"  # whether it is depends on what earlier runs kept
    return status, output.buffer.getvalue().decode(), errors.getvalue().replace(compiled, "")


def parses(name: str, arguments: list[str]) -> str:
    """Return why a program does not understand its arguments; empty if it does."""
    parser = getattr(MODULES[name], "_parsed", None) or MODULES[name]._parser().parse_args
    status, output, errors = _captured(lambda: parser(arguments) and None)
    return (errors or output).strip() if status else ""


def wrong_flags(words: Sequence[str]) -> list[str]:
    """Return what of a command, which may hold place-holders, its program does not know: the verb, or flags."""
    found = program(words)
    if found is None:
        return []
    name, arguments = found
    verb = next((word for word in arguments if not word.startswith("-")), None)
    verbs = flags(name)
    if verb is not None and verb not in verbs and not re.fullmatch(r"[A-Z…]+|\.\.\.", verb):
        return [verb]
    known = verbs[""] | (verbs.get(verb, set()) if verb else set())
    used = [word.partition("=")[0] for word in arguments if re.match(r"--?[a-zA-Z]", word)]
    return [flag for flag in used if flag not in known]


@cache
def flags(name: str) -> dict[str, set[str]]:
    """Return the flags of each verb of a program, and below "" those before a verb."""
    parser = MODULES[name]._parser()
    found = {"": set(parser._option_string_actions)}
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            found |= {verb: _flags_within(sub) for verb, sub in action.choices.items()}
    return found


def _flags_within(parser: argparse.ArgumentParser) -> set[str]:
    """Return the flags of a verb, and of the verbs within it."""
    inner = [
        flag
        for action in parser._actions
        if isinstance(action, argparse._SubParsersAction)
        for verb in action.choices.values()
        for flag in _flags_within(verb)
    ]
    return {*parser._option_string_actions, *inner}


def check_foreign(words: list[str]) -> bool:
    """Check what can be said of pip and make without running them; return whether it is one of these.

    What pip changes belongs to the machine, and make calls pip: extras and targets must exist.
    """
    if words[:2] == ["pip", "install"] or words[1:4] == ["-m", "pip", "install"]:
        for file, place in (("pyproject.toml", r"\."), ("fuzzy_arbiter/pyproject.toml", r"\./fuzzy_arbiter")):
            known = tomllib.loads((ROOT / file).read_text())["project"]
            for word in words:
                if match := re.fullmatch(rf"(?:{place}|{known['name']}(?: @ \S+)?)\[([^]]*)\](?: @ \S+)?", word):
                    unknown = set(match[1].split(",")) - set(known["optional-dependencies"])
                    if unknown:
                        raise PageError(f"{file} has no extra {', '.join(sorted(unknown))}")
        return True
    if words[0] == "make":
        targets = re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.M)
        for word in words[1:]:
            if not re.match(r"[A-Z_]+=", word) and word not in targets:
                raise PageError(f"Makefile has no target {word}")
        return True
    return False
