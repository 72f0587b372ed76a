"""Draw the figures of a report in processes that import Matplotlib while a run is stepped."""

from __future__ import annotations

import contextlib
import logging
import os
import signal
import sys
import threading
import warnings
from collections.abc import Iterator
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from cosim.report.web_page import InlineFigure
    from cosim.results.run_result import Run

log = logging.getLogger(__name__)

# of a process that draws: after Ctrl-C the run ends, and then asks for its figures
_ACTIONS = {signal.SIGINT: signal.SIG_IGN, signal.SIGTERM: signal.SIG_DFL}
_TIMEOUT = 60.0  # s, until the run draws its figures itself


class FigureProcess:
    """A process that waits to draw the figures of one run, and ends with the block it is entered for."""

    def __init__(self, connection: Connection[Any, Any]) -> None:
        self._connection: Connection[Any, Any] | None = connection

    def draw(self, run: Run, folder: Path) -> dict[str, InlineFigure] | None:
        """Have the figures of a run drawn into a folder; return None if that fails, or was done before."""
        connection, self._connection = self._connection, None
        try:
            if connection is None:
                return None
            connection.send((run, folder))
            return (
                {name: figure for _, name, figure in sorted(connection.recv())} if connection.poll(_TIMEOUT) else None
            )
        except Exception:  # a run that cannot be sent, or a process that was ended
            log.debug("figures are drawn by the run itself", exc_info=True)
            return None


@contextlib.contextmanager
def figure_process() -> Iterator[FigureProcess | None]:
    """Fork a process that draws the figures of a run, if that is safe and faster."""
    # libraries of other systems may not work in a process that is forked, and none do if there are threads
    can_fork = sys.platform == "linux" and threading.active_count() == 1
    if not can_fork or "matplotlib" in sys.modules or len(os.sched_getaffinity(0)) == 1:
        yield None
        return
    connection, of_child = Pipe()
    signals = signal.pthread_sigmask(signal.SIG_BLOCK, _ACTIONS)  # so that the command's handlers do not run in a child
    try:
        child = _fork()
    except OSError:  # too many processes: the run draws itself
        child = None
    if child == 0:
        for number, action in _ACTIONS.items():
            signal.signal(number, action)
        connection.close()
        os.setpgid(0, 0)
    signal.pthread_sigmask(signal.SIG_SETMASK, signals)
    if child == 0:
        _serve(of_child)
    of_child.close()
    try:
        yield FigureProcess(connection) if child else None
    finally:
        connection.close()
        if child:
            _stop(child)


def _stop(child: int) -> None:
    """End a child, and the process that it may have started."""
    for end in (os.kill, os.killpg):  # it may have no group of its own yet
        with contextlib.suppress(ProcessLookupError, PermissionError):
            end(child, signal.SIGKILL)
    with contextlib.suppress(ChildProcessError):  # where the parent ignores SIGCHLD
        os.waitpid(child, 0)


def _fork() -> int:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # threads of linear algebra, which stands a fork
        return os.fork()


def _serve(connection: Connection[Any, Any]) -> NoReturn:
    """Wait for a run and a folder, draw its figures there in two processes, and send each with its name."""
    second = 0
    try:
        from cosim.report.figures.figures import drawings
        from cosim.report.figures.sampled_rows import make_figure_data
        from cosim.report.web_page import inline_figure

        run, folder = connection.recv()
        half, of_child = Pipe()
        second = _fork()
        first = 0 if second else 1
        drawn = []
        for i, drawing in enumerate(drawings(make_figure_data(run), first, 2)):
            drawn.append((first + 2 * i, drawing.name, inline_figure(drawing, folder)))
        if first:
            of_child.send(drawn)
        else:
            of_child.close()
            connection.send(drawn + half.recv())
    finally:
        if second:  # it has sent what it drew, or is no longer needed
            os.kill(second, signal.SIGKILL)
            os.waitpid(second, 0)
        os._exit(0)  # whatever it raises: the run then draws itself
