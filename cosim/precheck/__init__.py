"""Checks of a scenario before it is run.

Stability conditions, feasibility of the regions, and thrust margins, as findings; and the calibration of limit and lag
to the paper's window. Public: `check`, `calibrate`.

Imports: controller, fuzzy_arbiter, plant_fmu, results, scenario, simulation.
"""
