"""Many runs, resumable and on many cores.

Scenes flown by one law or by several, or one scenario with varied numbers. Public: `run_campaign`, `compare`,
`run_sweep`, `vary_from`.

Imports: batch, controller, io, plant_fmu, report, results, run, scenario, simulation.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cosim.campaigns.campaign import run_campaign
    from cosim.campaigns.comparison import Comparison, compare
    from cosim.campaigns.parameter_sweep import run_sweep
    from cosim.campaigns.runner import Campaign
    from cosim.campaigns.sweeps.design import Design, Vary, vary_from

__all__ = ["Campaign", "Comparison", "Design", "Vary", "compare", "run_campaign", "run_sweep", "vary_from"]

# imported at the first use: reading a scene's text does not need the code that flies it
_EXPORTS = {
    "campaign": {"run_campaign"},
    "comparison": {"Comparison", "compare"},
    "runner": {"Campaign"},
    "parameter_sweep": {"run_sweep"},
    "sweeps.design": {"Design", "Vary", "vary_from"},
}


def __getattr__(name: str) -> object:
    for module, names in _EXPORTS.items():
        if name in names:
            return getattr(importlib.import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
