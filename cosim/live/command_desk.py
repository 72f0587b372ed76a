"""Commands from viewers: decoded, checked, and submitted to the run or rejected with a reason."""

from __future__ import annotations

import copy
from collections.abc import Callable

import msgspec

from cosim.errors import CommandError
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.commands import NOT_A_COMMAND, ChangeSetting, Command, SetMission, ShiftRegion
from cosim.simulation.commands.settings import LiveSettings
from cosim.simulation.commands.sources import CommandQueue
from plant_fmu.errors import one_line

LONGEST = 16_384  # bytes of a message

_decoder = msgspec.json.Decoder(Command)


class CommandDesk:
    """Submits the commands of all viewers to one run.

    Parameters
    ----------
    scenario : Scenario
        The scenario of the run.
    queue : CommandQueue or str
        Queue of the run, or the reason why commands are rejected.
    has_come : callable
        Returns True if the obstacle slot of that name holds an obstacle.

    Attributes
    ----------
    settings : LiveSettings
        The settings once all queued commands are applied.
    """

    def __init__(self, scenario: Scenario, queue: CommandQueue | str, has_come: Callable[[str], bool]) -> None:
        self.settings = LiveSettings(scenario)
        self._queue, self._has_come = queue, has_come
        self._run = queue.run if isinstance(queue, CommandQueue) else 0
        self._movable = [name for name in scenario.moving if name != "goal"]
        self._comes = {secondary.region.name for secondary in scenario.regions if secondary.is_dynamic}

    def take(self, message: str | bytes) -> str | None:
        """Submit a viewer's message to the run.

        Parameters
        ----------
        message : str or bytes
            A command as JSON, as in the log of commands.

        Returns
        -------
        str or None
            Reason for rejecting it; None if the next step applies it.
        """
        if isinstance(self._queue, str):
            return self._queue
        if isinstance(message, bytes):
            return "binary messages are no commands, expected a text of JSON"
        try:
            command = _decoder.decode(message)
            self._check(command)
            if not self._queue.submit(command, self._run):
                return "the run is over" if self._queue.run != self._run else "too many commands at once"
        except NOT_A_COMMAND as error:
            return one_line(f"no command: {error}")
        except CommandError as error:
            return str(error)
        self.follow(command)
        return None

    def follow(self, command: Command) -> None:
        """Update the settings by a command that the run applies, from any source.

        Raises
        ------
        CommandError
            If it changes a setting that does not exist, or to a value out of range.
        """
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
            case ShiftRegion() if command.region in self._comes and not self._has_come(command.region):
                raise CommandError(f"region is {command.region!r}: no such obstacle has been added")
            case SetMission():
                for item in command.items:
                    for inner in item.commands:
                        self._check(inner)
