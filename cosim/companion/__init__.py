"""The law outside, a real autopilot inside.

A vehicle behind a MAVLink link takes the plant's place: the master steps it as it steps an FMU, with its own regions,
arbiter and law.

Imports: controller, live, mavlink.vehicle, mavlink.wire, plant_fmu, results, run, scenario, simulation,
simulation.commands.
"""
