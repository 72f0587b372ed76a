"""One step of the co-simulation, written once: plain functions that run as C, or as Python for debugging.

`one_step` is the order of the stages, over a `StepModel`, constants, and a `StepData`, state and signals. `sensing`
fails thrusters and measures, `region_positions` moves and evaluates regions, `decision` computes weights and forces,
`plant_calls` steps the FMU, and `score` computes the metrics of a flight.

Imports: controller, fuzzy_arbiter, plant_fmu, scenario.
"""
