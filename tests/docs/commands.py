"""Blocks of commands: each line split as a shell does, and run or checked."""

import os
import shlex
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from tests.docs.directives import PageError, of_command
from tests.docs.pages import Block
from tests.docs.programs import check_foreign, parses, program, run_program, run_script, wrong_flags

FILES = {"cat", "cc", "cp", "head", "ls", "mkdir", "mv", "unzip"}
TIMEOUT = 60  # s, of a command that is not ours


@dataclass(frozen=True)
class Command:
    """One command: as it is printed, its words, where its output goes ("" for the page) and its line in the page."""

    text: str
    words: list[str]
    out: str
    line: int


def commands(block: Block) -> list[Command]:
    """Return the commands of a block; what only a shell understands is a PageError."""
    found = []
    held, first = "", block.line
    for line, text in enumerate(block.text.splitlines(), block.line):
        if not held:
            first = line
        held += text
        if held.endswith("\\"):
            held = held[:-1]
            continue
        try:
            words = shlex.split(held, comments=True)
        except ValueError as error:
            raise PageError(f"{block.page}:{first}: {error}") from error
        printed, held = held, ""
        if not words:
            continue
        out = ""
        if len(words) > 2 and words[-2] == ">":
            *words, _, out = words
        if words[0] == "$" or {"|", "&", "&&", ";", "<", ">", ">>", "||"} & set(words):
            raise PageError(f"{block.page}:{first}: one command a line, without prompt, pipe or &, > FILE at its end")
        found.append(Command(printed, words, out, first))
    if held:
        raise PageError(f"{block.page}:{first}: nothing follows the last backslash")
    return found


def run_commands(block: Block, prepare: Callable[[list[str]], object] = lambda words: None) -> str:
    """Run the commands of a block in the present folder, each after `prepare`, and return what they printed."""
    printed = ""
    for command in commands(block):
        prepare(command.words)
        printed += _run(block, command)
    return printed


def check_commands(block: Block) -> None:
    """Check a block without running it: our programs must understand its commands, of a template verb and flags."""
    for command in commands(block):
        _check_unrun(block, command, "".join(of_command(block.directives.not_run, command.words)[:1]))


def _check_unrun(block: Block, command: Command, reason: str | None) -> bool:
    """Check a command, whose words are not parsed where it has no reason; return whether it is not run in any case."""
    where = f"{block.page}:{command.line}"
    if unknown := wrong_flags(command.words):
        raise PageError(f"{where}: {' '.join(command.words[:3])} does not know {', '.join(unknown)}")
    ours = program(command.words)
    if ours and reason is not None and not reason.startswith("template") and (why := parses(*ours)):
        raise PageError(f"{where}: {why}")
    try:
        return check_foreign(command.words)
    except PageError as error:
        raise PageError(f"{where}: {error}") from error


def _run(block: Block, command: Command) -> str:
    where = f"{block.page}:{command.line}"
    directives = block.directives
    reasons = of_command(directives.not_run, command.words)
    if _check_unrun(block, command, reasons[0] if reasons else None) or reasons:
        return ""
    more = " ".join(of_command(directives.run_with, command.words))
    words = command.words + shlex.split(more)
    status, output, errors = _status(where, words)
    expected = int((of_command(directives.exits, command.words) or ["0"])[-1])
    if status != expected:
        raise PageError(f"{where}: {shlex.join(words)} ends with {status}, expected {expected}\n{output}{errors}")
    if command.out:
        Path(command.out).write_text(output, encoding="utf-8")
        return ""
    return output + (errors if expected else "")


def _status(where: str, words: list[str]) -> tuple[int, str, str]:
    if words[0] == "cd":
        os.chdir(words[1])
        return 0, "", ""
    if ours := program(words):
        return run_program(*ours)
    if words[0] in ("python", "python3") and words[1:] and words[1].endswith(".py"):
        return run_script(words[1], words[2:])
    if words[0] in FILES or words[0].startswith("./"):
        done = subprocess.run(words, capture_output=True, text=True, timeout=TIMEOUT, check=False)
        return done.returncode, done.stdout, done.stderr
    raise PageError(f"{where}: {words[0]} is no command that the tests run; say why not: <!-- not run: needs ... -->")
