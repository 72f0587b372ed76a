"""Software in the loop: a real autopilot flies the plant.

The simulator side of ArduPilot's and PX4's simulation interfaces.

Imports: companion, controller, mavlink.vehicle, mavlink.wire, plant_fmu, results, run, scenario, simulation,
simulation.commands.
"""
