"""Co-simulation of an underwater vehicle that reaches a region while it respects others.

These names are what a script or a notebook needs; each is imported when it is first asked for.

Examples
--------
>>> import cosim
>>> scenario = cosim.load_scenario("paper").replace({"limit.force": 500.0})
>>> run = cosim.run_scenario(scenario)  # doctest: +SKIP
>>> run.frame()  # doctest: +SKIP
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cosim.campaigns import Design, compare, run_campaign, run_sweep, vary_from
    from cosim.errors import CosimError
    from cosim.export import export_run
    from cosim.precheck.precheck import check_scenario
    from cosim.results.record import Record
    from cosim.results.run_result import Run, load_run
    from cosim.run.run import run_scenario
    from cosim.scenario.scenario import Scenario, load_scenario
    from cosim.scenario.toml_file import list_scenarios
    from cosim.simulation.master import Master

__all__ = [
    "CosimError",
    "Design",
    "Master",
    "Record",
    "Run",
    "Scenario",
    "check_scenario",
    "compare",
    "export_run",
    "list_scenarios",
    "load_run",
    "load_scenario",
    "run_campaign",
    "run_scenario",
    "run_sweep",
    "vary_from",
]

_HOMES = {
    "campaigns": {"Design", "compare", "run_campaign", "run_sweep", "vary_from"},
    "errors": {"CosimError"},
    "export": {"export_run"},
    "precheck.precheck": {"check_scenario"},
    "results.record": {"Record"},
    "results.run_result": {"Run", "load_run"},
    "run.run": {"run_scenario"},
    "scenario.scenario": {"Scenario", "load_scenario"},
    "scenario.toml_file": {"list_scenarios"},
    "simulation.master": {"Master"},
}


def __getattr__(name: str) -> object:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
