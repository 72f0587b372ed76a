"""Stick inputs that make a vehicle's numbers identifiable, within limits of space and time.

Imports: identification, io, plant_fmu, report, scenario, simulation, simulation.commands.
"""
