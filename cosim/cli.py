"""The ``cosim`` command.

Nothing heavy is imported before a verb needs it, so that help comes at once and Ctrl-C is heeded from the start.
"""

from __future__ import annotations

import argparse
import contextlib
import logging
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from threading import current_thread, main_thread

from cosim.command_line import ahead, campaigns, export, mavlink, package, replay, report, run, sitl, sweep, watch
from cosim.command_line.campaigns import INTERRUPTED

_EPILOG = """examples:
  cosim run paper
  cosim run paper --set arbiter.engine=closed --set regions.SR1.gain=5000 --out runs/strong
  cosim run my-scene.toml --mavlink udpout:127.0.0.1:14550 --profile ardusub --commands
  cosim campaign scenes.jsonl --law printed --out campaigns/printed --workers 2
  cosim sweep docking --vary initial.position.1=-4:-2 --samples 1000 --out sweeps/start --workers 2
"""


class _Version(argparse.Action):
    """Prints the version; finding it takes longer than all else that help needs."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib import metadata

        print(f"cosim {metadata.version('subreach')}")
        parser.exit()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="cosim",
        description="Region-reaching underwater vehicles, co-simulated.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="show program's version number and exit")
    parser.add_argument("-v", "--verbose", action="store_true", help="log what happens inside")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")

    run.add_verb(verbs)
    watch.add_verb(verbs)

    report.add_verb(verbs)

    replay.add_verb(verbs)

    verbs.add_parser("list", help="list the shipped scenarios")

    show = verbs.add_parser("show", help="print a scenario with every default filled in")
    show.add_argument("scenario", help="a shipped name, or a TOML file")
    show.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides", help="as for run")

    check = verbs.add_parser("check", help="say before a run what stands against a scenario; exit code 1 if anything")
    check.add_argument("scenario", help="a shipped name, or a TOML file")
    check.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides", help="as for run")
    check.add_argument("--json", action="store_true", help="print it as JSON")

    calibrate = verbs.add_parser("calibrate", help="fit the force limit and lag that bring the paper's window about")
    calibrate.add_argument("--scenario", default="paper", help="scenario to fit (default: paper)")

    ahead.add_verb(verbs)
    export.add_verb(verbs)
    package.add_verb(verbs)
    campaigns.add_verbs(verbs)
    sweep.add_verbs(verbs)
    mavlink.add_verbs(verbs)
    sitl.add_verbs(verbs)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Default: those of the process.

    Returns
    -------
    int
        0; 1 where a check fails; 2 where the user must mend something; 130 after Ctrl-C.
    """
    parser = _parser()
    if not (sys.argv[1:] if arguments is None else arguments):
        parser.print_help(sys.stderr)
        parser.exit(2)
    options = parser.parse_args(arguments)
    _log(options.verbose)
    try:
        code = _guarded(options)
        sys.stdout.flush()
    except KeyboardInterrupt:
        print("cosim: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # who read our output has gone: no more of it, at exit neither
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        print(f"cosim: {error.strerror or error}", file=sys.stderr)
        return 2
    return code


def _guarded(options: argparse.Namespace) -> int:
    """Run the verb, and say in one line what the user must mend."""
    with _interrupts_held():
        from controller import ControllerError
        from cosim.errors import CosimError
        from fuzzy_arbiter import ArbiterError
        from plant_fmu import PlantFmuError

    try:
        return _VERBS[options.verb](options)
    except (CosimError, PlantFmuError, ControllerError, ArbiterError) as error:
        print(f"cosim: {error}", file=sys.stderr)
        return 2


@contextlib.contextmanager
def _interrupts_held() -> Iterator[None]:
    """Let Ctrl-C wait until libraries are loaded: within its own C, NumPy makes an ImportError of it."""
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler or current_thread() is not main_thread():
        yield
        return
    came: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if came:
        raise KeyboardInterrupt


def _log(verbose: bool) -> None:
    logging.basicConfig(level=logging.WARNING, format="%(name)s: %(message)s")
    for name in ("fuzzy_arbiter", "plant_fmu", "controller", "cosim"):
        logging.getLogger(name).setLevel(logging.DEBUG if verbose else logging.WARNING)


def _list(options: argparse.Namespace) -> int:
    from cosim.scenario import load_scenario
    from cosim.scenario_file import shipped_scenarios

    for name in shipped_scenarios():
        print(f"{name:20} {load_scenario(name).title}")
    return 0


def _show(options: argparse.Namespace) -> int:
    from cosim.scenario import load_scenario

    print(load_scenario(options.scenario, options.overrides).toml(), end="")
    return 0


def _check(options: argparse.Namespace) -> int:
    from cosim.check import check
    from cosim.check_text import check_json, check_text
    from cosim.scenario import load_scenario

    found = check(load_scenario(options.scenario, options.overrides))
    print(check_json(found) if options.json else check_text(found))
    return 0 if found.holds else 1


def _calibrate(options: argparse.Namespace) -> int:
    from cosim.calibration import calibrate
    from cosim.scenario import load_scenario

    fit = calibrate(load_scenario(options.scenario, ["arbiter.engine=closed"]))
    print(f"limit.force = {fit.force:.1f} N, limit.time_constant = {fit.time_constant:.3f} s")
    print(f"window {fit.window[0]:.3f} s to {fit.window[1]:.3f} s, least-squares cost {fit.cost:.3e} s2")
    return 0


_VERBS = {
    "run": run.run,
    "watch": watch.watch,
    "report": report.report,
    "replay": replay.replay,
    "list": _list,
    "show": _show,
    "check": _check,
    "calibrate": _calibrate,
    "compile": ahead.compile_all,
    "export": export.export,
    "package": package.package,
    "campaign": campaigns.campaign,
    "compare": campaigns.compare,
    "sweep": sweep.sweep,
    "rerun": sweep.rerun,
    "listen": mavlink.listen,
    "stream": mavlink.stream,
    "mavlink-check": mavlink.mavlink_check,
    "sitl": sitl.sitl,
}
