"""Where commands come from: a queue that another thread fills, or the log of an earlier run."""

from __future__ import annotations

import re
import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Annotated, Protocol

import msgspec

from cosim.errors import CommandError, RunError
from cosim.scenario.validation import MAX_STEPS
from cosim.simulation.commands.commands import NOT_A_COMMAND, Command, validate_command

QUEUED = 256  # commands between two steps; further ones are refused


class CommandSource(Protocol):
    """Gives the commands of each step."""

    def take(self, k: int) -> Sequence[Command]:
        """Return the commands to be applied at the beginning of step `k`."""
        ...

    @property
    def exhausted(self) -> bool:
        """Whether no command will come any more."""
        ...


class CommandQueue:
    """Commands from another thread, in the order in which they were given. Bounded: a flood is refused, not kept.

    Attributes
    ----------
    run : int
        Which run takes them; the next one after a reset.
    """

    exhausted = False

    def __init__(self) -> None:
        self.run = 0
        self._commands: deque[Command] = deque()
        self._lock = threading.Lock()

    def submit(self, command: Command, run: int | None = None) -> bool:
        """Queue a command for the next step.

        Parameters
        ----------
        command : Command
            To be applied.
        run : int, optional
            The run that it is meant for; default: whichever takes it.

        Returns
        -------
        bool
            Whether there was room for it, and that run is not over.

        Raises
        ------
        CommandError
            If its numbers cannot be.
        """
        validate_command(command)
        with self._lock:
            if len(self._commands) >= QUEUED or run not in (None, self.run):
                return False
            self._commands.append(command)
        return True

    def end_run(self) -> None:
        """Forget what is queued, and refuse what still comes for the run that is over."""
        with self._lock:
            self.run += 1
            self._commands.clear()

    def take(self, k: int) -> Sequence[Command]:
        """Return what is queued, whatever the step `k`."""
        taken = []
        while self._commands:
            taken.append(self._commands.popleft())
        return taken


_OLDER = re.compile(rb'\{"step": ?\d+, ?"order"')  # how a log of older versions begins


class _Entry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A line of the log."""

    step: Annotated[int, msgspec.Meta(ge=0, le=MAX_STEPS)]
    command: Command


def read_log(file: Path) -> list[tuple[int, Command]]:
    """Return the commands of an earlier run, each with the step that took it, in their order.

    A last line that was cut off, by a kill or a full disk, does not count: that run did not follow it either.

    Parameters
    ----------
    file : Path
        The log.

    Returns
    -------
    list of (int, Command)
        As they were followed.

    Raises
    ------
    RunError
        If it cannot be read, or a line is no command.
    """
    try:
        content = file.read_bytes()
    except OSError as error:
        raise RunError(f"{file}: {error.strerror or error}") from error
    if _OLDER.match(content):
        raise RunError(f"{file}: has the words of an older version ('order'), expected those of this one ('command')")
    lines, whole = content.splitlines(), content.count(b"\n")
    entries = []
    for number, line in enumerate(lines, 1):
        try:
            entry = msgspec.json.decode(line, type=_Entry)
            validate_command(entry.command)
        except (*NOT_A_COMMAND, CommandError) as error:
            if type(error) in (msgspec.DecodeError, UnicodeDecodeError) and number > whole:
                break
            raise RunError(f"{file}, line {number}: {error}") from error
        entries.append((entry.step, entry.command))
    return sorted(entries, key=lambda entry: entry[0])


class ScheduledCommands:
    """Commands that are known beforehand.

    Parameters
    ----------
    entries : iterable of (int, Command)
        Each with the step that takes it, in the order of the steps.
    """

    def __init__(self, entries: Iterable[tuple[int, Command]]) -> None:
        self._entries = deque(entries)

    @property
    def exhausted(self) -> bool:
        """Whether no command is left."""
        return not self._entries

    def take(self, k: int) -> Sequence[Command]:
        """Return the commands of step `k`, and of earlier ones that were not taken."""
        taken = []
        while self._entries and self._entries[0][0] <= k:
            taken.append(self._entries.popleft()[1])
        return taken


class ReplayedCommands(ScheduledCommands):
    """The commands of an earlier run, at the steps at which that run took them.

    Parameters
    ----------
    file : Path
        The log, as for `read_log`.

    Raises
    ------
    RunError
        If it cannot be read, or a line is no command.
    """

    def __init__(self, file: Path) -> None:
        super().__init__(read_log(file))


class LoggedCommands:
    """Another source, of which each command that is taken is written down at once, so that a killed run has its log.

    Parameters
    ----------
    source : CommandSource
        Where the commands come from.
    file : Path
        The log; made when the first command is taken.
    tell : callable, optional
        Told of each step that takes commands, and of these, once they are written.
    """

    def __init__(
        self, source: CommandSource, file: Path, tell: Callable[[int, Sequence[Command]], None] | None = None
    ) -> None:
        self._source, self._file, self._tell = source, file, tell

    @property
    def exhausted(self) -> bool:
        """Whether no command will come any more."""
        return self._source.exhausted

    def take(self, k: int) -> Sequence[Command]:
        """Return the commands of step `k`, once they are written."""
        commands = self._source.take(k)
        if commands:
            self._write(_Entry(k, command) for command in commands)
            if self._tell is not None:
                self._tell(k, commands)
        return commands

    def _write(self, entries: Iterable[_Entry]) -> None:
        with self._file.open("ab") as file:
            file.write(b"".join(msgspec.json.encode(entry) + b"\n" for entry in entries))
