"""Live view of a run.

A server shows the run in browsers and takes commands from them. Public: `LiveView`.

Imports: controller, io, plant_fmu, replay, scenario, simulation, simulation.commands.
"""
