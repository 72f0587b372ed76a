"""Failed thrusters: found, the right one, never a working one; lost, partly lost, or stuck."""

import copy

import numpy as np
import pytest
from scipy.stats import norm

from controller.laws.deployable import actuator_lag, fault_detection, observer
from controller.laws.deployable.estimate import EFFECTIVENESS, LAG, POSITION, VELOCITY, initialize, make_estimate
from controller.laws.deployable.gains import DeployableGains
from controller.laws.deployable.model import make_dynamics, make_thrusters, reallocate
from tests.controller.deployable.scenery import LEVEL, ODIN, REGIONS, Sea, fly, law_for

NOISE = (0.02, 0.01)
GAINS = DeployableGains()


def isolated(law):
    return [int(j) for j in np.flatnonzero(law.memory.thrusters.health == 0.0)]


@pytest.mark.medium
@pytest.mark.parametrize("lag", [0.0, pytest.param(0.3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("failed", [0, 6, *(pytest.param(j, marks=pytest.mark.slow) for j in (1, 2, 3, 4, 5, 7))])
def test_failing_thruster_is_isolated_and_finally_no_other(failed, lag):
    law, sea = law_for(REGIONS), Sea(noise=NOISE, seed=failed, lag=lag)
    fly(law, sea, steps=150)
    assert isolated(law) == []
    sea.left[failed] = 0.0
    seen = []
    forces = fly(law, sea, steps=550, first=150, each=lambda t: seen.append(isolated(law)))
    assert seen[-1] == [failed]
    assert np.abs(forces[-50:, failed]).max() < 1.0  # what fails while it gives next to nothing may count as stuck


@pytest.mark.medium
@pytest.mark.parametrize("lag", [0.0, 0.15, 0.6])
@pytest.mark.parametrize("noise", [(0.0, 0.0), NOISE])
def test_healthy_thrusters_are_never_isolated(noise, lag):
    """Thrusters that give 70 to 100 % of their force, behind a lag that the law is not given; all start tilted."""
    law, sea = law_for(REGIONS), Sea(noise=noise, current=(-0.3, 0.2, 0.0), restoring=14.0, lag=lag)
    sea.left[:] = np.linspace(0.7, 1.0, 8)[[3, 0, 6, 2, 7, 1, 5, 4]]
    sea.quaternion[:] = 0.5, 0.5, 0.5, -0.5
    fly(law, sea, steps=1200, each=lambda t: not isolated(law) or pytest.fail(f"{t} s: {isolated(law)}"))
    assert np.all(np.isfinite(law.memory.fault_state.ratio))


@pytest.mark.medium
def test_partial_force_loss_is_estimated_without_isolation():
    for failed in (1, 5):
        law, sea = law_for(REGIONS), Sea(noise=NOISE)
        fly(law, sea, steps=150)
        sea.left[failed] = 0.4
        fly(law, sea, steps=500, first=150)
        assert isolated(law) == []
        x, P = law.memory.state_estimate.state, law.memory.state_estimate.covariance
        spread = np.sqrt(P[EFFECTIVENESS + failed, EFFECTIVENESS + failed])
        assert abs(x[EFFECTIVENESS + failed] - 0.4) < 4.0 * spread + 0.05


@pytest.mark.medium
def test_stuck_thruster_is_isolated_with_its_force():
    for failed in (0, 2):
        law, sea = law_for(REGIONS), Sea(noise=NOISE)
        forces = fly(law, sea, steps=150)
        sea.stuck[failed] = forces[-1, failed]
        fly(law, sea, steps=700, first=150)
        thrusters, x = law.memory.thrusters, law.memory.state_estimate.state
        assert isolated(law) == [failed]
        force = np.nan_to_num(thrusters.stuck[failed]) * x[EFFECTIVENESS + failed]  # what is lost gives nothing
        assert force == pytest.approx(sea.stuck[failed], abs=3.0)
        assert np.linalg.norm(sea.position - (8.0, 0.5, 2.5)) < 0.6


@pytest.mark.medium
def test_dead_thruster_misjudged_as_stuck_does_not_displace_the_vehicle():
    """What it is supposed to give, and does not, is compensated as a disturbance."""
    law, sea = law_for([]), Sea(noise=NOISE)
    fly(law, sea, regions=[], steps=100)
    memory = law.memory
    sea.left[2] = 0.0
    fault_detection._isolate(memory.fault_state, memory.state_estimate, memory.thrusters, 2, 15.0)
    reallocate(memory.thrusters)
    fly(law, sea, regions=[], steps=1300, first=100)
    assert np.linalg.norm(sea.position - (8.0, 0.5, 2.5)) < 0.6


def test_certain_or_reported_failure_is_not_retried():
    for tentative in (0, 2):
        estimate, thrusters, state = started()
        state.tentative[1], thrusters.health[1] = tentative, 0.0
        fault_detection._isolate(state, estimate, thrusters, 4, np.nan)
        assert np.flatnonzero(thrusters.health == 0.0).tolist() == [1, 4]
    state.tentative[4] = 1
    fault_detection._isolate(state, estimate, thrusters, 6, -3.0)
    assert np.flatnonzero(thrusters.health == 0.0).tolist() == [1, 6]
    assert estimate.covariance[EFFECTIVENESS + 6, EFFECTIVENESS + 6] == 0.5**2
    assert thrusters.stuck[6] == -3.0 and np.isnan(thrusters.stuck[[0, 1, 2, 3, 4, 5, 7]]).all()


def test_isolated_thrusters_are_retried_in_turn_at_growing_intervals():
    estimate, thrusters, state = started()
    reported, tried, period = np.ones(8), [], 0.1
    reported[7] = 0.0
    thrusters.health[[2, 4, 7]], thrusters.stuck[4] = 0.0, -3.0

    def wait(seconds, quiet=True):
        for _ in range(round(seconds / period)):
            found = fault_detection.try_again(state, estimate, thrusters, reported, quiet, period)
            if found >= 0:
                tried.append(found)
                assert thrusters.health[found] == 1.0 and np.isnan(thrusters.stuck[found])
                assert estimate.state[EFFECTIVENESS + found] == 1.0
                fault_detection._isolate(state, estimate, thrusters, found, np.nan)  # it is found out
                state.tentative[found] = 2

    wait(4.8)
    assert tried == []
    wait(0.4, quiet=False)
    assert tried == []
    wait(0.1)
    assert tried == [2]
    wait(5.2)
    assert tried == [2, 4]
    wait(39.0)
    assert tried == [2, 4]
    wait(1.5)
    assert tried == [2, 4, 2]
    thrusters.health[2] = 1.0  # one alone is not tried, nor what is reported
    wait(1000.0)
    assert tried == [2, 4, 2]


@pytest.mark.medium
def test_two_wrongly_isolated_thrusters_recover():
    """While another one has failed; of the two, one is thought to be stuck."""
    law, sea = law_for(REGIONS), Sea(noise=NOISE)
    fly(law, sea, steps=100)
    thrusters, sea.left[0] = law.memory.thrusters, 0.0
    thrusters.health[[0, 1, 2]], law.memory.fault_state.tentative[:3], thrusters.stuck[2] = 0.0, 2, -4.0
    reallocate(thrusters)
    forces = fly(law, sea, steps=100, first=100)
    assert not forces[:, [0, 1, 2]].any()  # nothing is commanded of what is stuck
    fly(law, sea, steps=2300, first=200)
    assert isolated(law) in ([0], [0, 1], [0, 2])
    assert np.linalg.norm(sea.position - (8.0, 0.5, 2.5)) < 0.6


def started():
    estimate, thrusters = make_estimate(ODIN), make_thrusters(ODIN)
    initialize(estimate, np.zeros(3), np.zeros(3), GAINS)
    return estimate, thrusters, fault_detection.FaultState(m=8, h=16)


def periods(count, rng, left, stuck):
    """Yield an estimate and its thrusters after each period, of a vehicle held level; thruster 3 fails in truth."""
    estimate, thrusters, state = started()
    dynamics, R, still = make_dynamics(ODIN, np.ones(9)), np.eye(3), np.zeros(3)
    body, estimate.state[LAG] = dynamics.inverse_mass @ thrusters.matrix, 0.0
    velocity, mass = np.zeros(3), dynamics.translational_mass
    for k in range(count):
        fault_detection.detect_fault(state, estimate, thrusters, GAINS._replace(failure_threshold=1e9))
        thrusters.forces[:] = 8.0 * np.sin(0.1 * k + np.arange(8))
        actual = 0.95 * thrusters.forces
        if k >= 20:
            actual[3] = stuck if stuck is not None else left * actual[3]
        actuator_lag.update_forces(estimate, thrusters, 0.02)
        observer.predict(estimate, dynamics, thrusters, body, R, still, GAINS, 0.02)
        drag = ODIN.quadratic_damping[:3] * abs(velocity) * velocity / mass
        velocity = velocity + 0.02 * ((body @ actual)[:3] - drag)
        given = thrusters.matrix[3:] @ actual, np.zeros((3, 2)), np.zeros(3), dynamics, thrusters, R, LEVEL, still
        before = copy.deepcopy(estimate)
        observer.correct_by_moment(estimate, *given, GAINS, 0.02)
        observer.correct(estimate, POSITION, estimate.position.copy(), 0.02, GAINS)
        observer.correct(estimate, VELOCITY, velocity, 0.01, GAINS)
        yield k, state, before, estimate


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(("hypothesis", "left", "stuck"), [(3, 0.0, None), (8 + 3, 1.0, 0.95 * 8.0 * np.sin(1.9 + 3))])
def test_expected_innovations_match_measured_ones_under_the_true_hypothesis(hypothesis, left, stuck):
    """The deviation, propagated from the failure on, makes the innovations: their products equal its squares."""
    products, squares = 0.0, 0.0
    for k, state, _, estimate in periods(45, np.random.default_rng(1), left, stuck):
        if k < 20:
            fault_detection._start_anew(state, estimate, make_thrusters(ODIN), 3, hypothesis)
            if hypothesis > 3:
                estimate.supposed[:, 3] = 0.95, 8.0 * np.sin(0.1 * k + 3)
        else:
            products += estimate.evidence[0, hypothesis]
            squares += estimate.evidence[1, hypothesis]
    assert squares > 20.0
    assert products == pytest.approx(squares, rel=0.15)


def test_evidence_is_the_log_likelihood_ratio():
    """Of one number, by SciPy: a normal density about what is expected, against one about zero."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        estimate, _, _ = started()
        estimate.row[:], estimate.deviation[:] = rng.normal(size=32), rng.normal(size=(16, 32)) * 0.1
        variance = 1.0 + estimate.row @ estimate.covariance @ estimate.row
        innovation = rng.normal() * np.sqrt(variance)
        expected = estimate.deviation @ estimate.row
        observer._correct(estimate, innovation, 1.0, 1.0, 0, 0, estimate.row.size)
        ratio = estimate.evidence[0] - 0.5 * estimate.evidence[1]
        densities = norm.logpdf(innovation, expected, np.sqrt(variance)) - norm.logpdf(
            innovation, 0.0, np.sqrt(variance)
        )
        assert ratio == pytest.approx(densities, rel=1e-9, abs=1e-12)


def test_evidence_is_summed_since_the_hypothetical_failure():
    estimate, thrusters, state = started()
    estimate.evidence[:, 2], estimate.evidence[:, 10] = (3.0, 2.0), (1.5, 1.0)
    thrusters.acting[2] = estimate.missing[2] = 20.0
    for _ in range(2):
        fault_detection._add_evidence(state, estimate, thrusters, 2, 2, GAINS)
        fault_detection._add_evidence(state, estimate, thrusters, 2, 10, GAINS)
    assert state.sums[:, [2, 10]].tolist() == [[6.0, 3.0], [4.0, 2.0]]
    assert state.ratio[[2, 10]] == pytest.approx([2.0 * (0.6 * 3.0 - 0.5 * 0.36 * 2.0), 2.0 * (1.5 - 0.5)])
    estimate.evidence[:, 2] = -30.0, 2.0
    fault_detection._add_evidence(state, estimate, thrusters, 2, 2, GAINS)
    assert state.ratio[2] == 0.0 and not state.sums[:, 2].any()


def test_a_small_missing_force_gives_at_most_half_the_threshold():
    """Below a tenth of the limit, 27 N; what was known before counts, and so does what speaks against a failure."""
    for force, before, expected in ((2.6, 0.0, 6.0), (-2.6, 9.0, 9.0), (2.8, 0.0, 15.0), (-2.8, 9.0, 24.0)):
        for hypothesis, evidence in ((2, (10.0, 1.0)), (10, (5.5, 1.0))):
            estimate, thrusters, state = started()
            state.ratio[hypothesis], estimate.evidence[:, hypothesis] = before, evidence
            thrusters.acting[2], estimate.missing[2] = (force / 0.3, 20.0) if hypothesis == 2 else (20.0, force)
            estimate.state[EFFECTIVENESS + 2] = 0.3
            for _ in range(5):
                fault_detection._add_evidence(state, estimate, thrusters, 2, hypothesis, GAINS)
            assert state.ratio[hypothesis] == pytest.approx(expected)
            counted = (
                5 if abs(force) > 2.7 else 2 if before == 0.0 else 0
            )  # what does not count tells nothing of the loss
            assert state.sums[0, hypothesis] <= counted * evidence[0]
            estimate.evidence[0, hypothesis] = -1.0
            fault_detection._add_evidence(state, estimate, thrusters, 2, hypothesis, GAINS)
            assert state.ratio[hypothesis] < expected


def test_evidence_counts_less_by_the_square_of_the_misfit():
    for misfit, weight in ((0.5, 1.0), (3.0, 1.0 / 9.0)):
        estimate, thrusters, state = started()
        estimate.evidence[:, 2], estimate.misfit = (3.0, 2.0), misfit
        fault_detection._add_evidence(state, estimate, thrusters, 2, 2, GAINS)
        assert state.sums[:, 2] == pytest.approx([3.0 * weight, 2.0 * weight])
        fault_detection._isolate(state, estimate, thrusters, 2, np.nan)  # it explains the misfit
        assert estimate.misfit == 1.0


def test_innovations_are_clipped_at_three_standard_deviations():
    for sigmas, counted in ((2.9, 2.9), (30.0, 3.0)):
        estimate, _, _ = started()
        estimate.row[:] = np.eye(32)[3]
        spread = np.sqrt(1.0 + estimate.covariance[3, 3])
        estimate.deviation[0, 3] = 1.0
        before, gain = estimate.state[3], estimate.covariance[3, 3]
        observer._correct(estimate, sigmas * spread, 1.0, 1.0, 0, 0, estimate.row.size)
        effective = spread * sigmas / counted
        assert estimate.state[3] - before == pytest.approx(gain / effective**2 * sigmas * spread, rel=1e-9)
        assert estimate.evidence[0, 0] == pytest.approx(counted / effective, rel=1e-9)


def test_detection_requires_threshold_and_lead_over_the_next_hypothesis():
    for ratios, found in (
        ({2: 21.0, 5: 12.0}, 2), ({5: 12.0, 2: 21.0, 6: 12.9}, 2), ({2: 19.0, 5: 12.0}, -1), ({6: 11.9}, -1),
        ({1: 20.0, 6: 30.0}, 6), ({1: 24.0, 6: 30.0}, -1), ({3: 12.1}, 3), ({3: 30.0, 11: 29.0}, 3), ({9: 14.0}, 1),
    ):  # fmt: skip
        assert detection(ratios, GAINS._replace(failure_threshold=0.0)) == -1
        assert detection(ratios, GAINS) == found


def detection(ratios, gains):
    """Return the thruster that is isolated by log likelihood ratios of hypotheses, of the loss of all its force."""
    estimate, thrusters, state = started()
    for hypothesis, ratio in ratios.items():
        state.ratio[hypothesis], state.sums[:, hypothesis] = ratio, 2.0 * ratio
    estimate.deviation[:8, EFFECTIVENESS : EFFECTIVENESS + 8] = -0.95 * np.eye(8)
    return fault_detection.detect_fault(state, estimate, thrusters, gains)


def test_hypotheses_about_an_isolated_thruster_are_cleared_and_others_stay():
    estimate, thrusters, state = started()
    thrusters.health[5], state.ratio[:] = 0.0, 4.0
    assert fault_detection.detect_fault(state, estimate, thrusters, GAINS) == -1
    assert np.flatnonzero(state.ratio == 0.0).tolist() == [5, 8 + 5] and (np.sort(state.ratio)[2:] == 4.0).all()


@pytest.mark.parametrize(("ratio", "following", "tentative"), [(30.0, 0.0, 1), (50.0, 0.0, 2), (50.0, 12.0, 1)])
def test_isolation_is_tentative_up_to_a_lead_of_40(ratio, following, tentative):
    estimate, thrusters, state = started()
    state.ratio[2], state.ratio[5] = ratio, following
    state.sums[:, 2], estimate.deviation[2, EFFECTIVENESS + 2] = 2.0 * ratio, -estimate.state[EFFECTIVENESS + 2]
    assert fault_detection.detect_fault(state, estimate, thrusters, GAINS) == 2
    assert state.tentative.tolist() == [0, 0, tentative, 0, 0, 0, 0, 0]


def test_likelier_hypothesis_has_the_greater_log_likelihood_ratio():
    """Of the likeliest loss, s^2 / (2 q), against that of a stuck thruster, s - q / 2."""
    _, _, state = started()
    for lost, stuck, likelier in (
        ((4.0, 4.0), (3.0, 3.0), 3),
        ((4.0, 4.0), (3.0, 1.0), 11),
        ((-9.0, 4.0), (1.0, 1.0), 11),
    ):
        state.sums[:, 3], state.sums[:, 11] = lost, stuck
        assert fault_detection._likelier(state, 3, 8) == likelier


def test_half_lost_thruster_is_kept_with_the_other_half():
    """As the sums of evidence say: their quotient is the likeliest loss."""
    estimate, thrusters, state = started()
    before = estimate.state[EFFECTIVENESS + 4]
    state.ratio[:] = 1.0
    state.ratio[4], state.sums[0, 4], state.sums[1, 4] = 21.0, 21.0, 42.0
    estimate.deviation[4, EFFECTIVENESS + 4] = -before
    assert fault_detection.detect_fault(state, estimate, thrusters, GAINS) == -1
    assert estimate.state[EFFECTIVENESS + 4] == pytest.approx(0.5 * before)
    assert thrusters.health.all() and not state.tentative.any() and not state.ratio.any() and not state.sums.any()


def test_ineffective_thruster_is_isolated_without_an_estimate_jump():
    estimate, thrusters, state = started()
    estimate.state[EFFECTIVENESS + 5] = 0.05
    estimate.covariance[EFFECTIVENESS:, :EFFECTIVENESS] = 0.0
    estimate.covariance[EFFECTIVENESS + 5, EFFECTIVENESS + 5] = 0.1**2  # it may give a third
    assert fault_detection.detect_fault(state, estimate, thrusters, GAINS) == -1
    estimate.covariance[EFFECTIVENESS + 5, EFFECTIVENESS + 5] = 0.02**2
    estimate.misfit = 5.0  # the model does not fit
    assert fault_detection.detect_fault(state, estimate, thrusters, GAINS) == -1
    estimate.misfit, estimate.state[EFFECTIVENESS : EFFECTIVENESS + 5] = 0.8, 0.1  # all thrusters seem weak
    assert fault_detection.detect_fault(state, estimate, thrusters, GAINS) == -1
    estimate.state[EFFECTIVENESS : EFFECTIVENESS + 5] = 0.95
    assert fault_detection.detect_fault(state, estimate, thrusters, GAINS) == 5
    assert thrusters.health[5] == 0.0 and estimate.state[EFFECTIVENESS + 5] == 0.0 and state.tentative[5] == 1
