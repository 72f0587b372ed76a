"""The vehicle on MAVLink.

A running or recorded vehicle shows itself to ground stations and takes their commands. The autopilot ties messages and
services to links; one thread does all input and output. Public: `Mavlink`, `MavlinkOptions`, `parse_endpoint`.

Imports: controller, results, scenario, simulation, simulation.commands.
"""
