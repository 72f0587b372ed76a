"""The ``cosim`` command."""

# Slow imports are delayed until a verb needs them, so that help is fast and Ctrl-C works from the start.

from __future__ import annotations

import argparse
import atexit
import contextlib
import gc
import importlib
import logging
import re
import sys
from collections.abc import Iterator, Sequence
from typing import Any, NoReturn

from cosim.command_line import (
    campaigns,
    companion,
    export,
    falsify,
    help,
    identify,
    import_log,
    mavlink,
    report,
    run,
    scenes,
    show,
    sitl,
    sweep,
    watch,
)
from cosim.command_line.process import FAULT, print_status, run_guarded, signals_held
from plant_fmu.errors import one_line, printable

_EPILOG = """examples:
  cosim show
  cosim run docking --out runs/docking
  cosim run paper --set arbiter.engine=closed --set regions.SR1.gain=5000 --out runs/strong
  cosim report runs/docking runs/strong --replay --out both.html
  cosim run mine.toml --mavlink udpout:127.0.0.1:14550 --profile ardusub --commands
  cosim scenes --count 200 --seed 0 --out scenes.jsonl
  cosim campaign scenes.jsonl --law ismail_dunnigan --out campaigns/ismail_dunnigan --workers 2
  cosim sweep docking --vary initial.position.1=-4:-2 --samples 1000 --out sweeps/start --workers 2
"""


# flags that are accepted before and after the verb
_EVERYWHERE = {
    ("-v", "--verbose"): "log internal events",
    ("-q", "--quiet"): "no progress and no description of the outcome: print paths, errors and requested output alone",
}


class _Version(argparse.Action):
    """Prints the version, which is looked up only then, since the lookup is slow."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib import metadata

        try:
            version = metadata.version("subreach")
        except metadata.PackageNotFoundError:
            version = "of a folder that is not installed"
        print(f"cosim {version}")
        parser.exit()


class _Parser(argparse.ArgumentParser):
    """Parser that prints its errors in one line, as all other errors, and takes ``-33.8,151.2`` for a value."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self._negative_number_matcher = re.compile(r"-(\d|\.\d|inf|nan)")  # argparse itself knows single numbers alone

    def print_help(self, file: Any = None) -> None:
        """Print the help; argparse itself ignores output errors."""
        print(self.format_help(), end="", file=file)

    def error(self, message: str) -> NoReturn:
        verb = self.prog.removeprefix("cosim").strip()
        shown = one_line(message)
        print_status(f"{verb}: {shown}; see cosim {verb} --help" if verb else f"{shown}; see cosim --help")
        self.exit(FAULT)


class _Lines(logging.Formatter):
    """Formats each message as one line, with a traceback below it."""

    def formatMessage(self, record: logging.LogRecord) -> str:
        return printable(super().formatMessage(record))


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="cosim",
        description="Region-reaching underwater vehicles, co-simulated.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show program's version number and exit")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")

    for module in (show, run, watch, report, import_log, export, scenes, campaigns, sweep, falsify, identify, mavlink,
                   sitl, companion):  # fmt: skip
        module.add_verbs(verbs)
    help.add_verbs(verbs, parser)

    for flags, meaning in _EVERYWHERE.items():
        parser.add_argument(*flags, action="store_true", help=meaning)
        for _, verb in all_verbs(parser):
            verb.add_argument(*flags, action="store_true", default=argparse.SUPPRESS, help=meaning)
    return parser


def all_verbs(parser: argparse.ArgumentParser) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Yield the name and the parser of each verb, such as ``mavlink`` and ``mavlink listen``."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, verb in action.choices.items():
                yield name, verb
                yield from ((f"{name} {inner}", parser) for inner, parser in all_verbs(verb))


def run_console() -> int:
    """Run the command line in a process of its own."""
    gc.set_threshold(200_000)  # a run keeps nearly all it makes: modules, figures
    atexit.register(gc.freeze)  # nothing is collected again at exit
    return main()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    return run_guarded(lambda: _run(sys.argv[1:] if arguments is None else arguments))


def _run(arguments: Sequence[str]) -> int:
    """Run the verb, and print an error of the user in one line."""
    parser = _parser()
    if not arguments:
        parser.print_help(sys.stderr)
        parser.exit(FAULT)
    options = parser.parse_args(_present_spelling(parser, [*arguments]))
    _log(options.verbose)
    with contextlib.ExitStack() as stack:
        # the light verbs load no library that is slow to load
        if not (options.verb in ("help", "scenes") or (options.verb == "show" and options.scenario is None)):
            with signals_held():
                for package in _ERRORS:
                    importlib.import_module(package)
                from cosim.run.progress import announce_compilation
            if not options.quiet:
                stack.enter_context(announce_compilation(print_status))
        try:
            status: int = options.call(options)
        except _user_errors() as error:
            print_status(str(error))
            return FAULT
        return status


def _present_spelling(parser: argparse.ArgumentParser, words: list[str]) -> list[str]:
    """Replace a renamed verb, and print the new spelling; refuse a removed one by name."""
    index = next((i for i, word in enumerate(words) if not word.startswith("-")), len(words))
    verb, *values = words[index:] or [""]
    if verb in _REMOVED:
        parser.error(f"{verb} no longer exists; {_REMOVED[verb]}")
    if verb == "help" and values and values[0] in _RENAMED:
        index, verb = index + 1, values[0]
        words[index] = _RENAMED[verb].split()[0]
    elif verb in _RENAMED:
        words[index : index + 1] = _RENAMED[verb].split()
    else:
        return words
    print_status(f"{verb} is now: cosim {_RENAMED[verb]}")
    return words


def _user_errors() -> tuple[type[Exception], ...]:
    """Return the types of errors by the user, of the packages that are loaded."""
    return tuple(
        getattr(sys.modules[f"{package}.errors"], name)
        for package, name in _ERRORS.items()
        if f"{package}.errors" in sys.modules
    )


def _log(verbose: bool) -> None:
    lines = logging.StreamHandler()
    lines.setFormatter(_Lines("%(name)s: %(message)s"))
    logging.basicConfig(level=logging.WARNING, handlers=[lines])
    for name in ("fuzzy_arbiter", "plant_fmu", "controller", "cosim"):
        logging.getLogger(name).setLevel(logging.DEBUG if verbose else logging.WARNING)


_ERRORS = {
    "controller": "ControllerError", "cosim": "CosimError", "fuzzy_arbiter": "ArbiterError",
    "plant_fmu": "PlantFmuError",
}  # fmt: skip
# verbs that no longer exist, and what replaces them
_REMOVED = {
    "calibrate": "python -m benchmarks calibration repeats the fit of paper-calibrated",
    "mavlink-check": "cosim mavlink listen shows what a vehicle sends",
}
_RENAMED = {
    "list": "show",
    "replay": "report --replay",
    "package": "export --to ssp --force",
    "ablate": "compare --ablate",
    "excite": "identify --excite",
    "listen": "mavlink listen",
    "stream": "mavlink stream",
    "completion": "help --completion",
}
