"""The rows of the barriers against the equations in matrices; faces ahead against a box's own planes."""

import copy

import numpy as np
import pytest

from controller.laws.deployable import barrier, clearance_bound, faces
from controller.laws.deployable.estimate import VELOCITY, make_estimate
from controller.laws.deployable.gains import DeployableGains
from controller.quadratic_program import empty_workspace
from controller.regions import Box, Ellipsoid, HalfSpace, Orientation, Region, Sphere, Visibility, pack
from tests.controller.deployable.scenery import LEVEL, ODIN

GAINS = DeployableGains()
AHEAD = 1e-4  # s


def unit(x):
    return x / np.linalg.norm(x)


def evaluated(regions, time, position, quaternion):
    """Return clearances, and their slopes over the pose, of length 1 for places."""
    packed, n = pack(regions), len(regions)
    packed.move_to(time)
    values, gradients, rotation_gradients, clearances = np.empty(n), np.empty((n, 3)), np.empty((n, 3)), np.empty(n)
    packed.evaluate(position, quaternion, values, gradients, rotation_gradients, clearances)
    slopes = -np.hstack([gradients, rotation_gradients])
    for i, region in enumerate(regions):
        if region.shape.unit != "rad":
            slopes[i] /= np.linalg.norm(gradients[i])
    return clearances, slopes


def later_pose(position, quaternion, velocity):
    e, w = quaternion, velocity[3:]
    turning = 0.5 * np.r_[-e[1:] @ w, e[0] * w + np.cross(e[1:], w)]
    return position + AHEAD * velocity[:3], unit(quaternion + AHEAD * turning)


def allowed(h, a, slope):
    """phi and its derivative."""
    if h <= 0.0:
        return slope * h, slope
    root = np.sqrt(2.0 * a * h + (a / slope) ** 2)
    return root - a / slope, a / root


def expected_row(n, distance, margin, relative, turning, braking, motion):
    h, rate = distance - margin, n @ relative
    phi, slope = allowed(h, braking, GAINS.barrier_slope)
    rhs = -GAINS.barrier_rate * (rate + phi) - slope * rate - n @ motion.free_acceleration - turning
    return n @ motion.thruster_acceleration, rhs


def moving(rng, velocity, position_spread=0.1):
    return barrier.Motion(
        rng.normal(size=3), np.asarray(velocity), rng.normal(size=6) * 0.1, rng.normal(size=(6, 8)) * 0.01,
        180.0, 9.0, 0.25, position_spread, np.array([4e-4, 9e-4, 1e-4]), 0.01,
    )  # fmt: skip


def spread(n, motion, deviation=0.0):
    """Three deviations of a clearance, by the covariances of vehicle and region."""
    return 3.0 * np.sqrt(n[:3] @ np.diag(motion.position_variance + np.square(deviation)) @ n[:3])


def written(regions, motion, quaternion, weights, limits=(-30.0, 25.0), time=1.5):
    packed, n = pack(regions), len(regions)
    packed.move_to(time)
    sight, work = barrier.RegionObservation(n=n), empty_workspace((1 + faces.FACES) * n, 8)
    barrier.observe_regions(sight, packed, motion.position, quaternion, motion.velocity)
    lower, upper = (np.full(8, limit) for limit in limits)
    count = barrier.write_rows(work, sight, packed, weights, motion, lower, upper, 1.0, GAINS)
    return work.rows[:count].copy(), work.rhs[:count].copy(), work.price[:count].copy()


def test_barrier_rows_match_the_equations():
    rng, n_rows, n_dropped, n_inside = np.random.default_rng(1), 0, 0, 0
    for _ in range(60):
        motion, quaternion = moving(rng, rng.normal(size=6) * 0.4), unit(rng.normal(size=4))
        regions = [
            *(
                Region(
                    f"ball {i}",
                    Sphere(tuple(rng.normal(size=3) * 2.0), 0.6),
                    "out",
                    tuple(rng.normal(size=3) * 0.3),
                    deviation=(0.05 * i, 0.02, 0.0) if i < 2 else 0.1,
                )
                for i in range(3)
            ),
            Region("pen", HalfSpace(tuple(rng.normal(size=3)), tuple(rng.normal(size=3))), "in"),
            Region("soft", Sphere((0.0, 0.0, 0.0), 0.5), "out", hard=False),
            Region("wall", HalfSpace(tuple(rng.normal(size=3)), tuple(rng.normal(size=3))), "in"),
            Region("face", Orientation(tuple(rng.normal(size=4)), 2.0), "in"),
            Region("see", Visibility((2.0, 1.0, 0.5), (1.0, 0.2, -0.1), 1.2, (0.2, 0.1, 0.3)), "in"),
        ]
        weights = rng.uniform(size=len(regions))
        here, n = evaluated(regions, 1.5, motion.position, quaternion)
        _, later = evaluated(regions, 1.5 + AHEAD, *later_pose(motion.position, quaternion, motion.velocity))
        rows, rhs, price = [], [], []
        for i, region in enumerate(regions):
            if not region.hard:
                continue
            relative = motion.velocity - np.r_[region.velocity, np.zeros(3)]
            turning = (later[i] - n[i]) / AHEAD @ relative
            braking, margin, scale = motion.braking, GAINS.margin + motion.position_spread, motion.mass**2
            margin += spread(n[i], motion, region.deviation)
            if region.shape.unit == "rad":
                along = np.linalg.norm(n[i, :3])
                braking, margin = GAINS.turning_deceleration, 0.02 + along * motion.position_spread
                margin += spread(n[i], motion) + 3.0 * 0.01 * np.linalg.norm(n[i, 3:])
                scale = (motion.mass * along) ** 2 + (motion.inertia * np.linalg.norm(n[i, 3:])) ** 2
            elif turning < 0.0 and (isinstance(region.shape, HalfSpace) or later[i] @ n[i] < 0.5):
                turning = 0.0
            row, bound = expected_row(n[i], here[i], margin, relative, turning, braking, motion)
            n_inside += here[i] < margin
            if bound <= np.sum(np.where(row > 0.0, -30.0 * row, 25.0 * row)):
                n_dropped += 1
                continue
            rows.append(row)
            rhs.append(bound)
            price.append(10.0 ** (-3.0 - 3.0 * weights[i]) / scale)
        n_rows += len(rows)
        ours = written(regions, motion, quaternion, weights)
        for given, expected in zip(ours, (np.reshape(rows, (-1, 8)), rhs, price), strict=True):
            np.testing.assert_allclose(given, expected, rtol=1e-8, atol=1e-7)
    assert n_rows > 100 and n_dropped > 20 and n_inside > 10


@pytest.mark.parametrize("keep", ["out", "in"])
def test_gradient_rate_equals_the_curvature(keep):
    """Of a ball, (v^2 - (n v)^2) / r; of an ellipsoid, v^T (I - n n^T) A v / |A p| with the level function p^T A p."""
    rng, axes, largest = np.random.default_rng(6), np.array([2.0, 0.6, 0.9]), 0.0
    shapes = Sphere((0.0, 0.0, 0.0), 0.7), Ellipsoid((0.0, 0.0, 0.0), tuple(axes))
    for _ in range(40):
        direction, v = unit(rng.normal(size=3)), rng.normal(size=3)
        for shape, size in zip(shapes, (np.full(3, 0.7), axes), strict=True):
            at = direction * size * (rng.uniform(1.02, 1.5) if keep == "out" else rng.uniform(0.6, 0.98))
            A = np.diag(size**-2.0)
            n = unit(A @ at) * (1.0 if keep == "out" else -1.0)
            exact = v @ (np.eye(3) - np.outer(n, n)) @ A @ v / np.linalg.norm(A @ at) * (1.0 if keep == "out" else -1.0)
            packed, sight = pack([Region("one", shape, keep)]), barrier.RegionObservation(n=1)
            barrier.observe_regions(sight, packed, at, LEVEL, np.r_[v, np.zeros(3)])
            now, later = np.zeros(6), np.zeros(6)
            barrier.pose_gradient(sight.gradients, sight.rotation_gradients, 0, False, now)
            barrier.pose_gradient(sight.later_gradients, sight.later_rotation_gradients, 0, False, later)
            rate = barrier.gradient_rate(shape.kind, packed.signs[0], now, later, np.r_[v, np.zeros(3)])
            assert now[:3] == pytest.approx(n, abs=1e-12)
            # of one that is kept within what would help is left out
            assert rate == pytest.approx(exact if keep == "out" else min(exact, 0.0), rel=5e-3, abs=1e-6)
            largest = max(largest, abs(exact))
    assert largest > 3.0


def test_barrier_bound_is_the_least_admissible_clearance():
    """Of a wall: 0 where h and its rate are well; else the clearance less its spread, or psi / kappa."""
    rng, wall, fallen = np.random.default_rng(5), Region("wall", HalfSpace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), "in"), 0
    for _ in range(60):
        motion = moving(rng, np.r_[rng.normal(size=3) * 0.8, np.zeros(3)])
        packed, sight, work = pack([wall]), barrier.RegionObservation(n=1), empty_workspace(1 + faces.FACES, 8)
        barrier.observe_regions(sight, packed, motion.position, np.array([1.0, 0.0, 0.0, 0.0]), motion.velocity)
        limits = np.full(8, -30.0), np.full(8, 25.0)
        barrier.write_rows(work, sight, packed, np.ones(1), motion, *limits, 1.0, GAINS)
        inwards = -np.eye(3)[0]
        distance = float(inwards @ motion.position)
        h = distance - GAINS.margin - motion.position_spread - spread(inwards, motion)
        psi = inwards @ motion.velocity[:3] + allowed(h, motion.braking, GAINS.barrier_slope)
        expected = min(0.0, float(h + GAINS.margin), float(np.ravel(psi)[0] / GAINS.barrier_slope))
        assert sight.clearances[0] == pytest.approx(distance)
        assert sight.bound == pytest.approx(expected, abs=1e-12)
        fallen += expected < 0.0
    assert 10 < fallen < 60


def test_barrier_right_side_is_smoothed_while_violated():
    rng, packed = np.random.default_rng(7), pack([Region("wall", HalfSpace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), "in")])
    sight, work, limits = (
        barrier.RegionObservation(n=1),
        empty_workspace(1 + faces.FACES, 8),
        (np.full(8, -30.0), np.full(8, 25.0)),
    )
    previous = None
    for k in range(40):
        motion, fraction = moving(rng, np.r_[1.0, rng.normal(size=5)]), 1.0 if k % 4 == 0 else 0.3
        rhs_values = []
        for used in (1.0, fraction):
            own = copy.deepcopy(sight)
            barrier.observe_regions(own, packed, motion.position, np.array([1.0, 0.0, 0.0, 0.0]), motion.velocity)
            assert barrier.write_rows(work, own, packed, np.ones(1), motion, *limits, used, GAINS) == 1
            rhs_values.append(work.rhs[0])
        previous = rhs_values[0] if fraction == 1.0 else previous + 0.3 * (rhs_values[0] - previous)
        assert rhs_values[1] == pytest.approx(previous, rel=1e-12)
        sight = own


def test_bound_rises_with_the_clearance_and_falls_only_by_restarts_and_jumps():
    b = clearance_bound.ClearanceBound()

    def bound(now, restarts=False, loss=0.0):
        clearance_bound.update_bound(b, now, loss, restarts)
        return b.bound

    assert bound(-0.2) == -0.2  # the first: a start within a region
    assert bound(-0.16) == -0.16
    assert bound(-0.19) == -0.16  # falls without a reason: the bound stands, and can turn out false
    assert bound(-0.23) == -0.16
    assert bound(-0.25, restarts=True) == -0.25
    assert bound(0.0, loss=0.03) == -0.03
    assert bound(-0.06) == -0.06  # more than any motion within a step: a region has leapt
    assert bound(-0.02) == -0.02


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("period", [0.01, 0.05])
def test_error_of_the_acceleration_is_found_in_the_corrections_of_any_estimate(period):
    """Lemma 1 of docs/theory.md: what errors add to psi, and what corrections add, differ by twice the velocity's."""
    rng, gains, worst = np.random.default_rng(8), GAINS, 0.0
    for case in range(20):
        b, true, seen, added = clearance_bound.ClearanceBound(), np.zeros(3), np.zeros(3), np.zeros(3)
        size, gain, wrong = rng.uniform(0.05, 1.0), rng.uniform(0.01, 0.5), 0.0
        for k in range(400):
            motion = moving(rng, np.r_[seen, np.zeros(3)])._replace(position=np.zeros(3))
            b.position = motion.position  # positions are not corrected here
            clearance_bound.measure_error(b, motion, gains, period)
            wrong = max(wrong, np.linalg.norm(true - seen))
            assert np.linalg.norm(added - b.by_velocity) <= 2.0 * wrong + 1e-12
            forces = rng.normal(size=8)
            clearance_bound.predict_point(b, motion, forces, period)
            error = size * np.sign(np.sin(0.02 * case * k + case)) * np.ones(3)
            added = (1.0 - gains.barrier_rate * period) * added + period * error
            true = true + (b.velocity - motion.velocity[:3]) + period * error
            seen = b.velocity + gain * (true - b.velocity + 0.01 * rng.normal(size=3))
        worst = max(worst, b.error)
    assert worst > 0.1


@pytest.mark.medium
def test_theorem_holds_for_the_errors_that_it_admits():
    """docs/theory.md: a point that brakes before a wall by its row alone, with random errors and with lasting ones."""
    rng, period, kappa, rate, nearest = np.random.default_rng(9), 0.002, GAINS.barrier_slope, GAINS.barrier_rate, np.inf
    b, seen = clearance_bound.ClearanceBound(), make_estimate(ODIN)
    seen.covariance[:] = 0.0
    for case in range(60):
        braking, size, omega, slack = rng.uniform([0.1, 0.0, 0.0, 0.0], [2.0, 0.2, 0.05, 0.3])
        d, v = rng.uniform(-0.2, 1.0), rng.uniform(-1.2, 0.3)  # true clearance; estimated rate
        h = d - GAINS.margin - rng.uniform(0.0, 0.1)
        begin = min(GAINS.margin + h, (v + allowed(h, braking, kappa)[0]) / kappa, 0.0)
        by_position, by_velocity, lowest = 0.0, size, d
        error = size
        for _ in range(4000):
            phi, slope = allowed(h, braking, kappa)
            acceleration = -rate * (v + phi) - slope * v - slack  # no more than the row asks for
            aim = -size if case % 2 else rng.uniform(-size, size)
            correction = aim - (1.0 - rate * period) * by_velocity
            d, predicted = d + period * (v - omega), h + period * v
            h, v = min(predicted, d - GAINS.margin), v + period * acceleration + correction
            by_velocity, by_position = aim, (1.0 - rate * period) * by_position + h - predicted
            error, lowest = max(error, abs(by_velocity) + kappa * abs(by_position)), min(lowest, d)
        b.error, seen.covariance[VELOCITY, VELOCITY] = error, (omega / 3.0) ** 2
        loss = clearance_bound.error_loss(b, seen, slack, 0.0, GAINS)
        assert lowest >= begin - loss - 1e-3, case
        nearest = min(nearest, lowest - begin + loss)
    assert nearest < 0.05


def test_gradient_rate_is_zero_at_a_switch_of_flat_faces():
    n, later, v = np.eye(6)[0], np.eye(6)[1], np.array([1.0, 0.5, 0.0, 0.0, 0.0, 0.0])
    for kind in (Box.kind, Sphere.kind):
        assert barrier.gradient_rate(kind, -1.0, n, later, v) == 0.0  # towards: a leap
        assert barrier.gradient_rate(kind, -1.0, n, later, -v) == pytest.approx(0.5 / AHEAD)
    near = unit(np.array([0.9, 0.3, 0.0, 0.0, 0.0, 0.0]))
    back = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert barrier.gradient_rate(Sphere.kind, -1.0, n, near, back) == pytest.approx((near[0] - 1.0) / AHEAD)
    assert barrier.gradient_rate(Box.kind, -1.0, n, near, back) == 0.0
    assert barrier.gradient_rate(Orientation.kind, 1.0, n, later, v) == pytest.approx(-0.5 / AHEAD)
    assert barrier.gradient_rate(Orientation.kind, 1.0, n, later, -v) == pytest.approx(0.5 / AHEAD)
    assert barrier.gradient_rate(Box.kind, 1.0, n, later, -v) == 0.0  # from inside


def planes(box, position):
    """Return the distance to each face from within, and its slope inwards."""
    from_center = position - np.array(box.center)
    half = np.array(box.size) / 2.0
    return [(half[a] - s * from_center[a], -s * np.eye(3)[a]) for a in range(3) for s in (1.0, -1.0)]


def test_faces_ahead_are_box_planes():
    """Of a box that is kept within: the nearest, then those that the rest of the velocity leads to, with rows each."""
    rng, box, two, three = np.random.default_rng(2), Box((0.5, -0.4, 0.3), (3.0, 4.0, 5.0)), 0, 0
    region = Region("box", box, "in", (0.05, -0.02, 0.03))
    for _ in range(80):
        at = np.array(box.center) + rng.uniform(-0.49, 0.49, 3) * np.array(box.size)
        motion = moving(rng, np.r_[rng.normal(size=3) * 0.5, np.zeros(3)], position_spread=0.02)
        motion = motion._replace(position=at + 1.5 * np.array(region.velocity), free_acceleration=np.zeros(6))
        relative = motion.velocity - np.r_[region.velocity, np.zeros(3)]
        margin, way = GAINS.margin + motion.position_spread, relative[:3].copy()
        speed = np.linalg.norm(way)
        nearest = min(planes(box, at), key=lambda plane: plane[0])
        braked = speed * (speed / (2 * motion.braking) + 1 / GAINS.barrier_slope + 1 / GAINS.barrier_rate)
        reach = margin + spread(nearest[1], motion) + braked
        found = [nearest]
        for _face in range(2 if found[0][0] < reach else 0):
            way -= min(way @ found[-1][1], 0.0) * found[-1][1]
            speed = np.linalg.norm(way)
            if speed < 1e-6:
                break
            ahead = [(d / -(s @ way) * speed, d, s) for d, s in planes(box, at) if s @ way < -1e-9]
            length, distance, slope = min(ahead, key=lambda plane: plane[0])
            if abs(length - reach) < 1e-3:  # either way
                break
            if length > reach:
                break
            found.append((distance, slope))
        else:
            two, three = two + (len(found) == 2), three + (len(found) == 3)
        rows = [
            expected_row(np.r_[s, np.zeros(3)], d, margin + spread(s, motion), relative, 0.0, motion.braking, motion)
            for d, s in found
        ]
        ours = written([region], motion, np.array([1.0, 0.0, 0.0, 0.0]), np.ones(1), (-1e4, 1e4))
        assert len(ours[0]) == 0 or np.isfinite(ours[0]).all()
        kept = [(row, bound) for row, bound in rows if bound > -1e4 * np.abs(row).sum()]
        np.testing.assert_allclose(ours[0], np.reshape([row for row, _ in kept], (-1, 8)), rtol=1e-7, atol=1e-9)
        np.testing.assert_allclose(ours[1], [bound for _, bound in kept], rtol=1e-6, atol=1e-8)
    assert three > 5


def test_no_face_is_ahead_without_motion_or_within_reach():
    regions, face = pack([Region("box", Box((0.0, 0.0, 0.0), (4.0, 4.0, 4.0)), "in")]), np.empty(3)
    nearest, at = np.array([-1.0, 0.0, 0.0]), np.array([1.0, 0.2, 0.1])
    assert faces.face_ahead(regions, 0, at, nearest, np.array([0.4, 0.0, 0.0]), 3.0, face) == np.inf
    for reach, distance in ((1.7, np.inf), (1.9, 1.8)):
        velocity = np.array([0.0, 0.3, 0.0])
        assert faces.face_ahead(regions, 0, at, nearest, velocity, reach, face) == pytest.approx(distance)
    assert face.tolist() == [0.0, -1.0, 0.0]
    assert faces.face_ahead(regions, 0, at, nearest, np.array([0.0, 0.0, -0.3]), 2.5, face) == pytest.approx(2.1)
    assert face.tolist() == [0.0, 0.0, 1.0]
