"""Commands to a running vehicle.

What can be asked of a vehicle from outside, applied between two steps, logged, and replayed from the log.

Imports: controller, plant_fmu, scenario.
"""

from cosim.simulation.commands.command_handler import MODES, Helm, Mode
from cosim.simulation.commands.commands import Order
from cosim.simulation.commands.settings import LiveSettings, Setting
from cosim.simulation.commands.sources import LoggedOrders, OrderQueue, OrderSource, RecordedOrders

__all__ = [
    "MODES",
    "Helm",
    "LiveSettings",
    "LoggedOrders",
    "Mode",
    "Order",
    "OrderQueue",
    "OrderSource",
    "RecordedOrders",
    "Setting",
]
