"""``cosim falsify``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from cosim.command_line.campaigns import WORKERS, add_replays, resumable
from cosim.command_line.results import say
from cosim.errors import RunError

_EPILOG = """examples:
  cosim falsify hard --law pd --budget 2000 --out falsified/pd
  cosim falsify conflict --law deployable --objective violation --out falsified/conflict
  cosim falsify hard --law deployable --rare-event --out falsified/rate
  cosim falsify docking --vary initial.position.1=-4:-2 plant.current.1=-0.2:0.2 --objective arrival \\
      --out falsified/dock
"""


def add_verb(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    falsify = verbs.add_parser(
        "falsify", help="search for the worst flight, or estimate the probability of a violation",
        epilog=_EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    falsify.add_argument(
        "what", metavar="FAMILY|SCENARIO",
        help="plain, hard, conflict or tour, as cosim scenes makes them; or a shipped name or TOML file, before --vary",
    )  # fmt: skip
    falsify.add_argument("--law", help="law such as pd; instead of a scenario's own")
    falsify.add_argument(
        "--vary", nargs="+", action="extend", default=[], metavar="KEY=LOW:HIGH[:log]",
        help="a key of the scenario and the range to search; or KEY=A,B,C",
    )  # fmt: skip
    falsify.add_argument(
        "--objective", default="clearance", metavar="clearance|violation|arrival",
        help="the least clearance (default), the greatest violation weighted by priority, or the latest arrival",
    )  # fmt: skip
    falsify.add_argument("--budget", type=int, default=2000, metavar="N", help="number of flights (default: 2000)")
    falsify.add_argument(
        "--rare-event", action="store_true",
        help="estimate the probability of a violation with an interval, instead of searching for the worst flight",
    )  # fmt: skip
    falsify.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the search (default: 0)")
    falsify.add_argument(
        "--out", type=Path, required=True, metavar="DIR",
        help="a new folder, or one that this command began: it goes on with what is left",
    )  # fmt: skip
    falsify.add_argument("--workers", type=WORKERS, default=1, metavar="N", help="processes (default: 1)")
    add_replays(falsify)
    falsify.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="settings",
        help="set a gain of the law, or a key of the scenario; may be repeated",
    )  # fmt: skip


def falsify(options: argparse.Namespace) -> int:
    """Run ``cosim falsify``."""
    from cosim.campaigns.falsification.falsification import run_falsification
    from cosim.campaigns.pages.falsification_page import falsification_lines, write_falsification_page

    work = _search(options)

    def run() -> None:
        done = run_falsification(work, options.out, options.workers, progress=not options.quiet)
        if not done.flown:
            say(options, f"{options.out}: was complete already")
        say(options, *falsification_lines(done.summary))
        print(write_falsification_page(options.out, options.replays))

    return resumable(run, options.out)


def _search(options: argparse.Namespace) -> Any:
    from cosim.campaigns.falsification.spaces import FAMILIES
    from cosim.campaigns.falsification.work import ScenarioSearch, SceneSearch, SearchSettings
    from cosim.campaigns.scenes.conditions import Conditions
    from cosim.campaigns.scenes.law_gains import gains_from
    from cosim.campaigns.scenes.work import SceneTask
    from cosim.campaigns.sweeps.design import vary_from
    from cosim.scenario.scenario import load_scenario
    from cosim.scenario.toml_file import split_change

    what, settings = options.what, SearchSettings(options.objective, options.budget, options.seed, options.rare_event)
    if what in FAMILIES:
        if options.vary:
            raise RunError(f"--vary: expected none with the family {what}: its generator says what varies")
        if not options.law:
            raise RunError(f"--law is missing: who flies the scenes of the family {what}")
        return SceneSearch(
            what, SceneTask(options.law, gains_from(options.law, options.settings), Conditions()), settings
        )
    if what.endswith(".jsonl"):
        raise RunError(f"{what}: is a file of scenes, expected a family ({', '.join(FAMILIES)}) or a scenario")
    vary = vary_from(options.vary)
    both = {key.key for key in vary} & {split_change(text)[0] for text in options.settings}
    if both:
        raise RunError(f"{min(both)} is set and varies, expected either")
    law = [f"law.name={options.law}"] if options.law else []
    return ScenarioSearch(load_scenario(what, [*law, *options.settings]), vary, settings)
