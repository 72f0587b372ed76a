"""Writes the reference of the command lines from their parsers: ``python docs/reference/command_line.py``."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from cosim.command_line.cli import _parser as cosim
from fuzzy_arbiter.__main__ import _parser as fuzzy_arbiter
from plant_fmu.__main__ import _parser as plant_fmu

PAGE = Path(__file__).with_name("command-line.md")

_HEAD = """# Command line

Every verb and its flags, written from the parsers themselves: `python docs/reference/command_line.py`. Each verb says
the same with `--help`. Words without dashes are required unless they stand in brackets, flags are not unless they say
so; `...` stands for several.

Exit codes: 0; 1 where a check fails; 2 where the user must mend something, said in one line on standard error; 130
after Ctrl-C, SIGTERM or SIGHUP (a closed terminal), which leave a readable run; 141 where whoever reads the output goes
away, as `head` does. `-v` and `-q` of `cosim` may stand behind the verb, too.

`cosim help --completion bash`, `zsh` or `fish` prints a script by which the shell completes verbs, flags, shipped
scenarios and files; `cosim help --help` says where each shell looks for it.
"""
_EVERYWHERE = {"verbose", "quiet"}
_EXAMPLES = """<!-- not run: excerpt of the help, whose examples a test parses -->
```text
{}
```"""


def page() -> str:
    """Return the page, in Markdown."""
    parts = [_HEAD]
    for parser in (cosim(), plant_fmu(), fuzzy_arbiter()):
        parts += [f"## {parser.prog}", parser.description or "", _table(parser)]
        parts += _epilog(parser)
        for name, verb, what in verbs(parser):
            said = (verb.description or what).strip().rstrip(".")
            parts += [f"### {parser.prog} {name}", f"{said[0].upper()}{said[1:]}.", _table(verb), *_epilog(verb)]
    return "\n\n".join(part.strip("\n") for part in parts if part) + "\n"


def _epilog(parser: argparse.ArgumentParser) -> list[str]:
    """Return the notes, the examples, and the link to the page, of the end of a help text."""
    notes, _, rest = (parser.epilog or "").partition("examples:\n")
    examples, _, page = rest.partition("more: docs/")
    lines = [line.strip() for line in examples.strip().splitlines()]
    if not page:
        return [notes.strip(), _EXAMPLES.format("\n".join(lines)) if lines else ""]
    link = "" if page == f"reference/{PAGE.name}" else f"More: [{page}](../{page})."
    return ["Examples:\n\n" + "\n".join(f"- `{line}`" for line in lines), link]


def verbs(parser: argparse.ArgumentParser, before: str = "") -> Iterator[tuple[str, argparse.ArgumentParser, str]]:
    """Return each verb, and those within it: its name, its parser, and what it is for."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            said = {choice.dest: choice.help or "" for choice in action._choices_actions}
            for name, verb in action.choices.items():
                yield f"{before}{name}", verb, said[name]
                yield from verbs(verb, f"{before}{name} ")


def _own(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """Return the arguments of a parser that the page lists: all but help, verbs, and what goes with every verb."""
    left_out = (argparse._HelpAction, argparse._SubParsersAction)
    return [
        a
        for a in parser._actions
        if not isinstance(a, left_out) and not (a.dest in _EVERYWHERE and a.default is argparse.SUPPRESS)
    ]


def _called(action: argparse.Action, which: int) -> str:
    """Return an argument as it is written, an option by its `which`-th name."""
    value = action.metavar if isinstance(action.metavar, str) else None
    if value is None and action.choices is not None:
        value = "{" + ",".join(map(str, action.choices)) + "}"
    if value is None:
        value = action.dest if not action.option_strings else action.dest.upper()
    if action.nargs in ("*", "+"):
        value += " ..."
    if action.nargs == "*":
        value = f"[{value}]"
    if action.nargs == "?":
        value = f"[{value}]"
    if not action.option_strings:
        return value
    return action.option_strings[which] if action.nargs == 0 else f"{action.option_strings[which]} {value}"


def _table(parser: argparse.ArgumentParser) -> str:
    rows = []
    for action in _own(parser):
        names = range(len(action.option_strings)) if action.option_strings else [0]
        called = ", ".join(f"`{_called(action, which)}`" for which in names)
        said = (action.help or "") % {**vars(action), "prog": parser.prog}
        said += "; required" if action.option_strings and action.required else ""
        rows.append(f"| {_cell(called)} | {_cell(said)} |")
    return "\n".join(["| argument | meaning |", "|---|---|", *rows]) if rows else ""


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;").replace("\n", " ")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
