"""Commands to a running vehicle.

The types of commands, and how they are applied between two steps, logged, and replayed from the log.

Imports: controller, plant_fmu, scenario.
"""

from cosim.simulation.commands.command_handler import MODES, CommandHandler, Mode
from cosim.simulation.commands.commands import Command
from cosim.simulation.commands.settings import LiveSettings, Setting
from cosim.simulation.commands.sources import CommandQueue, CommandSource, LoggedCommands, ReplayedCommands

__all__ = [
    "MODES",
    "Command",
    "CommandHandler",
    "CommandQueue",
    "CommandSource",
    "LiveSettings",
    "LoggedCommands",
    "Mode",
    "ReplayedCommands",
    "Setting",
]
