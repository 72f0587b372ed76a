"""Many runs without a record.

A whole run as C: the fused loop steps the same FMU through its C functions, and lanes step several vehicles side by
side. Each run ends as one row. `shipped_functions` compiles ahead what is run as C. Public: `FusedFlyer`,
`LanesFlyer`, `Variation`.

Imports: controller, fuzzy_arbiter, plant_fmu, results, scenario, simulation.
"""
