"""``cosim falsify``."""

from __future__ import annotations

import argparse
import functools
from typing import Any

from cosim.command_line.campaigns import (
    add_campaign_folder,
    add_workers,
    fly,
    load_with_law,
    own_laws,
    refuse_both,
)  # fmt: skip
from cosim.command_line.flags import LIST, add_changes, add_verb, flag, refuse_flags
from cosim.errors import RunError


def add_verbs(verbs: Any) -> None:
    """Add the verb to the subparsers of the command."""
    verb = add_verb(
        verbs, "falsify", falsify, "search for the worst flight, or estimate the probability of a violation",
        "campaigns",
        ("falsify hard --law pd --budget 2000 --out falsified/pd",
         "falsify conflict --law deployable --objective violation --out falsified/conflict",
         "falsify hard --law deployable --rare-event --out falsified/rate",
         "falsify docking --vary initial.position.1=-4:-2 plant.current.1=-0.2:0.2 --objective arrival --out f/dock"),
    )  # fmt: skip
    verb.add_argument(
        "what", metavar="FAMILY|SCENARIO",
        help="plain, hard, conflict or tour, as cosim scenes makes them; or a shipped name or TOML file, before --vary",
    )  # fmt: skip
    flag(verb, "--law NAME|FILE", "law such as pd, an .fmu file, or FILE.py:NAME; instead of a scenario's own")
    flag(verb, "--vary KEY=LOW:HIGH[:log]", "a key of the scenario and the range to search; or KEY=A,B,C", **LIST)
    flag(verb, "--objective clearance|violation|arrival", "clearance, weighted violation, or time", default="clearance")
    flag(verb, "--budget N", "number of flights", int, 2000)
    flag(verb, "--rare-event", "estimate the probability of a violation, instead of searching for the worst flight")
    flag(verb, "--seed S", "seed of the search", int, 0)
    add_campaign_folder(verb)
    add_workers(verb)
    add_changes(verb, "a gain of the law, or a key of the scenario")


def falsify(options: argparse.Namespace) -> int:
    """Run ``cosim falsify``."""
    from cosim.campaigns.falsification.falsification import run_falsification
    from cosim.campaigns.pages.falsification_page import falsification_lines, write_falsification_page

    search = _search(options)

    def work() -> Any:
        return run_falsification(search, options.out, options.workers, progress=not options.quiet)

    page = functools.partial(write_falsification_page, laws=own_laws(search.law))
    return fly(options, work, lambda done: falsification_lines(done.summary), page)


def _search(options: argparse.Namespace) -> Any:
    from cosim.campaigns.falsification.search_work import ScenarioSearch, SceneSearch, SearchSettings
    from cosim.campaigns.falsification.spaces import FAMILIES
    from cosim.campaigns.scenes.conditions import Conditions
    from cosim.campaigns.scenes.law_gains import gains_from, to_law
    from cosim.campaigns.scenes.scene_work import SceneTask
    from cosim.campaigns.sweeps.design import vary_from

    what, settings = options.what, SearchSettings(options.objective, options.budget, options.seed, options.rare_event)
    if what in FAMILIES:
        refuse_flags(options, ["vary"], f"none with the family {what}: its generator says what varies")
        if not options.law:
            raise RunError(f"--law is missing, expected one that flies the scenes of the family {what}")
        law = to_law(options.law)
        return SceneSearch(what, SceneTask(law, gains_from(law, options.set), Conditions()), settings)
    if what.endswith(".jsonl"):
        raise RunError(f"{what}: is a file of scenes, expected a family ({', '.join(FAMILIES)}) or a scenario")
    vary = vary_from(options.vary)
    refuse_both(vary, options.set)
    scenario, own = load_with_law(what, options.law, options.set)
    return ScenarioSearch(scenario, vary, settings, own)
