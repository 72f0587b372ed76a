"""The plant once more, from the books in matrix form, by variable names: what the FMU is compared with.

It takes complex numbers, so that complex steps give its derivatives to rounding: f(x + ih) = f(x) + ih f'(x).
"""

import numpy as np

from plant_fmu.t200 import FORCES as T200_FORCES
from plant_fmu.t200 import PULSES, RPM, VOLTAGES

AXES, VELOCITIES, FORCES = "xyz", "uvwpqr", "XYZKMN"
TURN = 2 * np.pi


def magnitude(x):
    return x if np.real(x) >= 0 else -x


def clip(x, low, high):
    return low if np.real(x) < np.real(low) else high if np.real(x) > np.real(high) else x


def norm(x):
    return np.sqrt(np.sum(x * x))


def skew(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def vector(v, prefix, parts=AXES):
    return np.array([v[f"{prefix}.{part}"] for part in parts])


def coriolis(M, nu):
    """From the parametrization theorem (Fossen 2011, 3.46)."""
    a, b = (M @ nu)[:3], (M @ nu)[3:]
    return np.block([[np.zeros((3, 3)), -skew(a)], [-skew(a), -skew(b)]])


def rotation(e):
    e0, e1, e2, e3 = e / norm(e)
    return np.array([
        [1 - 2 * (e2 * e2 + e3 * e3), 2 * (e1 * e2 - e0 * e3), 2 * (e1 * e3 + e0 * e2)],
        [2 * (e1 * e2 + e0 * e3), 1 - 2 * (e1 * e1 + e3 * e3), 2 * (e2 * e3 - e0 * e1)],
        [2 * (e1 * e3 - e0 * e2), 2 * (e2 * e3 + e0 * e1), 1 - 2 * (e1 * e1 + e2 * e2)],
    ])  # fmt: skip


def angle(y, x):
    """atan2 for complex numbers."""
    return np.arctan2(np.real(y), np.real(x)) + 1j * np.imag(y * np.real(x) - x * np.real(y)) / np.real(x * x + y * y)


def mass_matrices(v):
    names = {("x", "x"): "xx", ("y", "y"): "yy", ("z", "z"): "zz", ("x", "y"): "xy", ("x", "z"): "xz", ("y", "z"): "yz"}
    inertia = np.array([[v[f"inertia.{names.get((a, b)) or names[b, a]}"] for b in AXES] for a in AXES])
    m, S = v["mass"], skew(vector(v, "r_G"))
    rigid = np.block([[m * np.eye(3), -m * S], [m * S, inertia]])
    added = np.array([[v[f"added_mass[{min(i, j)},{max(i, j)}]"] for j in range(1, 7)] for i in range(1, 7)])
    return rigid, added


def t200_force(command, voltage, commands):
    """Force [N] at a pulse [us] or revolutions [rev/min]; `commands` has a row of points for each voltage."""
    row = int(np.clip((np.real(voltage) - VOLTAGES[0]) // 2.0, 0, len(VOLTAGES) - 2))
    blend = (voltage - VOLTAGES[row]) / 2.0  # a point keeps its command and its force together between voltages
    xs, ys = (table[row] + blend * (table[row + 1] - table[row]) for table in (commands, T200_FORCES))
    i = int(np.clip(np.searchsorted(np.real(xs), np.real(command)) - 1, 0, len(xs) - 2))
    return ys[i] + clip((command - xs[i]) / (xs[i + 1] - xs[i]), 0, 1) * (ys[i + 1] - ys[i])


PULSE_ROWS = np.tile(PULSES, (len(VOLTAGES), 1))


def commanded_thrust(v, i):
    command = v[f"thrust[{i}]"]
    if f"thrust_pulse[{i}]" not in v:
        return command
    share, pulse = v[f"thrust_normalized[{i}]"], v[f"thrust_pulse[{i}]"]
    command = command + share * (v[f"thrust_max[{i}]"] if np.real(share) > 0 else -v[f"thrust_min[{i}]"])
    command = command + (t200_force(pulse, v["supply_voltage"], PULSE_ROWS) if np.real(pulse) > 0 else 0)
    return command + t200_force(v[f"thrust_rpm[{i}]"], v["supply_voltage"], RPM)


def external_wrench(v, R):
    """Wrench of the coupling inputs in body axes; 0 for a plant that has none."""
    total = np.zeros(6)
    for frame, to_body in (("world", R.T), ("body", np.eye(3))):
        if f"load.{frame}.force.x" in v:
            force, moment = (to_body @ vector(v, f"load.{frame}.{kind}") for kind in ("force", "moment"))
            total = total + np.r_[force, moment + np.cross(vector(v, f"load.{frame}.point"), force)]
    return total


def steady_thrust(v, i):
    low, high = v[f"thrust_min[{i}]"], v[f"thrust_max[{i}]"]
    command = clip(commanded_thrust(v, i), low, high)
    limit = high if np.real(command) > 0 else low
    dead, curve = v[f"thrust_dead_band[{i}]"], v[f"thrust_curve[{i}]"]
    live = (command / limit - dead) / (1 - dead)
    return limit * ((1 - curve) * live + curve * live**2) if np.real(live) > 0 else 0


def steady_wrench(v):
    w = np.array([v[f"wrench.{a}"] for a in FORCES], dtype=complex)
    force = norm(w[:3])
    if np.real(force) > np.real(v["wrench_force_limit"]):
        w[:3] = w[:3] * v["wrench_force_limit"] / force
    return w


def lagging(present, target, T, limit=0):
    """Rate and present force of an actuator."""
    if np.real(limit) > 0 and np.real(T) < 1e-3:
        T = 1e-3
    if np.real(T) == 0:
        return 0, target
    rate = (target - present) / T
    return (clip(rate, -limit, limit) if np.real(limit) > 0 else rate), present


def contact(v, M, depth, velocity_world):
    inverse = np.linalg.inv(M)[:3, :3]
    rows = [sum(magnitude(x) for x in row) for row in inverse]
    m = 1 / max(rows, key=np.real)
    T = (
        v["bottom_time_constant"]
        if np.real(v["bottom_time_constant"]) >= 4 * np.real(v["substep"])
        else 4 * v["substep"]
    )
    x, u = depth + v["hull_radius"] - v["bottom_depth"], velocity_world[2]
    if np.real(x) <= 0:
        return np.zeros(3)
    x1 = 4 * T if np.real(4 * T) >= np.real(50 * T**2) else 50 * T**2  # where the spring gives half
    normal = m * (x / (1 + x / x1) / T**2 + 2 / T * u * x / (x + T * magnitude(u) / 2))
    normal = normal if np.real(normal) > 0 else 0
    speed = np.sqrt(velocity_world[0] ** 2 + velocity_world[1] ** 2 + 0.01**2)
    drag = v["bottom_friction"] * normal / speed
    drag = drag if np.real(drag) < np.real(m / T) else m / T
    return np.array([-drag * velocity_world[0], -drag * velocity_world[1], -normal])


def evaluate(v, n_thrusters, drift=(0, 0, 0), drift_slope=(0, 0, 0)):
    """Return all calculated variables of continuous sensors by name; `drift` is the current's variation now."""
    out = {}
    forces = []
    if "current_input.x" in v:
        drift, drift_slope = (np.array(a) + vector(v, b) for a, b in
                              ((drift, "current_input"), (drift_slope, "current_input_rate")))  # fmt: skip
    for i in range(1, n_thrusters + 1):
        lag = v[f"thrust_time_constant[{i}]"], v[f"thrust_rate_limit[{i}]"]
        rate, force = lagging(v[f"actuator.thrust[{i}]"], steady_thrust(v, i), *lag)
        out[f"der(actuator.thrust[{i}])"] = rate
        forces.append(force * v[f"thrust_effectiveness[{i}]"] * (1 - v.get(f"thrust_failure[{i}]", 0)))
        out[f"thruster_force[{i}]"] = forces[-1]
    tau = []
    for i, (name, target) in enumerate(zip(FORCES, steady_wrench(v), strict=True), 1):
        rate, present = lagging(v[f"actuator.wrench.{name}"], target, v["wrench_time_constant"])
        out[f"der(actuator.wrench.{name})"] = rate
        push = sum(v[f"thruster_matrix[{i},{j}]"] * f for j, f in enumerate(forces, 1))
        tau.append(present + push)
        out[f"actuation.{name}"] = tau[-1]

    e, nu = np.array([v[f"quaternion.e{i}"] for i in range(4)]), vector(v, "velocity", VELOCITIES)
    R, omega, depth = rotation(e), nu[3:], v["position.z"]
    velocity_world = R @ nu[:3]
    e_rate = 0.5 * np.r_[-e[1:] @ omega, e[0] * omega + np.cross(e[1:], omega)]
    out |= {f"der(position.{a})": x for a, x in zip(AXES, velocity_world, strict=True)}
    out |= {f"der(quaternion.e{i})": x for i, x in enumerate(e_rate)}

    under = np.real(depth) > 0
    water = vector(v, "current") + np.array(drift) + (vector(v, "current_shear") * depth if under else 0)
    water_rate = np.array(drift_slope) + (vector(v, "current_shear") * velocity_world[2] if under else 0)
    out |= {f"water_velocity.{a}": x for a, x in zip(AXES, water, strict=True)}
    nu_c = np.r_[R.T @ water, np.zeros(3)]
    nu_c_rate = np.r_[R.T @ water_rate - np.cross(omega, R.T @ water), np.zeros(3)]
    nu_r = nu - nu_c

    M_RB, M_A = mass_matrices(v)
    damping = [v[f"linear_damping[{i}]"] + v[f"quadratic_damping[{i}]"] * magnitude(x) for i, x in enumerate(nu_r, 1)]
    submerged, r = 1, v["hull_radius"]
    k = R.T @ np.array([0, 0, 1])
    if v["free_surface"]:
        h = clip(depth + k @ vector(v, "r_B") + r, 0, 2 * r)
        submerged = h * h * (3 * r - h) / (4 * r**3)  # a spherical cap
    W, B = v["weight"], v["buoyancy"] * submerged
    g = -np.r_[(W - B) * k, np.cross(vector(v, "r_G") * W - vector(v, "r_B") * B, k)]
    bottom = np.r_[R.T @ contact(v, M_RB + M_A, depth, velocity_world), np.zeros(3)]
    force = np.array(tau) - coriolis(M_RB, nu) @ nu - coriolis(M_A, nu_r) @ nu_r - damping * nu_r - g
    force = force + vector(v, "trim", FORCES) + bottom + external_wrench(v, R)
    nu_rate = np.linalg.solve(M_RB + M_A, force + M_A @ nu_c_rate)
    out |= {f"der(velocity.{a})": x for a, x in zip(VELOCITIES, nu_rate, strict=True)}

    roll, yaw = angle(R[2, 1], R[2, 2]), angle(R[1, 0], R[0, 0])
    out |= {"attitude.roll": roll, "attitude.pitch": -np.arcsin(R[2, 0]), "attitude.yaw": yaw}
    out["altitude"] = v["bottom_depth"] - depth
    specific = nu_rate[:3] + np.cross(omega, nu[:3]) - v["gravity"] * k
    out["measured.depth"] = depth + v["depth_sensor.bias"]
    out["measured.altitude"] = out["altitude"]
    heading = yaw + v["compass.bias"]
    out["measured.heading"] = heading - TURN * np.round(np.real(heading) / TURN)
    for i, a in enumerate(AXES):
        out[f"measured.velocity.{'uvw'[i]}"] = (1 + v["dvl.scale_error"]) * (
            nu[:3] + np.cross(omega, vector(v, "dvl.position"))
        )[i]
        out[f"measured.acceleration.{a}"] = specific[i] + v[f"imu.acceleration_bias.{a}"]
        rate = "pqr"[i]
        out[f"measured.angular_velocity.{rate}"] = omega[i] + v[f"imu.angular_velocity_bias.{rate}"]
        out[f"measured.position.{a}"] = v[f"position.{a}"]
    sensors = ("depth_sensor", "dvl", "imu", "compass", "usbl")
    return out | {f"measured.time.{sensor}": v.get("time", 0.0) for sensor in sensors}


def flags(v, n_thrusters):
    """Return all Boolean outputs by name."""
    low_high = [(v[f"thrust_min[{i}]"], v[f"thrust_max[{i}]"]) for i in range(1, n_thrusters + 1)]
    saturated = [not low <= commanded_thrust(v, i) <= high for i, (low, high) in enumerate(low_high, 1)]
    return {f"thrust_saturated[{i}]": flag for i, flag in enumerate(saturated, 1)} | {
        "wrench_saturated": norm(vector(v, "wrench", FORCES[:3])) > v["wrench_force_limit"],
        "bottom_contact": v["position.z"] + v["hull_radius"] > v["bottom_depth"],
    }
