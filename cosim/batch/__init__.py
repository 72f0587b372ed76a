"""Many runs without a record.

A whole run in C, by the step of the master, with its score in place of a record. Each run gives one row.
`shipped_functions` compiles the C functions ahead of time. Public: `FusedFlyer`, `Variation`.

Imports: controller, fuzzy_arbiter, plant_fmu, results, scenario, simulation, step.
"""
