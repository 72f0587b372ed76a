"""The interactive page of a run.

What a page, a terminal or a live view must know of a run: its header, its path, its events; and the page itself.
Public: `replay`, `write_replay`.

Imports: controller, fuzzy_arbiter, io, plant_fmu, results, scenario, simulation, simulation.commands.
"""
