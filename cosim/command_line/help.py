"""``cosim help``: the help of verbs, and the scripts by which shells complete them."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

from cosim.command_line.flags import add_verb, flag

SHELLS = ("bash", "zsh", "fish")

_FOLDERS = {"DIR", "RUN", "RUN|URL"}  # metavars of folders
_SCENARIOS = {
    "bash": """_cosim_scenarios() {{
  compgen -W "{names}" -- "$1"
  compgen -f -X '!*.toml' -- "$1"
  compgen -d -- "$1"
}}""",
    "zsh": """_cosim_scenarios() {{
  compadd {names}
  _files -g '*.toml'
}}""",
    "fish": """function _cosim_scenarios
  printf '%s\\n' {names}
  __fish_complete_path (commandline -ct) | string match -r '^.*(?:\\.toml|/)(?:\\t.*)?$'
end""",
}


def add_verbs(verbs: Any, parser: argparse.ArgumentParser) -> None:
    """Add the verb to the subparsers of the command."""
    verb = add_verb(
        verbs, "help", help_, "print this help, that of a verb, or a script that lets a shell complete this command",
        "reference/command-line",
        ("help run", "help --completion bash > ~/.local/share/bash-completion/completions/cosim",
         "help --completion zsh > ~/.zfunc/_cosim    # a folder of fpath",
         "help --completion fish > ~/.config/fish/completions/cosim.fish"),
    )  # fmt: skip
    group = verb.add_mutually_exclusive_group()
    group.add_argument("about", nargs="?", choices=tuple(verbs.choices), metavar="VERB", help="such as run")
    flag(group, "--completion SHELL", f"print the script for a shell: {', '.join(SHELLS)}", choices=SHELLS)
    verb.set_defaults(parser=parser, verbs=verbs.choices)


def help_(options: argparse.Namespace) -> int:
    """Run ``cosim help``."""
    if options.completion:
        print(_completion(options.parser, options.completion))
    else:
        (options.verbs[options.about] if options.about else options.parser).print_help()
    return 0


def _completion(parser: argparse.ArgumentParser, shell: str) -> str:
    """Return the script by which a shell completes verbs, flags, scenarios and files."""
    import shtab

    from cosim.scenario.toml_file import list_scenarios

    names = " ".join(list_scenarios())
    scenarios = dict.fromkeys(SHELLS, "_cosim_scenarios") | {
        "fish": "(_cosim_scenarios)",
        "preamble": {shell: text.format(names=names) for shell, text in _SCENARIOS.items()},
    }
    for action in _actions(parser):
        if action.dest in ("scenario", "source"):
            action.complete = scenarios  # type: ignore[attr-defined]
        elif action.metavar in _FOLDERS:
            action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]
        elif action.dest in ("scenes", "signing_key", "commands", "out", "vehicle"):
            action.complete = shtab.FILE  # type: ignore[attr-defined]
    script: str = shtab.complete(parser, shell)
    return script


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Yield the arguments of a command and its verbs."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for verb in action.choices.values():
                yield from _actions(verb)
