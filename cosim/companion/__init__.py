"""Companion computer: the law steers a real vehicle through the inner loops of its autopilot.

A vehicle behind a MAVLink link takes the plant's place. The master steps it as it steps an FMU, with the scenario's
regions, arbiter and law.

Imports: controller, live, mavlink.vehicle, mavlink.wire, plant_fmu, results, run, scenario, simulation,
simulation.commands.
"""
