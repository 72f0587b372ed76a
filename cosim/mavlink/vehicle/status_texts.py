"""STATUSTEXT messages of the vehicle, limited in rate; repeated rejections are counted."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

from cosim.mavlink.wire.encode import Encoder
from cosim.mavlink.wire.link import Link

_CHUNK = 50  # characters of a STATUSTEXT
_MAX_TEXT = 200  # characters
_MAX_TEXTS = 12  # in each _PERIOD
_PERIOD = 1.0  # s
_MAX_PENDING = 48  # texts for the next period
_REJECTION_PERIOD = 2.0  # s, between two reports of rejections of a kind
_MAX_REASONS = 8  # different reasons of a kind that are stored; further ones are only counted


class StatusTexts:
    """Send texts on every link; clock [s]."""

    def __init__(self, mavlink: Any, make: Encoder, links: Sequence[Link], clock: Callable[[], float]) -> None:
        self._mavlink, self._make, self._links, self._clock = mavlink, make, links, clock
        self._last_sent: dict[str, float] = {}  # time of the last text, by key
        self._sent_at: deque[float] = deque(maxlen=_MAX_TEXTS)
        self._pending: deque[list[Any]] = deque(maxlen=_MAX_PENDING)
        self._rejections: dict[str, dict[str, int]] = {}  # count of each unreported reason, by kind
        self._text_id = 0

    def send_text(self, text: str, severity: str = "INFO", key: str = "", every: float = 0.0) -> None:
        """Send a text on every link, in parts if it is long; at once, or later if the rate is at its limit."""
        # Units of arguments: every [s, wall clock]
        now = self._clock()
        if every and now - self._last_sent.get(key, -every) < every:
            return
        if every:
            self._last_sent[key] = now
        self._pending.append(self.make_text(text, severity))
        self._send_pending()

    def reject(self, reason: str, key: str) -> None:
        """Report a rejection: at once, or up to 2 s later if one of that kind was reported in the last 2 s."""
        if self._clock() - self._last_sent.get(f"reject {key}", -_REJECTION_PERIOD) >= _REJECTION_PERIOD:
            self._last_sent[f"reject {key}"] = self._clock()
            self._send_rejection(reason)
            return
        reasons = self._rejections.setdefault(key, {})
        if reason not in reasons and len(reasons) >= _MAX_REASONS:
            reason = "others, of the same kind"
        reasons[reason] = reasons.get(reason, 0) + 1

    def send_due(self) -> None:
        """Send the rejections and texts that are due."""
        now = self._clock()
        for key in [key for key in self._rejections if now - self._last_sent[f"reject {key}"] >= _REJECTION_PERIOD]:
            self._last_sent[f"reject {key}"] = now
            for reason, times in self._rejections.pop(key).items():
                self._send_rejection(reason if times == 1 else f"{reason} ({times} times)")
        self._send_pending()

    def _send_rejection(self, reason: str) -> None:
        self.send_text(f"Refused: {reason}", "WARNING")

    def _send_pending(self) -> None:
        now = self._clock()
        while self._pending and not (len(self._sent_at) == _MAX_TEXTS and now - self._sent_at[0] < _PERIOD):
            self._sent_at.append(now)
            for message in self._pending.popleft():
                for link in self._links:
                    link.send(message)

    def make_text(self, text: str, severity: str = "INFO") -> list[Any]:
        """Return the STATUSTEXT messages of a text."""
        level = getattr(self._mavlink, f"MAV_SEVERITY_{severity}")
        text = text[:_MAX_TEXT]
        if len(text) <= _CHUNK:
            return [self._make("STATUSTEXT", level, text, 0, 0)]
        self._text_id = self._text_id % 0xFFFF + 1
        parts = [text[i : i + _CHUNK] for i in range(0, len(text), _CHUNK)]
        if len(parts[-1]) == _CHUNK:
            parts.append("")  # the last part is the one that is not full
        return [self._make("STATUSTEXT", level, part, self._text_id, i) for i, part in enumerate(parts)]
