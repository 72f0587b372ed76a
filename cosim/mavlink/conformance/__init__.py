"""Whether a MAVLink vehicle is what ground stations need: named checks from the client's side."""

from cosim.mavlink.conformance.checking import CHECKS, Result, check_vehicle
from cosim.mavlink.conformance.client import Client
from cosim.mavlink.conformance.connect import Connection, qgc_connect
from cosim.mavlink.conformance.text import as_json, as_text, summary

__all__ = ["CHECKS", "Client", "Connection", "Result", "as_json", "as_text", "check_vehicle", "qgc_connect", "summary"]
