"""A vehicle's FMU flown under inputs that a test chooses."""

import numpy as np

from plant_fmu import Plant
from tests.plant_fmu.conftest import STATES

THRUST = tuple(f"thrust[{i}]" for i in range(1, 9))


def fly(vehicle, start, names, inputs, step, outputs=STATES):
    """Return outputs before each step and at the end, from start values, under rows of inputs or functions to these."""
    with Plant(vehicle) as plant:
        plant.set(start)
        plant.initialize()
        rows = [[plant[name] for name in outputs]]
        for row in inputs:
            plant.set(dict(zip(names, row(np.array(rows[-1])) if callable(row) else row, strict=True)))
            plant.step(step)
            rows.append([plant[name] for name in outputs])
    return np.array(rows)
