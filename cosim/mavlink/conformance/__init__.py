"""Checks of what ground stations require of a vehicle.

Named checks from the client's side, for `cosim mavlink-check`.

Imports: mavlink.channels, mavlink.listening, mavlink.wire, plant_fmu, scenario, simulation, simulation.commands.
"""

from cosim.mavlink.conformance.checking import CHECKS, Result, check_vehicle
from cosim.mavlink.conformance.client import Client
from cosim.mavlink.conformance.connect import Connection, fetch_mission, fetch_parameters, qgc_connect
from cosim.mavlink.conformance.text import as_json, as_text, summary

__all__ = [
    "CHECKS",
    "Client",
    "Connection",
    "Result",
    "as_json",
    "as_text",
    "check_vehicle",
    "fetch_mission",
    "fetch_parameters",
    "qgc_connect",
    "summary",
]
