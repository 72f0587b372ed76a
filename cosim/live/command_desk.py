"""What viewers order: read, checked, and given to the run, or refused with the reason."""

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
    """Takes the commands of all viewers of one run.

    Parameters
    ----------
    scenario : Scenario
        What is run.
    queue : CommandQueue or str
        Where commands go, or why there are none.
    has_come : callable
        Tells of the name of an obstacle that may come whether it is there.

    Attributes
    ----------
    settings : LiveSettings
        The numbers as they are once all commands are followed.
    """

    def __init__(self, scenario: Scenario, queue: CommandQueue | str, has_come: Callable[[str], bool]) -> None:
        self.settings = LiveSettings(scenario)
        self._queue, self._has_come = queue, has_come
        self._run = queue.run if isinstance(queue, CommandQueue) else 0
        self._movable = [name for name in scenario.moving if name != "goal"]
        self._comes = {secondary.region.name for secondary in scenario.regions if secondary.is_dynamic}

    def take(self, message: str | bytes) -> str | None:
        """Give the run what a viewer sent.

        Parameters
        ----------
        message : str or bytes
            A command, as the log of commands has it.

        Returns
        -------
        str or None
            Why it is refused; None where the next step follows it.
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
        """Note a command that the run follows, whoever gave it.

        Raises
        ------
        CommandError
            If it changes what cannot be changed.
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
                raise CommandError(f"region is {command.region!r}: no such obstacle has come")
            case SetMission():
                for item in command.items:
                    for inner in item.commands:
                        self._check(inner)
