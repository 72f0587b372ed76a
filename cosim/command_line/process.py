"""The process of a command: what ends it, who reads it, and its exit status."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
from collections.abc import Callable, Iterator
from threading import current_thread, main_thread
from types import FrameType

FAULT, INTERRUPTED, NO_READER = 2, 130, 141  # the last two as a shell has them of SIGINT and SIGPIPE

_KILLS = ("SIGTERM", "SIGHUP")  # the second where the terminal goes; Windows has none


def run_guarded(run: Callable[[], int]) -> int:
    """Run a command and turn what ends it into one line and an exit status.

    Parameters
    ----------
    run : callable
        The command; it returns its own exit status.

    Returns
    -------
    int
        That status; 2 if output or a file fails, 130 after Ctrl-C, SIGTERM or SIGHUP, 141 if nobody reads the output.
    """
    if sys.stdout is None:  # closed by whoever started this: the next file that is opened would take its place
        tell("standard output is closed; expected it open, such as on /dev/null")
        return FAULT
    try:
        try:
            with kills_interrupt():
                return run()
        finally:
            _flush()
    except KeyboardInterrupt:
        tell("interrupted")
        return INTERRUPTED
    except OSError as error:
        unread = isinstance(error, BrokenPipeError) and _is_unread()
        if not unread:
            from plant_fmu.errors import one_line

            what = error.strerror or error
            tell(one_line(f"{error.filename}: {what}" if error.filename else what))
        _drop_output()
        return NO_READER if unread else FAULT


def tell(what: str) -> None:
    """Say in one line on standard error what the user must know; nothing where that is closed or gone."""
    if sys.stderr is not None:  # else `print` would take standard output
        with contextlib.suppress(OSError):
            print(f"cosim: {what}", file=sys.stderr, flush=True)


@contextlib.contextmanager
def kills_interrupt() -> Iterator[None]:
    """Let SIGTERM and SIGHUP end what is done as Ctrl-C does, so that a killed run is readable.

    The first one does; those that follow are ignored, as a closed terminal sends several. Under ``nohup`` SIGHUP stays
    ignored.
    """
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
    """Let Ctrl-C and kills wait until libraries are loaded: within its own C, NumPy makes an ImportError of them."""
    received: list[int] = []
    with contextlib.ExitStack() as stack:
        for number in _catchable(("SIGINT", *_KILLS)):
            before = signal.signal(number, lambda number, _: received.append(number))
            stack.callback(signal.signal, number, before)
        yield
    if received:
        signal.raise_signal(received[0])


def _catchable(names: tuple[str, ...]) -> list[signal.Signals]:
    """Return those signals that this thread may handle, and that nobody has had ignored."""
    if current_thread() is not main_thread():
        return []
    numbers = [getattr(signal, name) for name in names if hasattr(signal, name)]
    return [number for number in numbers if signal.getsignal(number) not in (signal.SIG_IGN, None)]


def _flush() -> None:
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        raise OSError(error.errno, error.strerror, "standard output") from error


def _is_unread() -> bool:
    """Return whether whoever read the output has gone, rather than who is at the end of another pipe."""
    if not hasattr(select, "poll"):  # on Windows
        return True
    try:
        poll = select.poll()
        poll.register(sys.stdout.fileno(), 0)
    except OSError:  # it is none of the system's
        return False
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in poll.poll(0))


def _drop_output() -> None:
    """Let what is left of the output go nowhere, else the interpreter fails again to write it at its end."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
