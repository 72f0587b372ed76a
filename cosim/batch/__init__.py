"""Many runs without a record.

A whole run in compiled code: the fused loop steps the same FMU through its C functions, and lanes step several vehicles
side by side. Each run ends as one row. Public: `FusedFlyer`, `LanesFlyer`, `Variation`.

Imports: controller, fuzzy_arbiter, io, plant_fmu, results, scenario, simulation.
"""
