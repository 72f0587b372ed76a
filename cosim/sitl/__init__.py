"""Software in the loop: a real autopilot flies the plant.

The simulator's side of ArduPilot's JSON backend and PX4's simulator interface.

Imports: companion, controller, mavlink.vehicle, mavlink.wire, plant_fmu, results, run, scenario, simulation.
"""
