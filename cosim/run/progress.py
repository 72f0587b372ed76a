"""Progress on standard error: a bar, and a line when code is compiled at its first use."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Callable, Iterator
from typing import Any

from tqdm import tqdm

COMPILING_NOTICE = "compiling the law and what it needs (first use)"


class ProgressBar:
    """Progress bar, shown if standard error is a terminal."""

    def __init__(self, shown: bool, bar_format: str, **options: Any) -> None:
        self._bar = tqdm(bar_format=bar_format, disable=None if shown and sys.stderr else True, **options)

    def update(self, n: float) -> None:
        """Advance the bar by `n`."""
        self._bar.update(n)

    def update_to(self, n: float) -> None:
        """Advance the bar to `n`, at most to its total."""
        self._bar.update(min(n, self._bar.total) - self._bar.n)

    def close(self) -> None:
        """End the bar, and leave it as it is. May be called twice."""
        self._bar.close()

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Notice(logging.Handler):
    """Shows one notice at the first compilation."""

    def __init__(self, report: Callable[[str], None]) -> None:
        super().__init__()
        self._show, self._announced = report, False

    def emit(self, record: logging.LogRecord) -> None:
        """Show the notice once; a progress bar is redrawn below it."""
        if not self._announced:
            self._announced = True
            with tqdm.external_write_mode(file=sys.stderr):
                self._show(COMPILING_NOTICE)


@contextlib.contextmanager
def announce_compilation(report: Callable[[str], None]) -> Iterator[None]:
    """Show one notice if code is compiled within a block."""
    notice, logger = _Notice(report), logging.getLogger("controller.compiling.first_use")
    before = logger.level
    logger.setLevel(logging.INFO)
    logger.addHandler(notice)
    try:
        yield
    finally:
        logger.removeHandler(notice)
        logger.setLevel(before)
