"""Stick inputs that make a vehicle's numbers identifiable, within limits of space and time.

Imports: io, plant_fmu, report, report.figures, scenario, simulation, simulation.commands.
"""
