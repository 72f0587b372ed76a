"""The settings of a run that follow from the free numbers: plant, actuation, and errors of its sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cosim.identification.actuation import Actuation, CommandedForces
from cosim.identification.measurements import Errors
from cosim.identification.parameters import Parameter

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Setting:
    """Settings of one run by the free numbers."""

    plant: dict[str, float]
    actuation: Actuation
    force: Array  # (3,) N
    errors: Errors
    delays: dict[str, float]  # s, by topic


def setting_of(
    parameters: Sequence[Parameter], values: Array, run: int, forces: CommandedForces, lag: float
) -> Setting:
    """Return the setting of a run.

    Parameters
    ----------
    parameters : sequence of Parameter
        What is free.
    values : ndarray
        In their order.
    run : int
        To which some nuisances belong.
    forces : CommandedForces
        Of the run.
    lag : float
        Time constant of the thrusters where it is not free [s].
    """
    plant: dict[str, float] = {}
    scales, losses, delays = np.ones(forces.thrusters), np.zeros(forces.thrusters), dict[str, float]()
    force, lever, bias, scale = np.zeros(3), np.zeros(3), np.zeros(3), 0.0
    for p, x in zip(parameters, values, strict=True):
        if p.run not in (None, run):
            continue
        match p.kind:
            case "plant" | "current":
                plant[p.plant] = float(x)
            case "lag":
                lag = float(x)
            case "thrust":
                scales[p.index] = x
            case "asymmetry":
                losses[p.index] = x
            case "delay":
                delays[p.plant] = float(x)
            case "force":
                force[p.index] = x
            case "lever":
                lever[p.index] = x
            case "bias":
                bias[p.index] = x
            case "scale":
                scale = float(x)
    actuation = forces.actuation(lag, scales, losses)
    return Setting(plant, actuation, force, Errors(lever, scale, bias), delays)
