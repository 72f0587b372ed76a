"""Scenarios as environments of Gymnasium, for reinforcement learning.

After ``import cosim.learning``, `gymnasium.make` knows them as ``subreach/Region-v0``.

Imports: batch, controller, plant_fmu, results, scenario, simulation, simulation.commands, step.
"""

import gymnasium

_MODULE = "cosim.learning.region_env"

if "subreach/Region-v0" not in gymnasium.registry:
    gymnasium.register("subreach/Region-v0", f"{_MODULE}:RegionEnv", vector_entry_point=f"{_MODULE}:RegionVectorEnv")
