"""The T200's published forces by pulse and by revolutions: rows of the maker's table, also those that are not kept."""

import numpy as np
import pytest

from plant_fmu.t200 import RPM, force_of_pulse
from tests.plant_fmu.transcription import t200_force

# us, V, rev/min without a sign, kgf; of Blue Robotics' table of September 2019, none of the points kept here
ROWS = [
    (1124, 10, 2590, -2.16), (1388, 10, 986, -0.29), (1580, 10, 695, 0.18), (1828, 10, 2333, 2.21),
    (1224, 12, 2318, -1.66), (1680, 12, 1653, 1.08), (1124, 14, 3143, -3.29), (1580, 14, 917, 0.33),
    (1224, 16, 2712, -2.38), (1388, 16, 1362, -0.58), (1680, 16, 1961, 1.54), (1828, 16, 3108, 3.96),
    (1124, 18, 3528, -4.35), (1580, 18, 1052, 0.43), (1224, 20, 2856, -2.67), (1828, 20, 3380, 4.82),
]  # fmt: skip
KGF = 9.80665  # N


def force_of_rpm(rpm, voltages):
    return np.array([t200_force(*point, RPM) for point in zip(rpm, voltages, strict=True)])


@pytest.mark.parametrize(
    ("pulse", "voltage", "rpm", "kilograms"),  # of the same table, kept ones
    [
        (1900, 10, 2668, 2.93), (1100, 12, -2976, -2.90), (1900, 12, 2995, 3.71), (1900, 14, 3279, 4.52),
        (1100, 16, -3465, -4.07), (1900, 16, 3533, 5.25), (1900, 18, 3742, 6.02), (1900, 20, 3931, 6.72),
        (1500, 16, 0, 0.0), (1700, 16, 2129, 1.82), (1300, 16, -2140, -1.44), (1148, 20, -3498, -4.16),
        (1648, 18, 1716, 1.18),
    ],
)  # fmt: skip
def test_force_matches_manufacturer_data(pulse, voltage, rpm, kilograms):
    at = np.array([float(voltage)])
    assert force_of_pulse(np.array([float(pulse)]), at)[0] == pytest.approx(kilograms * KGF, abs=1e-9)
    assert force_of_rpm(np.array([float(rpm)]), at)[0] == pytest.approx(kilograms * KGF, abs=1e-9)


def test_rows_between_the_kept_ones_differ_by_what_the_docs_say():
    pulses, voltages, rpm, kilograms = np.array(ROWS, float).T
    forces = kilograms * KGF
    np.testing.assert_allclose(force_of_pulse(pulses, voltages), forces, rtol=0.0, atol=1.1)
    np.testing.assert_allclose(force_of_rpm(np.sign(forces) * rpm, voltages), forces, rtol=0.0, atol=1.6)


def test_force_grows_with_voltage_and_is_zero_at_neutral():
    pulses = np.arange(1100.0, 1901.0, 5.0)
    low, high = (force_of_pulse(pulses, np.full_like(pulses, volts)) for volts in (12.0, 15.3))
    assert (np.diff(high) >= 0.0).all()
    assert (np.abs(high) >= np.abs(low)).all()
    assert not force_of_pulse(np.array([1470.0, 1530.0]), np.array([13.0, 13.0])).any()
    assert np.isnan(force_of_pulse(np.array([np.nan, 1600.0]), np.array([15.0, np.nan]))).all()


def test_force_grows_with_revolutions_up_to_those_of_the_voltage():
    rpm = np.arange(-4500.0, 4501.0, 50.0)
    at = np.full_like(rpm, 13.0)
    forces = force_of_rpm(rpm, at)
    assert (np.diff(forces) >= 0.0).all()
    assert forces[90] == 0.0 and forces[89] < 0.0 < forces[91]
    assert (forces[[0, -1]] == force_of_pulse(np.array([1100.0, 1900.0]), at[:2])).all()
