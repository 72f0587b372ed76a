"""A replay that flies: plant, arbiter and law as WebAssembly in the page, and what a reader may change.

Imports: batch, controller, fuzzy_arbiter, io, plant_fmu, results, scenario, simulation, ssp.
"""
