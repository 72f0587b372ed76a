"""The interactive page of a run.

Header, path and events of a run, for a page, a terminal or a live view; and the page itself.
Public: `replay`, `write_replay`.

Imports: controller, fuzzy_arbiter, io, plant_fmu, results, scenario, simulation, simulation.commands.
"""
