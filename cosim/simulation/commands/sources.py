"""Sources of commands: a queue that another thread fills, or the log of an earlier run."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Annotated, Protocol

import msgspec

from cosim.errors import CommandError, RunError
from cosim.scenario.validation import MAX_STEPS
from cosim.simulation.commands.commands import JSON, NOT_A_COMMAND, Command, Mode, Reset, SetMode, validate_command
from plant_fmu.errors import TableError
from plant_fmu.toml_tables import Table, decode

QUEUED = 256  # maximum number of commands between two steps; further ones are rejected
RUNS = 100  # maximum number of runs of a session: further resets are rejected
LOG_BYTES = 64_000_000  # maximum size of a run's commands in its log: some hours of sticks; further ones are rejected


class CommandSource(Protocol):
    """Returns the commands of each step."""

    def take(self, k: int) -> Sequence[Command]:
        """Return the commands to be applied at the beginning of step `k`."""
        ...

    @property
    def exhausted(self) -> bool:
        """True if the source will return no more commands."""
        ...


class CommandQueue:
    """Commands from another thread, in the order of submission. Bounded: further commands are rejected."""

    exhausted = False

    def __init__(self, modes: Sequence[Mode] = ()) -> None:
        self.run = 0
        self.modes = modes  # modes whose SetMode alone is accepted; empty: every command is
        self._commands: deque[Command] = deque()
        self._bytes = 0  # size of this run's commands
        self._lock = threading.Lock()

    def submit(self, command: Command, run: int | None = None) -> bool:
        """Queue a command for the next step."""
        command = validate_command(command)
        with self._lock:
            if self.refusal(command, run):
                return False
            self._bytes += len(msgspec.json.encode(command))
            self._commands.append(command)
        return True

    def refusal(self, command: Command, run: int | None = None) -> str:
        """Return the reason why a command for a run is rejected; empty if there is none."""
        if run not in (None, self.run):
            return "the run is over"
        if self.modes and not (isinstance(command, SetMode) and command.mode in self.modes):
            return f"expected one of the modes {', '.join(self.modes)}"
        if self.run >= RUNS - 1 and isinstance(command, Reset):
            return f"no further reset: a session has {RUNS} runs at most"
        if self._bytes >= LOG_BYTES:
            return f"no further command: the run's log has {LOG_BYTES // 1_000_000} MB of them"
        return "too many commands at once" if len(self._commands) >= QUEUED else ""

    def end_run(self) -> None:
        """Clear the queue, and reject later commands for the run that is over."""
        with self._lock:
            self.run += 1
            self._bytes = 0
            self._commands.clear()

    def take(self, k: int) -> Sequence[Command]:
        """Return the queued commands, for any step `k`."""
        taken = []
        while self._commands:
            taken.append(self._commands.popleft())
        return taken


class _Entry(Table, frozen=True):
    """A line of the log."""

    step: Annotated[int, msgspec.Meta(ge=0, le=MAX_STEPS)]
    command: Command


def read_log(file: Path) -> list[tuple[int, Command]]:
    """Return the commands of an earlier run, each with the step that took it, in their order."""
    # A last line that is incomplete, after a kill or on a full disk, is skipped: that run did not apply it either.
    try:
        content = file.read_bytes()
    except OSError as error:
        raise RunError(f"{file}: {error.strerror or error}") from error
    if b'"order"' in content[:30]:
        raise RunError(f"{file}: is a log of an older version ('order'), expected one with 'command'")
    lines, whole = content.splitlines(), content.count(b"\n")
    entries = []
    for number, line in enumerate(lines, 1):
        try:
            entry: _Entry = decode(JSON.decode(line), _Entry)
            validate_command(entry.command)
        except (*NOT_A_COMMAND, TableError, CommandError) as error:
            if type(error) in (msgspec.DecodeError, UnicodeDecodeError) and number > whole:
                break
            raise RunError(f"{file}, line {number}: {error}") from error
        entries.append((entry.step, entry.command))
    return sorted(entries, key=lambda entry: entry[0])


class ScheduledCommands:
    """Commands that are known before the run."""

    def __init__(self, entries: Iterable[tuple[int, Command]]) -> None:
        self._entries = deque(entries)

    @property
    def exhausted(self) -> bool:
        """True if no command is left."""
        return not self._entries

    def take(self, k: int) -> Sequence[Command]:
        """Return the commands of step `k`, and those of earlier steps that were not taken."""
        taken = []
        while self._entries and self._entries[0][0] <= k:
            taken.append(self._entries.popleft()[1])
        return taken


class ReplayedCommands(ScheduledCommands):
    """The commands of an earlier run, at the steps at which that run took them."""

    def __init__(self, file: Path) -> None:
        super().__init__(read_log(file))


class LoggedCommands:
    """Wraps a source, and logs each command as it is taken, so that a killed run has its log."""

    def __init__(
        self, source: CommandSource, file: Path, report: Callable[[int, Sequence[Command]], None] | None = None
    ) -> None:
        self._source, self._file, self._report = source, file, report

    @property
    def exhausted(self) -> bool:
        """True if the source will return no more commands."""
        return self._source.exhausted

    def take(self, k: int) -> Sequence[Command]:
        """Return the commands of step `k` after writing them to the log."""
        commands = self._source.take(k)
        if commands:
            self._write(_Entry(k, command) for command in commands)
            if self._report is not None:
                self._report(k, commands)
        return commands

    def _write(self, entries: Iterable[_Entry]) -> None:
        with self._file.open("ab") as file:
            file.write(b"".join(msgspec.json.encode(entry) + b"\n" for entry in entries))
