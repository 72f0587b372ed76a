"""The ``cosim`` command."""

# Slow imports are delayed until a verb needs them, so that help is fast and Ctrl-C works from the start.

from __future__ import annotations

import argparse
import contextlib
import importlib
import json
import logging
import re
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from cosim.command_line import (
    campaigns,
    companion,
    completion,
    export,
    falsify,
    identify,
    import_log,
    mavlink,
    report,
    run,
    scenes,
    sitl,
    sweep,
    watch,
)
from cosim.command_line.process import FAULT, print_status, run_guarded, signals_held
from plant_fmu.errors import one_line, printable

_EPILOG = """examples:
  cosim run paper
  cosim run paper --set arbiter.engine=closed --set regions.SR1.gain=5000 --out runs/strong
  cosim run my-scene.toml --mavlink udpout:127.0.0.1:14550 --profile ardusub --commands
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

    run.add_verb(verbs)
    watch.add_verb(verbs)

    report.add_verbs(verbs)

    listing = verbs.add_parser("list", help="list the shipped scenarios")
    listing.add_argument("--json", action="store_true", help="print it as JSON")

    show = verbs.add_parser("show", help="print a scenario with every default filled in and every key explained")
    show.add_argument("scenario", help="a shipped name, or a TOML file")
    show.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides", help="as for run")

    check = verbs.add_parser("check", help="find problems of a scenario before it is run; exit code 1 if there are any")
    check.add_argument("scenario", help="a shipped name, or a TOML file")
    check.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides", help="as for run")
    check.add_argument("--json", action="store_true", help="print it as JSON")

    import_log.add_verb(verbs)
    export.add_verbs(verbs)
    scenes.add_verb(verbs)
    campaigns.add_verbs(verbs)
    sweep.add_verbs(verbs)
    falsify.add_verb(verbs)
    identify.add_verbs(verbs)
    mavlink.add_verbs(verbs)
    sitl.add_verbs(verbs)
    companion.add_verb(verbs)
    completion.add_verb(verbs, parser)

    about = verbs.add_parser("help", help="print this help, or that of a verb")
    about.add_argument("about", nargs="?", choices=tuple(verbs.choices), metavar="VERB", help="such as run")
    about.set_defaults(parser=parser, verbs=verbs.choices)

    for flags, meaning in _EVERYWHERE.items():
        parser.add_argument(*flags, action="store_true", help=meaning)
        for verb in verbs.choices.values():
            verb.add_argument(*flags, action="store_true", default=argparse.SUPPRESS, help=meaning)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    return run_guarded(lambda: _run(sys.argv[1:] if arguments is None else arguments))


def _run(arguments: Sequence[str]) -> int:
    """Run the verb, and print an error of the user in one line."""
    parser = _parser()
    if not arguments:
        parser.print_help(sys.stderr)
        parser.exit(FAULT)
    verb = next((word for word in arguments if not word.startswith("-")), "")
    if verb in _REMOVED:
        parser.error(f"{verb} no longer exists; {_REMOVED[verb]}")
    options = parser.parse_args(arguments)
    _log(options.verbose)
    with contextlib.ExitStack() as stack:
        if options.verb not in _LIGHT:
            with signals_held():
                for package in _ERRORS:
                    importlib.import_module(package)
                from cosim.run.progress import announce_compilation
            if not options.quiet:
                stack.enter_context(announce_compilation(print_status))
        try:
            return _VERBS[options.verb](options)
        except _user_errors() as error:
            print_status(str(error))
            return FAULT


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


def _list(options: argparse.Namespace) -> int:
    from cosim.scenario.toml_file import shipped_titles

    titles = shipped_titles()
    if options.json:
        print(json.dumps([{"name": name, "title": title} for name, title in titles.items()], indent=2))
        return 0
    for name, title in titles.items():
        print(f"{name:20} {title}")
    return 0


def _help(options: argparse.Namespace) -> int:
    (options.verbs[options.about] if options.about else options.parser).print_help()
    return 0


def _show(options: argparse.Namespace) -> int:
    from cosim.scenario.scenario import load_scenario

    scenario = load_scenario(options.scenario, options.overrides)
    file = scenario.vehicle_file
    vehicle = str(file.resolve()) if file else None  # found from wherever the output goes
    print(scenario.toml(vehicle, commented=True), end="")
    return 0


def _check(options: argparse.Namespace) -> int:
    from cosim.precheck.output import check_json, check_text
    from cosim.precheck.precheck import check_scenario
    from cosim.scenario.scenario import load_scenario

    found = check_scenario(load_scenario(options.scenario, options.overrides))
    print(check_json(found) if options.json else check_text(found))
    return 0 if found.holds else 1


_ERRORS = {
    "controller": "ControllerError",
    "cosim": "CosimError",
    "fuzzy_arbiter": "ArbiterError",
    "plant_fmu": "PlantFmuError",
}
# verbs of earlier versions, and what replaces them
_REMOVED = {
    "calibrate": "python -m benchmarks calibration repeats the fit of paper-calibrated",
    "mavlink-check": "cosim listen shows what a vehicle sends",
}
_LIGHT = {"completion", "help", "list", "scenes"}  # verbs without slow imports
_VERBS = {
    "run": run.run,
    "watch": watch.watch,
    "report": report.report,
    "replay": report.replay,
    "list": _list,
    "help": _help,
    "completion": completion.completion,
    "show": _show,
    "check": _check,
    "import": import_log.import_,
    "export": export.export,
    "package": export.package,
    "scenes": scenes.scenes,
    "ablate": campaigns.ablate,
    "campaign": campaigns.campaign,
    "compare": campaigns.compare,
    "sweep": sweep.sweep,
    "rerun": sweep.rerun,
    "falsify": falsify.falsify,
    "excite": identify.excite,
    "identify": identify.identify,
    "listen": mavlink.listen,
    "stream": mavlink.stream,
    "sitl": sitl.sitl,
    "companion": companion.companion,
}
