"""A real autopilot flies the plant.

The other side of ArduPilot's and PX4's simulators in the loop.

Imports: companion, controller, mavlink.vehicle, mavlink.wire, plant_fmu, results, run, scenario, simulation.
"""
