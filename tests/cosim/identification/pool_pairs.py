"""Pairs of tables of a pool session: a commanded wrench, and a navigation filter with repeats and bursts."""

import numpy as np
import pandas as pd

STEP = 0.01  # s
MASS, WEIGHT = 11.5, 112.8
TRUE = {
    "added_mass": np.diag([6.5, 14.0, 16.0, 0.18, 0.15, 0.2]), "linear": np.array([9.0, 14.0, 16.0, 0.25, 0.3, 0.35]),
    "quadratic": np.array([28.0, 62.0, 55.0, 0.7, 0.7, 0.6]), "buoyancy": 114.5, "r_B": np.array([0.0, 0.0, -0.03]),
    "trim": np.array([2.8, -1.9, 0.0, 0.0, 0.0, 0.1]), "lag": 0.12, "delay": 0.15,
}  # fmt: skip
TRUE["added_mass"][[0, 4, 1, 3, 1, 5], [4, 0, 3, 1, 5, 1]] = 0.35, 0.35, -0.4, -0.4, 0.3, 0.3
INERTIA = np.diag([0.21, 0.25, 0.25])

MAP = """world = "NED"
body = "FRD"
time = { column = "time", unit = "s" }
[wrench]
file = "*wrench*.csv"
columns = ["X", "Y", "Z", "K", "M", "N"]
[attitude]
file = "*nav*.csv"
columns = ["yaw", "pitch", "roll"]
euler = "ZYX"
[velocity]
file = "*nav*.csv"
columns = ["u", "v", "w"]
[depth]
file = "*nav*.csv"
columns = ["depth"]
"""
VEHICLE = """name = "pool"
rigid_body.mass = 11.5  # kg
hull.size = [0.46, 0.34, 0.25]  # m: length, width, height
"""


def skew(x):
    a, b, c = x.T
    zero = 0.0 * a
    return np.stack([np.stack([zero, -c, b], -1), np.stack([c, zero, -a], -1), np.stack([-b, a, zero], -1)], -2)


def rotations(angles):
    (cr, cp, cy), (sr, sp, sy) = np.cos(angles).T, np.sin(angles).T
    return np.stack([
        np.stack([cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy], -1),
        np.stack([cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy], -1),
        np.stack([-sp, sr * cp, cr * cp], -1),
    ], -2)  # fmt: skip


def commands(rng, runs, seconds):
    """Wrenches at 50 Hz: steps and ramps of a pilot on each axis, shape (runs, n, 6)."""
    n, scale = int(seconds * 50), np.array([28.0, 24.0, 22.0, 0.0, 0.0, 4.0])
    wrench = np.zeros((runs, n, 6))
    for run, axis in np.ndindex(runs, 6):
        k = 0
        while k < n:
            length = int(rng.uniform(20, 200))
            level = rng.uniform(-1, 1) * (rng.random() < 0.7)
            wrench[run, k : k + length, axis] = level * scale[axis]
            k += length
    kernel = np.hanning(13) / np.hanning(13).sum()
    return np.apply_along_axis(lambda x: np.convolve(x, kernel, "same"), 1, wrench)


def simulate(rng, runs=16, seconds=60.0, disturbance=0.8):
    """States of all runs at steps: angles, velocities (6) and depth; and the commands at 50 Hz."""
    wrench = commands(rng, runs, seconds)
    M_rb = np.zeros((6, 6))
    M_rb[:3, :3], M_rb[3:, 3:] = MASS * np.eye(3), INERTIA
    M = M_rb + TRUE["added_mass"]
    inverse = np.linalg.inv(M)
    current = rng.uniform(-0.06, 0.06, (runs, 3)) * [1, 1, 0]
    n = int(seconds / STEP)
    angles, nu, depth = np.zeros((runs, 3)), np.zeros((runs, 6)), np.full(runs, 8.0)
    angles[:, 2] = rng.uniform(-3, 3, runs)
    acting, push = np.zeros((runs, 6)), np.zeros((runs, 3))
    out = np.empty((runs, n, 10))

    def rate(angles, nu, tau):
        R = rotations(angles)
        still = np.einsum("rji,rj->ri", R, current)  # the water's velocity, body frame
        rel = nu - np.concatenate([still, 0 * still], 1)
        omega = nu[:, 3:]
        p_rb, p_a = nu @ M_rb, rel @ TRUE["added_mass"]

        def gyric(p, v):
            return np.concatenate([np.cross(omega, p[:, :3]), np.cross(omega, p[:, 3:]) + np.cross(v, p[:, :3])], 1)

        drag = rel * (TRUE["linear"] + TRUE["quadratic"] * np.abs(rel))
        down = R[:, 2]
        g = np.concatenate([
            (WEIGHT - TRUE["buoyancy"]) * down, np.cross(TRUE["r_B"], -TRUE["buoyancy"] * down)
        ], 1)  # fmt: skip
        still_rate = -np.cross(omega, still)
        force = tau - gyric(p_rb, nu[:, :3]) - gyric(p_a, rel[:, :3]) - drag + g
        force += np.concatenate([still_rate, 0 * still_rate], 1) @ TRUE["added_mass"]
        (cr, cp, _), (sr, sp, _) = np.cos(angles).T, np.sin(angles).T
        p, q, r = omega.T
        turn = np.stack([p + sp / cp * (q * sr + r * cr), q * cr - r * sr, (q * sr + r * cr) / cp], -1)
        return turn, force @ inverse, np.einsum("ri,ri->r", R[:, 2], nu[:, :3])

    for k in range(n):
        out[:, k] = np.concatenate([angles, nu, depth[:, None]], 1)
        late = int((k * STEP - TRUE["delay"]) * 50)
        target = wrench[:, max(late, 0)] * (late >= 0)
        acting += (target - acting) * (1 - np.exp(-STEP / TRUE["lag"]))
        push += -push * STEP / 3.0 + disturbance * np.sqrt(2 * STEP / 3.0) * rng.standard_normal((runs, 3))
        tau = acting + TRUE["trim"] + np.concatenate([push, 0 * push], 1)
        a = rate(angles, nu, tau)
        b = rate(angles + STEP / 2 * a[0], nu + STEP / 2 * a[1], tau)
        c = rate(angles + STEP / 2 * b[0], nu + STEP / 2 * b[1], tau)
        d = rate(angles + STEP * c[0], nu + STEP * c[1], tau)
        angles, nu, depth = (
            x + STEP / 6 * (p + 2 * q + 2 * r + s)
            for x, p, q, r, s in zip((angles, nu, depth), a, b, c, d, strict=True)
        )
    return out, wrench


def write_pairs(folder, seed=0, runs=16, seconds=60.0, noise=0.012, disturbance=0.8, dirty=True):
    """Write the tables of runs as ``run-K-wrench.csv`` and ``run-K-nav.csv``, and ``map.toml``."""
    rng = np.random.default_rng(seed)
    states, wrench = simulate(rng, runs, seconds, disturbance)
    for run in range(runs):
        begin = 1.7e9 + 1000.0 * run
        times = np.arange(wrench.shape[1]) / 50.0
        pd.DataFrame(wrench[run], columns=[*"XYZKMN"]).assign(time=begin + times).to_csv(
            folder / f"run-{run:02d}-wrench.csv", index=False, float_format="%.4f"
        )
        sampled = np.cumsum(rng.uniform(0.09, 0.135, int(seconds / 0.09)))
        sampled = sampled[sampled < seconds - 0.02]
        x = states[run, (sampled / STEP).astype(int)].copy()
        x[:, :3] += 0.004 * rng.standard_normal((len(x), 3))
        x[:, 3:6] += noise * rng.standard_normal((len(x), 3))
        x[:, 9] += 0.01 * rng.standard_normal(len(x))
        held = np.maximum(np.searchsorted(sampled, times, "right") - 1, 0) if dirty else None
        rows = x[held] if dirty else x
        came = times if dirty else sampled
        if dirty:  # the link lets rows through some at once, and repeats some
            came = times + 0.002 * rng.random(len(times))
            for start in range(40, len(times) - 30, 130):
                size = int(rng.integers(5, 25))
                came[start : start + size] = came[start + size] + 1e-4 * np.arange(size) - 1e-4 * size
            again = np.sort(np.concatenate([np.arange(len(came)), rng.integers(0, len(came), len(came) // 10)]))
            came, rows = came[again], rows[again]
        pd.DataFrame({
            "time": begin + came, "yaw": np.remainder(rows[:, 2] + np.pi, 2 * np.pi) - np.pi,
            "pitch": rows[:, 1], "roll": rows[:, 0], "u": rows[:, 3],
            "v": rows[:, 4], "w": rows[:, 5], "depth": rows[:, 9],
        }).to_csv(folder / f"run-{run:02d}-nav.csv", index=False, float_format="%.5f")  # fmt: skip
    (folder / "map.toml").write_text(MAP)
    return states
