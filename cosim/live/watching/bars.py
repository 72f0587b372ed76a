"""Bars of text characters."""

from __future__ import annotations

import math

from rich.text import Text


class Bars:
    """Draws bars in block characters or in ASCII."""

    def __init__(self, ascii_only: bool) -> None:
        self._full, self._empty, self._zero, self._more = ("#", ".", "|", ">") if ascii_only else ("█", "░", "│", "▶")
        self._less = "<" if ascii_only else "◀"

    def part(self, part: float, width: int, style: str) -> Text:
        """Return a bar for a value from 0 to 1; NaN gives an empty one."""
        width = max(1, width)
        filled = 0 if math.isnan(part) else round(min(1.0, max(0.0, part)) * width)
        return Text().append(self._full * filled, style=style).append(self._empty * (width - filled), style="dim")

    def signed(self, part: float, width: int, style: str) -> Text:
        """Return a bar for a value from -1 to 1 with 0 in the middle; values beyond end in an arrow."""
        half = max(1, (width - 1) // 2)
        filled = 0 if math.isnan(part) else math.ceil(min(1.0, abs(part)) * half)
        run = self._full * filled
        left, right = (Text().append(self._empty * half, style="dim") for _ in range(2))
        if part < 0.0:
            run = self._less + run[1:] if part < -1.0 else run
            left = Text().append(self._empty * (half - filled), style="dim").append(run, style=style)
        elif filled:
            run = run[:-1] + self._more if part > 1.0 else run
            right = Text().append(run, style=style).append(self._empty * (half - filled), style="dim")
        return left.append(self._zero, style="").append_text(right)
