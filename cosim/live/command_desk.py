"""Commands from viewers: decoded, checked, and submitted to the run or rejected with a reason."""

from __future__ import annotations

import copy
from collections.abc import Callable

from cosim.errors import CommandError
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import JSON, NOT_A_COMMAND, ChangeSetting, Command, SetMission, ShiftRegion
from cosim.simulation.commands.settings import LiveSettings
from cosim.simulation.commands.sources import CommandQueue
from plant_fmu.errors import TableError, one_line
from plant_fmu.toml_tables import decode

MAX_LENGTH = 16_384  # bytes of a message


class CommandDesk:
    """Submits the commands of all viewers to one run."""

    def __init__(self, scenario: Scenario, queue: CommandQueue | str, is_occupied: Callable[[str], bool]) -> None:
        self.settings = LiveSettings(scenario)
        self._queue, self._is_occupied = queue, is_occupied
        self._run = queue.run if isinstance(queue, CommandQueue) else 0
        self._movable = [name for name in scenario.moving if name != "goal"]
        self._slots = {secondary.region.name for secondary in scenario.regions if secondary.is_dynamic}

    def submit(self, message: str | bytes) -> str | None:
        """Submit a viewer's message to the run."""
        if isinstance(self._queue, str):
            return self._queue
        if isinstance(message, bytes):
            return "binary messages are not commands, expected JSON text"
        try:
            command: Command = decode(JSON.decode(message), Command)
            self._check(command)
            if not self._queue.submit(command, self._run):
                return self._queue.refusal(command, self._run) or "too many commands at once"  # which were taken since
        except (*NOT_A_COMMAND, TableError) as error:
            return one_line(f"no command: {error}")
        except CommandError as error:
            return str(error)
        self.update_settings(command)
        return None

    def update_settings(self, command: Command) -> None:
        """Update the settings by a command that the run applies, from any source."""
        if isinstance(command, ChangeSetting):
            self.settings.change(command.key, command.value)

    def _check(self, command: Command) -> None:
        match command:
            case ChangeSetting():
                copy.deepcopy(self.settings).change(command.key, command.value)
            case ShiftRegion() if command.region not in self._movable:
                raise CommandError(
                    f"region is {command.region!r}, expected one of {', '.join(self._movable) or 'none'}"
                )
            case ShiftRegion() if command.region in self._slots and not self._is_occupied(command.region):
                raise CommandError(f"region is {command.region!r}: no such obstacle has been added")
            case SetMission():
                for item in command.items:
                    for inner in item.commands:
                        self._check(inner)
