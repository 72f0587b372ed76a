"""Many runs without a record.

A whole run in C: the fused loop steps the same FMU through its C functions. Each run gives one row.
`shipped_functions` compiles the C functions ahead of time. Public: `FusedFlyer`, `Variation`.

Imports: controller, fuzzy_arbiter, plant_fmu, results, scenario, simulation.
"""
