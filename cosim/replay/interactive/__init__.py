"""Interactive replays: plant, arbiter and law as WebAssembly in the page, and the numbers that a reader may change.

Imports: batch, controller, fuzzy_arbiter, io, plant_fmu, results, scenario, simulation, ssp, step.
"""
