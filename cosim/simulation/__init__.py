"""A run of the co-simulation, step by step.

`Master` binds plant, law, arbiter and commands to the arrays of a step, does blocks of steps, and publishes their rows.
Public: `Master`, `Observer`, `BlockObserver`, `Signals`.

Imports: controller, fuzzy_arbiter, plant_fmu, scenario, step.
"""
