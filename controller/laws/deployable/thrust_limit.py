"""Forces of thrusters up to their true limits, which the observer estimates."""

# The true limit of a thruster is an estimated fraction of the vehicle's, its ceiling, as of a battery that sags. The
# ceiling is uncertain, and taken as uniformly distributed: below that range a command gives its force, above it the
# ceiling, in between the mean over the range. So a command above what a thruster has shown to give says little about
# its effectiveness, and a ceiling that is no longer known is tried again.

from __future__ import annotations

import numpy as np

from controller.arithmetic import square

_HALF_WIDTH = 1.7320508075688772  # of a uniform distribution, in standard deviations


def _range(limit: float, ceiling: float, spread: float) -> tuple[float, float]:
    """Return the range of the magnitude of a true limit [N]."""
    size, half = abs(limit), _HALF_WIDTH * spread
    return size * max(ceiling - half, 0.0), size * (ceiling + half)


def limited_force(command: float, limit: float, ceiling: float, spread: float) -> tuple[float, float]:
    """Return the mean force [N] of a command [N], and its derivative by the ceiling."""
    # `limit` is the vehicle's in that direction, of either sign [N]; `spread` the standard deviation of the ceiling.
    min_limit, max_limit = _range(limit, ceiling, spread)
    excess, sign = abs(command) - min_limit, 1.0 if command > 0.0 else -1.0
    if excess <= 0.0:
        return command, 0.0
    if excess >= max_limit - min_limit:
        return sign * 0.5 * (min_limit + max_limit), sign * abs(limit)
    return command - sign * square(excess) / (2.0 * (max_limit - min_limit)), sign * abs(limit) * excess / (
        max_limit - min_limit
    )


def command_for(force: float, limit: float, ceiling: float, spread: float) -> float:
    """Return the least command [N] whose `limited_force` is a force [N], or that gives the most."""
    min_limit, max_limit = _range(limit, ceiling, spread)
    excess, sign = abs(force) - min_limit, 1.0 if force > 0.0 else -1.0
    if excess <= 0.0:
        return force
    if 2.0 * excess >= max_limit - min_limit:
        return sign * max_limit
    command: float = sign * (
        max_limit - (max_limit - min_limit) * np.sqrt(1.0 - 2.0 * excess / (max_limit - min_limit))
    )
    return command
