"""The process of a command: signals, output and exit status."""

from __future__ import annotations

import argparse
import contextlib
import os
import select
import signal
import sys
from collections.abc import Callable, Iterator
from threading import current_thread, main_thread
from types import FrameType
from typing import TYPE_CHECKING, Any, TextIO

from plant_fmu.errors import one_line

if TYPE_CHECKING:
    from cosim.results.run_result import Run

FAULT, INTERRUPTED, NO_READER = 2, 130, 141  # exit statuses; the last two as in shells for SIGINT and SIGPIPE

_KILLS = ("SIGTERM", "SIGHUP")  # the second when the terminal closes; Windows does not have it


def run_guarded(run: Callable[[], int]) -> int:
    """Run a command, and convert signals and output errors to one line and an exit status."""
    if sys.stdout is None:  # closed by the parent: the next file that is opened would get its descriptor
        print_status("standard output is closed; expected it open, such as on /dev/null")
        return FAULT
    try:
        with contextlib.redirect_stdout(_NamedOutput(sys.stdout)):
            try:
                with kills_interrupt():
                    return run()
            finally:
                sys.stdout.flush()
    except KeyboardInterrupt:
        print_status("interrupted")
        return INTERRUPTED
    except OSError as error:
        unread = isinstance(error, BrokenPipeError) and _is_unread()
        if not unread:
            what = error.strerror or error
            print_status(one_line(f"{error.filename}: {what}" if error.filename else what))
        _drop_output()
        return NO_READER if unread else FAULT


def say_if_interrupted(run: Callable[[], None], what: str) -> int:
    """Run a verb and return its exit status; after Ctrl-C or a kill print what is left, and how to go on."""
    try:
        run()
    except KeyboardInterrupt:
        print_status(f"interrupted; {what}")
        return INTERRUPTED
    return 0


def say(options: argparse.Namespace, *lines: str) -> None:
    """Print lines unless ``--quiet`` is given."""
    if not options.quiet:
        for line in lines:
            print(line, flush=True)


def print_run(options: argparse.Namespace, run: Run, report: bool = True) -> None:
    """Print the outcome of a run, and the paths of its report and replay."""
    from cosim.results.wording import verdict

    say(options, verdict(run.summary))
    for path in ("report", "replay") if report else ("summary",):
        print(run.files()[path])


def print_status(what: str) -> None:
    """Print a line for the user on standard error; ignore it if that is closed."""
    if sys.stderr is not None:  # for None `print` would use standard output
        with contextlib.suppress(OSError):
            print(f"cosim: {what}", file=sys.stderr, flush=True)


@contextlib.contextmanager
def kills_interrupt() -> Iterator[None]:
    """Raise KeyboardInterrupt at SIGTERM and SIGHUP as at Ctrl-C, so that a killed run stays readable."""
    # Only the first signal raises it, since a closed terminal sends several. Under `nohup` SIGHUP stays ignored.
    with contextlib.ExitStack() as stack:
        numbers = _catchable(_KILLS)

        def interrupt(number: int, frame: FrameType | None) -> None:
            for other in numbers:
                signal.signal(other, signal.SIG_IGN)
            raise KeyboardInterrupt

        for number in numbers:
            stack.callback(signal.signal, number, signal.signal(number, interrupt))
        yield


@contextlib.contextmanager
def signals_held() -> Iterator[None]:
    """Delay Ctrl-C and kills until libraries are loaded, since NumPy's import converts them to an ImportError."""
    received: list[int] = []
    with contextlib.ExitStack() as stack:
        for number in _catchable(("SIGINT", *_KILLS)):
            before = signal.signal(number, lambda number, _: received.append(number))
            stack.callback(signal.signal, number, before)
        yield
    if received:
        signal.raise_signal(received[0])


def _catchable(names: tuple[str, ...]) -> list[signal.Signals]:
    """Return the signals that this thread may handle and that are not ignored."""
    if current_thread() is not main_thread():
        return []
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    return [number for number in numbers if signal.getsignal(number) not in (signal.SIG_IGN, None)]


class _NamedOutput:
    """Standard output, whose errors name it as those of files do."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write a text."""
        with self._named():
            return self._stream.write(text)

    def flush(self) -> None:
        """Write what is buffered."""
        with self._named():
            self._stream.flush()

    @contextlib.contextmanager
    def _named(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            error.filename = "standard output"
            raise


def _is_unread() -> bool:
    """Return True if the reader of standard output has closed it, rather than that of another pipe."""
    if not hasattr(select, "poll"):  # on Windows
        return True
    try:
        poll = select.poll()
        poll.register(sys.stdout.fileno(), 0)
    except OSError:  # it has no descriptor
        return False
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in poll.poll(0))


def _drop_output() -> None:
    """Redirect the remaining output to the null device, so that the interpreter's final flush does not fail."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
