"""Progress on standard error: a bar, and a line where something is compiled first."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Callable, Iterator
from typing import Any

from tqdm import tqdm

WORDS = "compiling the law and what it needs (first use)"


class ProgressBar:
    """A bar, if there is a terminal.

    Parameters
    ----------
    shown : bool
        Whether there is to be one at all.
    bar_format : str
        As for tqdm.
    **options
        As for tqdm.
    """

    def __init__(self, shown: bool, bar_format: str, **options: Any) -> None:
        self._bar = tqdm(bar_format=bar_format, disable=None if shown and sys.stderr else True, **options)

    def update(self, n: float) -> None:
        """Move it on by so much."""
        self._bar.update(n)

    def update_to(self, n: float) -> None:
        """Move it on to a place, to its end at the most."""
        self._bar.update(min(n, self._bar.total) - self._bar.n)

    def close(self) -> None:
        """Leave it as it is. May be called twice."""
        self._bar.close()

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Notice(logging.Handler):
    """Says once that something is compiled."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        super().__init__()
        self._tell, self._announced = tell, False

    def emit(self, record: logging.LogRecord) -> None:
        """Say it, beside a bar if there is one."""
        if not self._announced:
            self._announced = True
            with tqdm.external_write_mode(file=sys.stderr):
                self._tell(WORDS)


@contextlib.contextmanager
def announce_compilation(tell: Callable[[str], None]) -> Iterator[None]:
    """Say once if something is compiled within a block.

    Parameters
    ----------
    tell : callable
        Says a line.
    """
    notice, logger = _Notice(tell), logging.getLogger("controller.compiling.first_use")
    before = logger.level
    logger.setLevel(logging.INFO)
    logger.addHandler(notice)
    try:
        yield
    finally:
        logger.removeHandler(notice)
        logger.setLevel(before)
