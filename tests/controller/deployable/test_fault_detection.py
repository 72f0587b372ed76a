"""Failed thrusters: found, the right one, never a working one, and a wrong suspicion taken back."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import norm

from controller.laws.deployable import fault_detection
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import make_dynamics, make_thrusters, reallocate
from controller.laws.deployable.observer import empty_estimate
from tests.controller.deployable.scenery import ODIN, REGIONS, Sea, fly, law_for

NOISE = (0.02, 0.01)


def given_up(law):
    return [int(j) for j in np.flatnonzero(law.memory.thrusters.health == 0.0)]


@pytest.mark.parametrize("failed", [0, 6, *(pytest.param(j, marks=pytest.mark.slow) for j in (1, 2, 3, 4, 5, 7))])
def test_a_thruster_that_fails_under_way_is_found_and_no_other(failed):
    law, sea = law_for(REGIONS), Sea(noise=NOISE, seed=failed)
    fly(law, sea, steps=150)
    assert given_up(law) == []
    sea.failed = failed
    seen = []
    forces = fly(law, sea, steps=450, first=150, each=lambda t: seen.append(given_up(law)))
    assert seen[-1] == [failed]
    assert all(found in ([], [failed]) for found in seen)
    assert not forces[seen.index([failed]) + 1 :, failed].any()


@pytest.mark.parametrize("noise", [(0.0, 0.0), NOISE])
def test_nothing_is_given_up_where_nothing_fails(noise):
    law, sea = law_for(REGIONS), Sea(noise=noise, current=(-0.3, 0.2, 0.0), restoring=14.0)
    fly(law, sea, steps=1500, each=lambda t: not given_up(law) or pytest.fail(f"{t} s: {given_up(law)}"))
    assert np.all(np.isfinite(law.memory.fault_state.ratio))


def test_it_can_be_switched_off():
    law, sea = law_for(REGIONS, DeployableGains(failure_threshold=0.0)), Sea(failed=2)
    fly(law, sea, steps=500)
    assert given_up(law) == []


def test_a_suspicion_takes_back_the_one_before_but_not_what_was_told():
    thrusters, fault_state = make_thrusters(ODIN), fault_detection.empty_fault_state(8)
    thrusters.health[1] = 0.0  # told
    for failed in (4, 6):
        fault_state.ratio[:] = 5.0
        fault_detection.isolate_thruster(fault_state, thrusters, failed)
        assert np.flatnonzero(thrusters.health == 0.0).tolist() == [1, failed]
        assert not fault_state.ratio.any()


def test_a_wrong_suspicion_is_corrected():
    """With a working thruster given up, the one that has in truth failed is found and takes its place."""
    law, sea = law_for(REGIONS), Sea(noise=NOISE)
    fly(law, sea, steps=100)
    fault_detection.isolate_thruster(law.memory.fault_state, law.memory.thrusters, 3)
    reallocate(law.memory.thrusters)
    sea.failed = 0
    fly(law, sea, steps=500, first=100)
    assert given_up(law) == [0]


def test_the_ratio_is_that_of_the_two_densities():
    """One period, by SciPy: log p(r, e | nothing from thruster i) - log p(r, e | all well)."""
    rng = np.random.default_rng(2)
    dynamics, thrusters, gains = make_dynamics(ODIN, np.ones(9)), make_thrusters(ODIN), DeployableGains()
    compared = 0
    for _ in range(40):
        estimate, fault_state = empty_estimate(), fault_detection.empty_fault_state(8)
        thrusters.forces[:] = rng.uniform(-20.0, 20.0, 8)
        estimate.acceleration[:], estimate.innovation_deviation[:] = (
            rng.normal(size=3) * 0.05,
            rng.uniform(0.01, 0.02, 3),
        )
        estimate.innovation[:], residual = rng.normal(size=3) * 0.02, rng.normal(size=3) * 4.0
        fault_detection.detect_fault(fault_state, estimate, residual, dynamics, thrusters, np.eye(3), gains, 0.02, True)
        given = thrusters.forces * ODIN.thruster_matrix
        inertia = np.diag(dynamics.mass)[3:]
        spread = (0.06 * inertia) ** 2 + np.sum((0.1 * given[3:]) ** 2, axis=1)
        spread[:2] += (0.02 * 187.5 * np.linalg.norm(estimate.acceleration)) ** 2
        spread = np.sqrt(spread)
        for i in range(8):
            lag, missing = -given[:3, i] * 0.02 / 187.5, -given[3:, i]
            by_velocity = norm.logpdf(estimate.innovation, lag, estimate.innovation_deviation)
            by_velocity -= norm.logpdf(estimate.innovation, 0.0, estimate.innovation_deviation)
            by_moment = norm.logpdf(residual, missing, spread) - norm.logpdf(residual, 0.0, spread)
            tells = np.sum((missing / spread) ** 2) > 4.0
            expected = np.clip(by_velocity.sum(), -3, 3) + 0.2 * tells * np.clip(by_moment.sum(), -3, 3)
            assert fault_state.ratio[i] == pytest.approx(max(expected, 0.0), rel=1e-9, abs=1e-12)
            compared += expected > 0.0
    assert compared > 50


def test_without_a_measurement_nothing_is_learnt():
    thrusters, fault_state, estimate = make_thrusters(ODIN), fault_detection.empty_fault_state(8), empty_estimate()
    thrusters.forces[:] = 20.0
    residual = -ODIN.thruster_matrix[3:, 2] * 20.0
    for measured in (False, True):
        for _ in range(200):
            found = fault_detection.detect_fault(
                fault_state, estimate, residual, make_dynamics(ODIN, np.ones(9)), thrusters, np.eye(3),
                DeployableGains(),
                0.02, measured,
            )  # fmt: skip
        assert fault_state.ratio.any() == measured
    assert found == -1  # thrusters 1 and 3 have the same moment, and pushed alike


def test_lag_and_what_is_adapted_follow_their_equations():
    """Over several periods, turned, with thrusters that stay under suspicion and such as do not."""
    rng, kept = np.random.default_rng(3), 0
    dynamics, thrusters, gains = make_dynamics(ODIN, np.ones(9)), make_thrusters(ODIN), DeployableGains(adaptation=2.0)
    mass, inertia = dynamics.translational_mass[0], np.diag(dynamics.mass)[3:]
    fault_state, lags, adapted, ratios = (
        fault_detection.empty_fault_state(8),
        np.zeros((8, 3)),
        np.zeros((8, 3)),
        np.zeros(8),
    )
    thrusters.forces[:] = rng.uniform(10.0, 20.0, 8) * rng.choice([-1.0, 1.0], 8)
    thrusters.health[7] = 0.0
    given = thrusters.forces * ODIN.thruster_matrix
    for k in range(40):
        R = Rotation.from_euler("zyx", rng.normal(size=3) * 0.5).as_matrix()
        estimate, measured = empty_estimate(), k % 5 > 0
        estimate.innovation_deviation[:], estimate.gain[:] = rng.uniform(0.005, 0.01, 3), rng.uniform(0.2, 0.6, 3)
        lags[:7] -= 0.02 / mass * (R @ given[:3]).T[:7]
        estimate.innovation[:] = lags[2] + rng.normal(size=3) * 0.003
        residual = -given[3:, 2] + adapted[2] + rng.normal(size=3) * 0.3
        spread = np.sqrt((0.06 * inertia) ** 2 + np.sum((0.1 * given[3:]) ** 2, axis=1))
        fault_detection.detect_fault(fault_state, estimate, residual, dynamics, thrusters, R, gains, 0.02, measured)
        for i in range(7):
            step = 0.0
            if measured:
                step = norm.logpdf(estimate.innovation, lags[i], estimate.innovation_deviation).sum()
                step = np.clip(
                    step - norm.logpdf(estimate.innovation, 0.0, estimate.innovation_deviation).sum(), -3.0, 3.0
                )
                lags[i] *= 1.0 - estimate.gain
                missing = adapted[i] - given[3:, i]
                if np.sum((missing / spread) ** 2) > 4.0:
                    by_moment = norm.logpdf(residual, missing, spread) - norm.logpdf(residual, 0.0, spread)
                    step += 0.2 * np.clip(by_moment.sum(), -3.0, 3.0)
                adapted[i] -= gains.adaptation * 0.02 * (missing - (R[2] @ missing) * R[2])
            ratios[i] += step
            if ratios[i] <= 0.0:
                ratios[i] = lags[i, :] = adapted[i, :] = 0.0
            kept += ratios[i] > 0.0
        assert fault_state.ratio == pytest.approx(ratios, rel=1e-8, abs=1e-10)
        assert fault_state.lag == pytest.approx(lags, rel=1e-8, abs=1e-12)
        assert fault_state.adapted == pytest.approx(adapted, rel=1e-8, abs=1e-10)
    assert kept > 40 and ratios[2] > 20.0


def test_the_likeliest_must_be_ahead_of_the_next_and_above_the_threshold():
    dynamics, thrusters, gains = make_dynamics(ODIN, np.ones(9)), make_thrusters(ODIN), DeployableGains()
    for ratios, found in (
        ({2: 21.0, 5: 12.0}, 2), ({5: 12.0, 2: 21.0, 6: 12.9}, 2), ({2: 19.0, 5: 12.0}, -1), ({6: 11.9}, -1),
        ({1: 20.0, 6: 30.0}, 6), ({1: 24.0, 6: 30.0}, -1), ({3: 12.1}, 3),
    ):  # fmt: skip
        fault_state = fault_detection.empty_fault_state(8)
        for j, ratio in ratios.items():
            fault_state.ratio[j] = ratio
        given = dynamics, thrusters, np.eye(3), gains, 0.02, False
        assert fault_detection.detect_fault(fault_state, empty_estimate(), np.zeros(3), *given) == found


def test_nothing_is_found_where_it_is_switched_off():
    fault_state, given = (
        fault_detection.empty_fault_state(8),
        (make_dynamics(ODIN, np.ones(9)), make_thrusters(ODIN), np.eye(3)),
    )
    fault_state.ratio[3] = 100.0
    for threshold, found in ((12.0, 3), (0.0, -1)):
        gains = DeployableGains(failure_threshold=threshold)
        assert (
            fault_detection.detect_fault(fault_state, empty_estimate(), np.zeros(3), *given, gains, 0.02, False)
            == found
        )
