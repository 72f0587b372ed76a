"""Samples of the sensors and their seeded noise; test_derivatives has the true values."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.plant_fmu.conftest import STATES
from tests.plant_fmu.philox import KNOWN, normal, philox, uniform

# channel, its sensor, its noise
SENSORS = [
    ("depth", "depth_sensor", "noise"), *((f"velocity.{a}", "dvl", "velocity_noise") for a in "uvw"),
    ("altitude", "dvl", "altitude_noise"), *((f"acceleration.{a}", "imu", "acceleration_noise") for a in "xyz"),
    *((f"angular_velocity.{a}", "imu", "angular_velocity_noise") for a in "pqr"),
    ("heading", "compass", "noise"), *((f"position.{a}", "usbl", "noise") for a in "xyz"),
]  # fmt: skip
TILTED = dict(zip(STATES[3:], (0.6, 0.5, -0.4, 0.48, 0.7, -0.3, 0.4, 0.5, -0.6, 0.3), strict=True))


@pytest.mark.parametrize(("counter", "key", "result"), KNOWN)
def test_random_generator_matches_published_vectors(counter, key, result):
    assert philox(counter, key) == result


def test_of_two_uniform_numbers_the_first_is_above_0_and_may_be_1(make_slave, fmi):
    """A seed whose first number is 1e-6 below 1, where its last bit shows."""
    slave = make_slave(fmi=fmi).start(**{"depth_sensor.rate": 1.0, "depth_sensor.noise": 1.0, "seed": 2705167})
    expected = normal(2705167, 0, 0)
    assert 0.0 < abs(expected) < 2e-3
    assert slave.get("measured.depth", "position.z") == [pytest.approx(expected, rel=1e-12, abs=0.0), 0.0]


def test_specific_force_is_the_second_derivative_of_the_path(make_slave):
    """R f + g is the acceleration of the origin over ground, here from differences of its world velocity."""
    slave = make_slave().start(**TILTED, substep=0.001)
    slave.set_values({"wrench.Y": 40.0, "wrench.N": 6.0})
    forces, attitudes, velocities = [], [], []
    h = 2e-4
    for k in range(3):
        x = slave.get(*STATES)
        R = Rotation.from_quat(np.roll(x[3:7], -1))
        attitudes.append(R)
        velocities.append(R.apply(x[7:10]))
        forces.append(slave.get(*(f"measured.acceleration.{a}" for a in "xyz")))
        slave.fmu.doStep(k * h, h)
    expected = (velocities[2] - velocities[0]) / (2 * h)
    assert attitudes[1].apply(forces[1]) + np.array([0, 0, 9.81]) == pytest.approx(expected, abs=1e-5)


def test_every_channel_uses_its_own_noise_stream(make_slave, fmi):
    """Sample k of channel i is the standard normal number at that place of the seeded stream."""
    rates = {"depth_sensor.rate": 10.0, "dvl.rate": 5.0, "imu.rate": 20.0, "compass.rate": 4.0, "usbl.rate": 2.0}
    noise = {
        "depth_sensor.noise": 0.1, "dvl.velocity_noise": 0.02, "dvl.altitude_noise": 0.3,
        "imu.acceleration_noise": 0.05, "imu.angular_velocity_noise": 0.01, "compass.noise": 0.02, "usbl.noise": 1.0,
    }  # fmt: skip
    slaves = [make_slave(fmi=fmi).start(bottom_depth=50.0, **rates, **more) for more in ({**noise, "seed": 11}, {})]
    for k in range(41):
        noisy, clean = (slave.get(*(f"measured.{channel}" for channel, _, _ in SENSORS)) for slave in slaves)
        expected = [
            noise[f"{sensor}.{key}"] * normal(11, i, int(np.floor(k * 0.05 * rates[f"{sensor}.rate"] + 1e-9)))
            for i, (_, sensor, key) in enumerate(SENSORS)
        ]
        assert np.subtract(noisy, clean) == pytest.approx(expected, abs=1e-12)
        for slave in slaves:
            slave.fmu.doStep(k * 0.05, 0.05)


def test_samples_do_not_depend_on_the_communication_step(make_slave, fmi):
    """A sensor of 7 Hz samples at its own times, within a step or at its end."""
    ends = []
    for n in (1, 10, 100, 997):
        slave = make_slave(fmi=fmi).start(
            **TILTED, **{"depth_sensor.rate": 7.0, "depth_sensor.noise": 0.2, "substep": 0.001}
        )
        for k in range(n):
            slave.fmu.doStep(3.0 * k / n, 3.0 * (k + 1) / n - 3.0 * k / n)
        ends.append(slave.get("measured.depth")[0])
    assert ends == pytest.approx([ends[0]] * 4, abs=1e-9)


def test_sensor_rate_may_change_during_a_run(make_slave, fmi):
    """Samples then start anew, and the stream of numbers goes on."""
    slave = make_slave(fmi=fmi).start(**{"depth_sensor.rate": 1.0, "depth_sensor.noise": 1.0, "weight": 1228.25})
    slave.step(2.5)  # samples 0, 1, 2
    slave.set_values({"depth_sensor.rate": 10.0})
    slave.step(0.05)
    assert slave.get("measured.depth")[0] == pytest.approx(normal(0, 0, 3))
    slave.step(0.05)
    assert slave.get("measured.depth")[0] == pytest.approx(normal(0, 0, 4))


def test_sample_just_after_a_step_end_does_not_lengthen_the_step(make_slave):
    slave = make_slave().start(**{"depth_sensor.rate": 100.0 / (1.0 + 5e-10)})
    slave.step(0.01)
    assert slave.get("time") == [0.01]


def test_sample_just_before_a_step_end_keeps_its_time_at_large_times(make_slave):
    slave = make_slave(fmi=3)
    slave.set_values({"depth_sensor.rate": 1.0 / (0.01 - 1e-6), "velocity.w": 10.0, "position.z": 5.0})
    slave.begin(1000.0)
    slave.fmu.doStep(1000.0, 0.01)
    measured, depth, speed = slave.get("measured.depth", "position.z", "der(position.z)")
    assert depth - measured == pytest.approx(1e-6 * speed, rel=1e-3)


def test_samples_are_delayed_with_their_sampling_time(make_slave, fmi):
    """Of a vehicle that sinks at 1 m/s, from a USBL of 2 Hz with 0.3 s of delay."""
    slave = make_slave(fmi=fmi).start(
        weight=1228.25, **{"velocity.w": 1.0, "usbl.rate": 2.0, "usbl.delay": 0.3, "depth_sensor.rate": 0.0}
    )
    depths = {}
    for k in range(200):
        depths[round(0.01 * k, 2)] = slave.get("position.z")[0]
        told, taken, continuous = slave.get("measured.position.z", "measured.time.usbl", "measured.time.depth_sensor")
        expected = np.floor((0.01 * k - 0.3 + 1e-9) / 0.5) * 0.5
        if expected < 0.0:
            assert taken == -1e12
        else:
            assert taken == pytest.approx(expected, abs=1e-9)
            assert told == pytest.approx(depths[round(expected, 2)], abs=1e-12)
        assert continuous == pytest.approx(0.01 * k, abs=1e-9)
        slave.step(0.01)


def test_sample_loss_and_outliers_use_their_own_streams(make_slave, fmi):
    """Sample k of sensor i has the chances at that place of stream 21 + i: of being lost, of being an outlier.

    An outage may start and end during a run.
    """
    slave = make_slave(fmi=fmi).start(
        weight=1228.25,
        outlier_scale=50.0,
        seed=3,
        **{
            "usbl.rate": 10.0, "usbl.noise": 0.1, "usbl.loss_probability": 0.3, "usbl.outlier_probability": 0.2,
            "r_G.z": 0.0, "compass.rate": 10.0, "compass.noise": 0.001, "compass.outlier_probability": 0.5,
        },
    )  # fmt: skip
    told, lost, outliers = None, 0, 0
    for k in range(60):
        loss = 1.0 if 20 <= k < 30 else 0.3
        if k > 0:
            slave.set_values({"usbl.loss_probability": loss})
            slave.step(0.1)
        is_lost, is_outlier = uniform(3, 21 + 4, k)[0] < loss, uniform(3, 21 + 4, k)[1] < 0.2
        if not is_lost:
            told = 0.1 * (50.0 if is_outlier else 1.0) * normal(3, 12, k), pytest.approx(0.1 * k, abs=1e-9)
        if told is not None:
            assert slave.get("measured.position.x", "measured.time.usbl") == [pytest.approx(told[0], abs=1e-9), told[1]]
        scale = 0.05 if uniform(3, 21 + 3, k)[1] < 0.5 else 0.001
        assert slave.get("measured.heading")[0] == pytest.approx(scale * normal(3, 11, k), abs=1e-9)
        lost, outliers = lost + is_lost, outliers + (is_outlier and not is_lost)
    assert lost > 15 and outliers > 5
