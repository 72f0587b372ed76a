"""From commands to forces: limits, curves, lags, rate limits, failures."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.plant_fmu.conftest import WRENCH
from tests.plant_fmu.test_dynamics import MASS, asymmetric


@pytest.mark.parametrize("fmi", [pytest.param(2, marks=pytest.mark.slow), 3], ids=["fmi2", "fmi3"])
def test_thrusters_saturate_and_set_their_flag(make_slave, fmi):
    slave = make_slave(fmi=fmi).start()
    slave.set_values({"thrust[1]": 30.0, "thrust[2]": -30.0, "thrust[3]": 5.0})
    slave.step(0.01)
    assert slave.get("thruster_force[1]", "thruster_force[2]", "thruster_force[3]") == [27.0, -27.0, 5.0]
    assert [slave.flag(f"thrust_saturated[{i}]") for i in (1, 2, 3)] == [True, True, False]
    slave.set_values({"thrust[1]": 27.0})
    slave.step(0.01)
    assert not slave.flag("thrust_saturated[1]")


@pytest.mark.parametrize("time_constant", [1e-6, 0.02, 3.0])
def test_thruster_lag_is_exact_for_any_time_constant(make_slave, time_constant):
    slave = make_slave().start(**{"thrust_time_constant[1]": time_constant})
    slave.set_values({"thrust[1]": 20.0})
    for k in range(1, 20):
        slave.step(0.05)
        expected = 20.0 * -np.expm1(-0.05 * k / time_constant)
        assert slave.get("thruster_force[1]")[0] == pytest.approx(expected, rel=1e-12)


def test_lagged_thrust_motion_matches_the_analytic_integral(make_slave):
    """Double integral of f (1 - exp(-t/T)) / m, which the substeps must meet to fourth order."""
    T, f, m, t = 0.4, 15.0, MASS, 3.0
    slave = make_slave().start(**asymmetric(
        weight=0.0, buoyancy=0.0, wrench_time_constant=T, substep=0.005,
        **{f"added_mass[{i + 1},{j + 1}]": 0.0 for i in range(6) for j in range(i, 6)},
        **{f"r_G.{a}": 0.0 for a in "xyz"},
    ))  # fmt: skip
    slave.set_values({"wrench.X": f})
    slave.step(t)
    assert slave.get("position.x")[0] == pytest.approx(f / m * (t**2 / 2 - T * t - T**2 * np.expm1(-t / T)), rel=1e-10)


@pytest.mark.medium
def test_force_limit_keeps_the_direction_and_leaves_the_moment(make_slave, fmi):
    slave = make_slave(fmi=fmi).start(wrench_force_limit=10.0)
    slave.set_values(dict(zip(WRENCH, (30.0, -40.0, 120.0, 50.0, 60.0, 70.0), strict=True)))
    slave.step(0.01)
    acting = slave.get(*(f"actuation.{a}" for a in "XYZKMN"))
    assert acting == pytest.approx([30 / 13, -40 / 13, 120 / 13, 50.0, 60.0, 70.0], rel=1e-14)
    assert slave.flag("wrench_saturated")


def test_without_a_limit_any_force_passes(make_slave):
    slave = make_slave().start()
    slave.set_values({"wrench.X": 9e8})
    assert slave.get("actuation.X") == [9e8]
    assert not slave.flag("wrench_saturated")


def test_thrusters_and_wrench_add_up(make_slave):
    slave = make_slave().start()
    slave.set_values({"thrust[1]": 10.0, "wrench.X": 2.0, "wrench.N": 1.0})
    assert slave.get("actuation.X", "actuation.Y", "actuation.N") == pytest.approx([2.0 + 50**0.5, 50**0.5, 6.08])


# ---- curve, dead band, rate limit, failure ----


def test_force_follows_the_curve_from_dead_band_to_limit(make_slave, fmi):
    """A tenth of the range is dead; the rest goes from linear to quadratic, to the same limit."""
    slave = make_slave(fmi=fmi).start(**{
        "thrust_dead_band[1]": 0.1, "thrust_max[1]": 50.0, "thrust_min[1]": -40.0,
        "thrust_curve[2]": 1.0, "thrust_max[2]": 50.0, "thrust_curve[3]": 0.5, "thrust_max[3]": 50.0,
    })  # fmt: skip
    for command, forces in (
        (50.0, [50.0, 50.0, 50.0]), (27.5, [25.0, 15.125, 21.3125]), (5.0, [0.0, 0.5, 2.75]), (0.0, [0.0, 0.0, 0.0]),
        (-22.0, [-20.0, -22.0**2 / 27.0, -22.0 * (0.5 + 0.5 * 22.0 / 27.0)]), (-99.0, [-40.0, -27.0, -27.0]),
    ):  # fmt: skip
        slave.set_values({f"thrust[{i}]": command for i in (1, 2, 3)})
        assert slave.get(*(f"thruster_force[{i}]" for i in (1, 2, 3))) == pytest.approx(forces, abs=1e-12)


def test_a_rate_limit_ramps_then_settles(make_slave, fmi):
    """Against SciPy's solution of the same saturated lag."""
    T, limit = 0.3, 20.0
    slave = make_slave(fmi=fmi).start(**{"thrust_time_constant[1]": T, "thrust_rate_limit[1]": limit})
    slave.set_values({"thrust[1]": 25.0})

    def rate(t, f):
        return np.clip((25.0 - f) / T, -limit, limit)

    times = np.arange(1, 61) * 0.05
    expected = solve_ivp(rate, (0, 3), [0.0], t_eval=times, rtol=1e-10, atol=1e-12, max_step=0.01).y[0]
    forces = []
    for _ in times:
        slave.step(0.05)
        forces += slave.get("thruster_force[1]")
    assert forces == pytest.approx(list(expected), abs=1e-6)
    assert forces[9] == pytest.approx(10.0, abs=1e-12)


def test_a_rate_limit_alone_is_a_ramp(make_slave, fmi):
    slave = make_slave(fmi=fmi).start(**{"thrust_rate_limit[4]": 10.0})
    slave.set_values({"thrust[4]": -27.0})
    slave.step(2.0)
    assert slave.get("thruster_force[4]")[0] == pytest.approx(-20.0)
    slave.step(1.0)
    assert slave.get("thruster_force[4]")[0] == pytest.approx(-27.0, abs=1e-12)


def test_thruster_effectiveness_scales_the_force(make_slave, fmi):
    slave = make_slave(fmi=fmi).start()
    slave.set_values({"thrust[1]": 20.0, "thrust[2]": 20.0})
    whole = slave.get("actuation.N")[0]
    slave.set_values({"thrust_effectiveness[1]": 0.0, "thrust_effectiveness[2]": 0.5})
    slave.step(0.01)
    assert slave.get("thruster_force[1]", "thruster_force[2]") == [0.0, 10.0]
    assert whole == pytest.approx(0.0) and slave.get("actuation.N")[0] == pytest.approx(-5.08)


def test_actuator_states_start_at_their_start_values(make_slave, fmi):
    """Thrusters may be running when a simulation begins."""
    slave = make_slave(fmi=fmi).start(**{"thrust_time_constant[1]": 1.0, "actuator.thrust[1]": 10.0})
    assert slave.get("thruster_force[1]") == [10.0]
    slave.step(1.0)
    assert slave.get("thruster_force[1]")[0] == pytest.approx(10.0 / np.e)
