"""Progress on standard error: bars, and in their place a clock while laws are compiled.

What is compiled is known from Numba's own events, in this process and in those that pass theirs on.
"""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import Any

from numba.core import event
from tqdm import tqdm

WORDS = "compiling the law and what it needs (first use)"

_KIND = "numba:compile"
_PERIOD = 0.5  # s between two looks; what compiles faster is not worth a word


class CompileCounter(event.Listener):
    """Counts the functions that Numba is compiling in this process, each within another one.

    Parameters
    ----------
    changed : callable, optional
        Called with the number each time, in the thread that compiles.
    """

    def __init__(self, changed: Callable[[int], object] = lambda depth: None) -> None:
        self.depth = 0
        self._changed, self._lock = changed, threading.Lock()
        event.register(_KIND, self)  # type: ignore[no-untyped-call]

    def on_start(self, event: Any) -> None:
        """Count one more."""
        self._count(1)

    def on_end(self, event: Any) -> None:
        """Count one less."""
        self._count(-1)

    def _count(self, by: int) -> None:
        with self._lock:
            self.depth += by
            self._changed(self.depth)

    def close(self) -> None:
        """Count no more."""
        event.unregister(_KIND, self)  # type: ignore[no-untyped-call]


class ProgressBar:
    """A bar, if there is a terminal; within `compiling_told`, a clock stands in its place while something is compiled.

    Parameters
    ----------
    shown : bool
        Whether there is to be one at all.
    bar_format : str
        As for tqdm.
    compiling : callable, optional
        Whether processes other than this one are compiling for it.
    **options
        As for tqdm.
    """

    def __init__(
        self, shown: bool, bar_format: str, compiling: Callable[[], bool] = lambda: False, **options: Any
    ) -> None:
        self.compiling, self._format = compiling, bar_format
        self._bar = tqdm(bar_format=bar_format, disable=None if shown and sys.stderr else True, **options)
        self._notice = _notice.get() if shown else None
        if self._notice:
            self._notice.add(self)

    def update(self, n: float) -> None:
        """Move it on by so much."""
        self._bar.update(n)

    def update_to(self, n: float) -> None:
        """Move it on to a place, to its end at the most."""
        self._bar.update(min(n, self._bar.total) - self._bar.n)

    def show_words(self, words: str, seconds: float) -> None:
        """Show words in its place, and leave out of its own clock that it stood still so long since the last look."""
        if self._bar.disable:
            return
        self._bar.bar_format = f"{{desc}}: {words}"
        self._bar.start_t += seconds
        self._bar.last_print_t += seconds
        self._bar.refresh()

    def show_bar(self) -> None:
        """Show itself again, if there were words."""
        if not self._bar.disable and self._bar.bar_format != self._format:
            self._bar.bar_format = self._format
            self._bar.refresh()

    def close(self) -> None:
        """Leave it as it is. May be called twice."""
        if self._notice:
            self._notice.remove(self)
            self._notice = None
        self._bar.close()

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Notice:
    """Says while something is compiled: by a clock on a terminal, in the place of a bar if there is one; else once."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell, self._told = tell, False
        self._bars: list[ProgressBar] = []
        self._line: Any = None  # of its own, where there is no bar
        self._seconds = 0.0
        self._counter = CompileCounter()
        self._lock, self._over = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._watch, name="compile-notice", daemon=True)
        self._thread.start()

    def add(self, bar: ProgressBar) -> None:
        """Say it on the line of a bar from now on."""
        with self._lock:
            self._bars.append(bar)
            self._clear_line()

    def remove(self, bar: ProgressBar) -> None:
        """Leave a bar alone from now on."""
        with self._lock:
            self._bars.remove(bar)
            bar.show_bar()

    def close(self) -> None:
        """Say nothing more."""
        self._counter.close()
        self._over.set()
        self._thread.join()
        self._clear_line()

    def _watch(self) -> None:
        before = time.monotonic()
        while not self._over.wait(_PERIOD):
            with self._lock:
                now = time.monotonic()
                self._look(now - before)
                before = now

    def _look(self, since: float) -> None:
        if not (self._counter.depth or any(bar.compiling() for bar in self._bars)):
            self._clear_line()
            for bar in self._bars:
                bar.show_bar()
            return
        self._seconds += since
        words = f"{WORDS} [{tqdm.format_interval(self._seconds)}]"
        if not (sys.stderr and sys.stderr.isatty()):
            if not self._told:
                self._told = True
                self._tell(WORDS)
        elif self._bars:
            self._bars[-1].show_words(words, since)
        else:
            if self._line is None:
                self._line = tqdm(bar_format="{desc}", leave=False)
            self._line.set_description_str(words)

    def _clear_line(self) -> None:
        if self._line is not None:
            self._line.close()
            self._line = None


_notice: ContextVar[_Notice | None] = ContextVar("notice", default=None)


@contextlib.contextmanager
def compiling_told(tell: Callable[[str], None]) -> Iterator[None]:
    """Say on standard error while something is compiled, within a block.

    Parameters
    ----------
    tell : callable
        Says a line, once, where there is no terminal for a clock.
    """
    notice = _Notice(tell)
    token = _notice.set(notice)
    try:
        yield
    finally:
        _notice.reset(token)
        notice.close()
