"""The helm: what is ordered of a running vehicle from outside, applied between two steps, logged, and repeated."""

from cosim.helm.helm import MODES, Helm, Mode
from cosim.helm.orders import Order
from cosim.helm.settings import LiveSettings, Setting
from cosim.helm.sources import LoggedOrders, OrderQueue, OrderSource, RecordedOrders

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
