"""Co-simulation of an underwater vehicle that reaches a region while it respects others.

These names are for scripts and notebooks; each is imported at its first use.

Examples
--------
>>> import cosim
>>> scenario = cosim.load_scenario("paper").replace({"limit.force": 500.0, "time.duration": 0.2})
>>> run = cosim.run_scenario(scenario, "runs/short", report=False)
>>> run.table().num_rows
201
"""

import importlib
import warnings
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cosim.campaigns.campaign import run_campaign
    from cosim.campaigns.comparison import Comparison, compare
    from cosim.campaigns.parameter_sweep import run_sweep
    from cosim.campaigns.runner import Campaign
    from cosim.campaigns.scenes.flyer import SceneFlyer
    from cosim.campaigns.scenes.generator import generate_scenes
    from cosim.campaigns.scenes.scene_file import read_scenes
    from cosim.campaigns.sweeps.design import Design, vary_from
    from cosim.companion.autopilot_link import NetworkLink
    from cosim.companion.companion_options import CompanionOptions
    from cosim.companion.companion_run import Companion
    from cosim.companion.frame_alignment import SceneOrigin
    from cosim.errors import CosimError, RunError
    from cosim.export import export_run
    from cosim.logs import import_log
    from cosim.mavlink.run_links import Mavlink
    from cosim.mavlink.wire.endpoint import parse_endpoint
    from cosim.mavlink.wire.options import MavlinkOptions
    from cosim.precheck.precheck import Check, check_scenario
    from cosim.results.record import Record
    from cosim.results.run_result import Run, load_run
    from cosim.run.run_scenario import run_scenario
    from cosim.scenario.scenario import Scenario, load_scenario
    from cosim.scenario.toml_file import list_scenarios
    from cosim.simulation.master import Master

__all__ = [
    "Campaign",
    "Check",
    "Companion",
    "CompanionOptions",
    "Comparison",
    "CosimError",
    "Design",
    "Master",
    "Mavlink",
    "MavlinkOptions",
    "NetworkLink",
    "Record",
    "Run",
    "RunError",
    "Scenario",
    "SceneFlyer",
    "SceneOrigin",
    "check_scenario",
    "compare",
    "export_run",
    "generate_scenes",
    "import_log",
    "list_scenarios",
    "load_run",
    "load_scenario",
    "parse_endpoint",
    "read_scenes",
    "run_campaign",
    "run_scenario",
    "run_sweep",
    "vary_from",
]

_EXPORTS = {
    "campaigns.campaign": {"run_campaign"},
    "campaigns.comparison": {"Comparison", "compare"},
    "campaigns.parameter_sweep": {"run_sweep"},
    "campaigns.runner": {"Campaign"},
    "campaigns.scenes.flyer": {"SceneFlyer"},
    "campaigns.scenes.generator": {"generate_scenes"},
    "campaigns.scenes.scene": {"Scene"},
    "campaigns.scenes.scene_file": {"read_scenes"},
    "campaigns.sweeps.design": {"Design", "vary_from"},
    "companion.companion_run": {"Companion"},
    "companion.frame_alignment": {"SceneOrigin"},
    "companion.autopilot_link": {"NetworkLink"},
    "companion.companion_options": {"CompanionOptions"},
    "errors": {"CosimError", "RunError"},
    "export": {"export_run"},
    "logs": {"import_log"},
    "mavlink.run_links": {"Mavlink"},
    "mavlink.wire.endpoint": {"parse_endpoint"},
    "mavlink.wire.options": {"MavlinkOptions"},
    "precheck.precheck": {"Check", "check_scenario"},
    "results.record": {"Record"},
    "results.run_result": {"Run", "load_run"},
    "run.run_scenario": {"run_scenario"},
    "scenario.scenario": {"Scenario", "load_scenario"},
    "scenario.toml_file": {"list_scenarios"},
    "simulation.master": {"Master"},
}


def __getattr__(name: str) -> object:
    if name == "Sweep":
        warnings.warn("cosim.Sweep is now cosim.Campaign", DeprecationWarning, stacklevel=2)
        name = "Campaign"
    if name == "Scene":
        warnings.warn(
            "cosim.Scene is no longer public, but in cosim.campaigns.scenes.scene", DeprecationWarning, stacklevel=2
        )
    for module, names in _EXPORTS.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
