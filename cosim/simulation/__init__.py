"""One step of the co-simulation.

The master measures the plant, evaluates the regions, computes weights and forces, allocates thrusters, steps the FMU
and publishes the row. Each of these is a module here; `master.py` calls them in that order. Public: `Master`,
`Observer`, `Signals`.

Imports: controller, fuzzy_arbiter, plant_fmu, scenario.
"""
