"""Progress on standard error: a bar, and a line when code is compiled at its first use."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections.abc import Callable, Iterator
from typing import Any

from tqdm import tqdm

COMPILING_NOTICE = "compiling the law and what it needs (first use)"


class ProgressBar(tqdm):  # type: ignore[misc]
    """Progress bar, shown if standard error is a terminal; `close` may be called twice, and leaves it as it is."""

    def __init__(self, shown: bool, bar_format: str, **options: Any) -> None:
        super().__init__(bar_format=bar_format, disable=None if shown and sys.stderr else True, **options)

    def update_to(self, n: float) -> None:
        """Advance the bar to `n`, at most to its total."""
        self.update(min(n, self.total) - self.n)


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
