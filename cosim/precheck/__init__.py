"""Checks of a scenario before it is run.

Stability conditions, feasibility of the regions, and thrust margins, as findings. Public: `check`.

Imports: controller, fuzzy_arbiter, io, plant_fmu, results, scenario, simulation, step.
"""
