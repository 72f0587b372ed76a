"""``cosim completion``: verbs, flags, scenarios and files, completed by the shell."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any

SHELLS = ("bash", "zsh", "fish")

_EPILOG = """to keep it:
  cosim completion bash > ~/.local/share/bash-completion/completions/cosim
  cosim completion zsh > ~/.zfunc/_cosim    # a folder of fpath
  cosim completion fish > ~/.config/fish/completions/cosim.fish
"""
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


def add_verb(verbs: Any, parser: argparse.ArgumentParser) -> None:
    """Add the verb to the parser."""
    completion = verbs.add_parser(
        "completion", help="print a script that lets a shell complete this command",
        epilog=_EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    completion.add_argument("shell", choices=SHELLS, metavar="SHELL", help=", ".join(SHELLS))
    completion.set_defaults(completed=parser)


def completion(options: argparse.Namespace) -> int:
    """Run ``cosim completion``."""
    import shtab

    from cosim.scenario.toml_file import list_scenarios

    names = " ".join(list_scenarios())
    scenarios = dict.fromkeys(SHELLS, "_cosim_scenarios") | {
        "fish": "(_cosim_scenarios)",
        "preamble": {shell: text.format(names=names) for shell, text in _SCENARIOS.items()},
    }
    for action in _actions(options.completed):
        if action.dest in ("scenario", "scenarios"):
            action.complete = scenarios  # type: ignore[attr-defined]
        elif action.metavar in _FOLDERS:
            action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]
        elif action.dest in ("scenes", "signing_key", "commands", "out", "vehicle"):
            action.complete = shtab.FILE  # type: ignore[attr-defined]
    print(shtab.complete(options.completed, options.shell))
    return 0


def _actions(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """Yield the arguments of a command and its verbs."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for verb in action.choices.values():
                yield from _actions(verb)
