"""The number of Hypothesis examples: all of them with --slow, a quarter without."""

from hypothesis import settings

FULL = 100  # of a test that names no number
FAST = 25


def examples(full: int) -> int:
    """Return how many of a test's examples are tried, where a full run tries `full`."""
    return max(1, full * settings.default.max_examples // FULL)
