"""What the vehicle can say: one table of messages, their builders, rates and groups."""

from cosim.mavlink.messages.table import MESSAGES, Spec

__all__ = ["MESSAGES", "Spec"]
