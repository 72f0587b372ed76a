"""``cosim show`` and ``cosim check``."""

from __future__ import annotations

import argparse
import json
from typing import Any

from cosim.command_line.flags import add_changes, add_scenario, add_verb, flag, refuse_flags


def add_verbs(verbs: Any) -> None:
    """Add the verbs to the subparsers of the command."""
    verb = add_verb(
        verbs, "show", show, "print a scenario with every key explained, or the shipped scenarios",
        "scenarios", ("show", "show docking --short", "show paper --set limit.force=500"),
    )  # fmt: skip
    add_scenario(verb, nargs="?")
    add_changes(verb)
    flag(verb, "--short", "leave out keys that have their default: a start for your own scenario")
    flag(verb, "--json", "print the list of shipped scenarios as JSON")

    verb = add_verb(
        verbs, "check", check, "find problems of a scenario without a run; exit code 1 if there are any",
        "scenarios", ("check docking", "check paper --set law.gains.sigma_p=0.1 --json"),
    )  # fmt: skip
    add_scenario(verb)
    add_changes(verb)
    flag(verb, "--json", "print the result as JSON")


def show(options: argparse.Namespace) -> int:
    """Run ``cosim show``."""
    from cosim.scenario.toml_file import shipped_titles

    if options.scenario is None:
        refuse_flags(options, ["set", "short"], "a scenario with it")
        titles = shipped_titles()
        if options.json:
            print(json.dumps([{"name": name, "title": title} for name, title in titles.items()], indent=2))
        else:
            print(*(f"{name:20} {title}" for name, title in titles.items()), sep="\n")
        return 0
    from cosim.scenario.scenario import load_scenario

    refuse_flags(options, ["json"], "no scenario with it")
    scenario = load_scenario(options.scenario, options.set)
    file = scenario.vehicle_file
    vehicle = str(file.resolve()) if file else None  # found from wherever the output goes
    print(scenario.toml(vehicle, commented=True, short=options.short), end="")
    return 0


def check(options: argparse.Namespace) -> int:
    """Run ``cosim check``."""
    from cosim.precheck.output import check_json, check_text
    from cosim.precheck.precheck import check_scenario
    from cosim.scenario.scenario import load_scenario

    result = check_scenario(load_scenario(options.scenario, options.set))
    print(check_json(result).rstrip() if options.json else check_text(result))
    return 0 if result.holds else 1
