"""The vehicle that is identified."""

import pytest

from plant_fmu import load_vehicle


@pytest.fixture(scope="session")
def vehicle():
    return load_vehicle("bluerov2_heavy")
