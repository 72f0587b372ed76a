"""The vehicle's state for MAVLink.

The latest snapshot of the run by named quantities, the profile that it is shown with, the active ground station, and
geodesy.

Imports: controller, mavlink.wire, plant_fmu, scenario, simulation, simulation.commands.
"""
