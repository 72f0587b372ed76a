"""The micro-services of MAVLink.

Parameters, missions, commands, manual control, FTP and the rest, one service a file.

Imports: mavlink.messages, mavlink.vehicle, mavlink.wire, plant_fmu, scenario, simulation.commands.
"""
