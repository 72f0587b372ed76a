"""The one table of the FMU's variables: modelDescription.xml, the C header and the docs page are all made from it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from plant_fmu import quantities as q
from plant_fmu.errors import VehicleError
from plant_fmu.quantities import Quantity
from plant_fmu.variables.coupling import coupling_inputs, coupling_parameters
from plant_fmu.variables.variable import AXES, FORCES, SENSORS, VELOCITIES, Variable
from plant_fmu.vehicle import Vehicle


def variables(vehicle: Vehicle, coupled: bool = False) -> list[Variable]:
    """Return every variable of a vehicle's FMU; the index in this list is the value reference."""
    rows = [
        Variable("time", "time", "time", q.TIME, "Simulated time"),
        *_states(vehicle),
        *_inputs(vehicle),
        *(coupling_inputs(vehicle) if coupled else ()),
        *_outputs(vehicle),
        *_derivatives(vehicle),
        *_parameters(vehicle),
        *_environment(vehicle),
        *_sensors(vehicle),
        *(coupling_parameters() if coupled else ()),
        *_discrete(vehicle),
    ]
    for v in rows:
        if not v.quantity.minimum <= v.start <= v.quantity.maximum:
            minimum, maximum = v.quantity.minimum, v.quantity.maximum
            raise VehicleError(
                f"{vehicle.name}: {v.name} is {v.start:g} {v.quantity.unit}, expected {minimum:g} to {maximum:g}"
            )
    names = [v.name for v in rows if v.role in ("time", "state", "input", "parameter")]
    depends = {patterns: _expand(patterns, names) for patterns in {v.depends for v in rows}}  # many have the same
    return [replace(v, depends=depends[v.depends]) for v in rows]


def _expand(patterns: tuple[str, ...], names: list[str]) -> tuple[str, ...]:
    """Return the names that match the patterns, in the order of the table."""
    exact = {pattern for pattern in patterns if not pattern.endswith("*")}
    beginnings = tuple(pattern[:-1] for pattern in patterns if pattern.endswith("*"))
    return tuple(name for name in names if name in exact or (beginnings and name.startswith(beginnings)))


def _axis_text(i: int) -> str:
    """Describe the body axis along or about which component `i` of a velocity or a wrench is."""
    return f"{'along' if i < 3 else 'about'} body {AXES[i % 3]}"


# ---- states and inputs ----


def _states(vehicle: Vehicle) -> Iterator[Variable]:
    for i, where in enumerate(("north", "east", "down (depth)")):
        description = f"Position of the body origin, {where}, world frame NED"
        yield Variable(f"position.{AXES[i]}", "state", f"state.rigid[{i}]", q.LENGTH, description)
    for i, part in enumerate(("scalar part", "vector part x", "vector part y", "vector part z")):
        description = f"Attitude as unit quaternion from body to world, {part} (normalized when initialization ends)"
        start = 1.0 if i == 0 else 0.0
        yield Variable(f"quaternion.e{i}", "state", f"state.rigid[{3 + i}]", q.QUATERNION, description, start)
    for i, name in enumerate(VELOCITIES):
        kind, quantity = ("Velocity over ground", q.SPEED) if i < 3 else ("Angular velocity", q.ANGULAR_SPEED)
        yield Variable(f"velocity.{name}", "state", f"state.rigid[{7 + i}]", quantity, f"{kind} {_axis_text(i)}")
    unlagged = "without a lag equal to its command, updated at initialization and events"
    for i in range(vehicle.n_thrusters):
        description = f"Force of thruster {i + 1} after its lag, before its effectiveness; {unlagged}"
        member = f"state.actuators.thrust[{i}]"
        yield Variable(f"actuator.thrust[{i + 1}]", "state", member, q.FORCE, description, local=True)
    for i, name in enumerate(FORCES):
        description = f"Wrench input's component {name} after its lag; {unlagged}"
        member, quantity = f"state.actuators.wrench[{i}]", q.FORCE if i < 3 else q.MOMENT
        yield Variable(f"actuator.wrench.{name}", "state", member, quantity, description, local=True)


def _inputs(vehicle: Vehicle) -> Iterator[Variable]:
    for i in range(vehicle.n_thrusters):
        description = f"Commanded force of thruster {i + 1}, clipped to its limits"
        yield Variable(f"thrust[{i + 1}]", "input", f"inputs.thrust[{i}]", q.FORCE, description)
    for i, name in enumerate(FORCES):
        kind, quantity = ("force", q.FORCE) if i < 3 else ("moment", q.MOMENT)
        description = f"Commanded {kind} on the body {_axis_text(i)}, in addition to the thrusters"
        yield Variable(f"wrench.{name}", "input", f"inputs.wrench[{i}]", quantity, description)


# ---- outputs and derivatives ----

_THRUSTER = (
    "thrust", "thrust_min", "thrust_max", "thrust_dead_band", "thrust_curve", "thrust_time_constant",
    "thrust_normalized", "thrust_pulse", "thrust_rpm",
)  # fmt: skip
_WRENCH = ("wrench.X", "wrench.Y", "wrench.Z", "wrench_force_limit", "wrench_time_constant")
_RANDOM = ("seed", "outlier_scale")
_WATER = ("time", "position.z", "current*", "seed")
_BOTTOM = ("position.z", "bottom_depth")
_MOTION = (
    "time", "position.z", "quaternion.*", "velocity.*", "actuator.*", "thrust*", "wrench*", "mass", "inertia.*",
    "r_G.*", "r_B.*", "weight", "buoyancy", "trim.*", "added_mass*", "linear_damping*", "quadratic_damping*",
    "current*", "seed", "free_surface", "hull_radius", "bottom_*", "substep", "load.*", "supply_voltage",
)  # fmt: skip


def _thruster_names(i: int, *names: str) -> tuple[str, ...]:
    return tuple(f"{name}[{i + 1}]" for name in names)


def _wrench_names(i: int, *more: str) -> tuple[str, ...]:
    own = _WRENCH if i < 3 else (f"wrench.{FORCES[i]}", "wrench_time_constant")
    return (*own, f"actuator.wrench.{FORCES[i]}", *more)


def _outputs(vehicle: Vehicle) -> Iterator[Variable]:
    def output(name: str, member: str, quantity: Quantity, description: str, *depends: str) -> Variable:
        return Variable(name, "output", f"outputs.{member}", quantity, description, depends=depends)

    for i, (name, quantity) in enumerate((("roll", q.HALF_TURN), ("pitch", q.QUARTER_TURN), ("yaw", q.HALF_TURN))):
        yield output(f"attitude.{name}", f"euler[{i}]", quantity, f"Euler angle {name} (zyx)", "quaternion.*")
    for i, where in enumerate(("north", "east", "down")):
        description = f"Velocity of the water at the vehicle, {where}"
        yield output(f"water_velocity.{AXES[i]}", f"water[{i}]", q.unbounded("m/s"), description, *_WATER)
    yield output("altitude", "altitude", q.unbounded("m"), "Height of the body origin above the bottom", *_BOTTOM)
    yield from _measured(output)
    for i in range(vehicle.n_thrusters):
        description = f"Present force of thruster {i + 1}"
        depends = (
            *_thruster_names(i, *_THRUSTER, "thrust_rate_limit", "thrust_effectiveness", "thrust_failure"),
            "supply_voltage",
            f"actuator.thrust[{i + 1}]",
        )
        yield output(f"thruster_force[{i + 1}]", f"thrust[{i}]", q.FORCE, description, *depends)
    for i, name in enumerate(FORCES):
        kind, quantity = ("Force", q.ALL_FORCES) if i < 3 else ("Moment", q.ALL_MOMENTS)
        thruster_names = (f"thruster_matrix[{i + 1},*", "thrust[*", "thrust_*", "actuator.thrust*", "supply_voltage")
        description = f"{kind} of all actuators on the body {_axis_text(i)}"
        yield output(f"actuation.{name}", f"wrench[{i}]", quantity, description, *_wrench_names(i, *thruster_names))


def _measured(output: Callable[..., Variable]) -> Iterator[Variable]:
    def measured(name: str, unit: str, description: str, sensor: str, *depends: str) -> Variable:
        member = f"measured[{len(channels)}]"
        channels.append(name)
        depends = (f"{sensor}.*", *_RANDOM, *depends)
        row = output(f"measured.{name}", member, q.unbounded(unit), description, *depends)
        return replace(row, clock=f"{sensor}.clock")

    channels: list[str] = []
    yield measured("depth", "m", "Depth from the pressure sensor", "depth_sensor", "position.z")
    for name in VELOCITIES[:3]:
        description = f"DVL's velocity over ground {_axis_text(VELOCITIES.index(name))}"
        yield measured(f"velocity.{name}", "m/s", description, "dvl", f"velocity.{name}")
    yield measured("altitude", "m", "DVL's height above the bottom", "dvl", *_BOTTOM)
    for i, axis in enumerate(AXES):
        description = f"IMU's specific force (acceleration less gravity) {_axis_text(i)}"
        yield measured(f"acceleration.{axis}", "m/s2", description, "imu", "gravity", "thruster_matrix*", *_MOTION)
    for i, name in enumerate(VELOCITIES[3:]):
        description = f"IMU's angular velocity {_axis_text(3 + i)}"
        yield measured(f"angular_velocity.{name}", "rad/s", description, "imu", f"velocity.{name}")
    yield measured("heading", "rad", "Compass heading, that of yaw", "compass", "quaternion.*")
    for i, where in enumerate(("north", "east", "down")):
        yield measured(f"position.{AXES[i]}", "m", f"USBL's position, {where}", "usbl", f"position.{AXES[i]}")
    for i, (sensor, what) in enumerate(SENSORS):
        description = f"Time of the last sample of {what}; -1e12 before the first"
        stamp = output(
            f"measured.time.{sensor}", f"stamp[{i}]", q.unbounded("s"), description, f"{sensor}.rate", "time"
        )
        yield replace(stamp, clock=f"{sensor}.clock")


def _derivatives(vehicle: Vehicle) -> Iterator[Variable]:
    for state in _states(vehicle):
        name = state.name
        kind, _, part = name.partition(".")
        if kind == "position":
            depends: tuple[str, ...] = ("quaternion.*", "velocity.u", "velocity.v", "velocity.w")
        elif kind == "quaternion":
            depends = ("quaternion.*", "velocity.p", "velocity.q", "velocity.r")
        elif kind == "velocity":
            depends = _MOTION
        elif part.startswith("thrust"):
            i = int(part.removeprefix("thrust[").removesuffix("]")) - 1
            depends = (*_thruster_names(i, *_THRUSTER, "thrust_rate_limit"), "supply_voltage", name)
        else:
            depends = _wrench_names(FORCES.index(part[-1]))
        member = state.member.replace("state.", "outputs.rate.", 1)
        quantity = q.unbounded(q.rate_unit(state.quantity.unit), state.quantity.nominal)
        yield Variable(f"der({name})", "derivative", member, quantity, f"Time derivative of {name}", depends=depends)


# ---- parameters ----


def _parameter(name: str, member: str, quantity: Quantity, description: str, start: float = 0.0) -> Variable:
    return Variable(name, "parameter", f"plant.parameters.{member}", quantity, description, float(start))


def _parameters(vehicle: Vehicle) -> Iterator[Variable]:
    yield _parameter("mass", "mass", q.MASS, "Mass in air", vehicle.mass)
    for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        name, description = f"inertia.{AXES[i]}{AXES[j]}", f"Inertia about the origin, element ({i + 1},{j + 1})"
        yield _parameter(name, f"inertia[{k}]", q.inertial("kg.m2", i == j), description, vehicle.inertia[i, j])
    for name, what, values in (("r_G", "gravity", vehicle.r_G), ("r_B", "buoyancy", vehicle.r_B)):
        for i, axis in enumerate(AXES):
            yield _parameter(f"{name}.{axis}", f"{name}[{i}]", q.LEVER, f"Center of {what}, body {axis}", values[i])
    yield _parameter("weight", "weight", q.WEIGHT, "Weight", vehicle.weight)
    yield _parameter("buoyancy", "buoyancy", q.WEIGHT, "Buoyancy", vehicle.buoyancy)
    for i, name in enumerate(FORCES):
        kind, quantity = ("force", q.FORCE) if i < 3 else ("moment", q.MOMENT)
        description = f"Constant {kind} on the body {_axis_text(i)}"
        yield _parameter(f"trim.{name}", f"trim[{i}]", quantity, description, vehicle.trim[i])

    for i in range(6):
        for j in range(i, 6):
            quantity = q.inertial(("kg", "kg.m", "kg.m2")[(i > 2) + (j > 2)], i == j)
            mirrored = f", and by symmetry ({j + 1},{i + 1})" if i != j else ""
            name, description = f"added_mass[{i + 1},{j + 1}]", f"Added mass ({i + 1},{j + 1}){mirrored}"
            yield _parameter(name, f"added_mass[{i}][{j}]", quantity, description, vehicle.added_mass[i, j])
    for kind, units, values in (
        ("linear", ("N.s/m", "N.m.s/rad"), vehicle.linear_damping),
        ("quadratic", ("N.s2/m2", "N.m.s2/rad2"), vehicle.quadratic_damping),
    ):
        for i, velocity in enumerate(VELOCITIES):
            name, quantity = f"{kind}_damping[{i + 1}]", Quantity(units[i > 2], 0.0, 1e9)
            description = f"{kind.capitalize()} damping of {velocity}"
            yield _parameter(name, f"{kind}_damping[{i}]", quantity, description, values[i])

    for i, force in enumerate(FORCES):
        quantity = Quantity("" if i < 3 else "N.m/N", -1e3, 1e3)
        for j in range(vehicle.n_thrusters):
            name, member = f"thruster_matrix[{i + 1},{j + 1}]", f"thruster_matrix[{i}][{j}]"
            description = f"{force} on the body per newton of thruster {j + 1}"
            yield _parameter(name, member, quantity, description, vehicle.thruster_matrix[i, j])
    for i in range(vehicle.n_thrusters):
        for name, quantity, what in (
            ("min", q.FORCE, "Most negative force of thruster {}"),
            ("max", q.FORCE, "Maximum force of thruster {}"),
            ("time_constant", q.TIME_CONSTANT, "Lag of thruster {}, 0 for none"),
            ("rate_limit", q.FORCE_RATE, "Rate limit of thruster {}'s force, 0 for none"),
            ("dead_band", q.DEAD_BAND, "Dead band of thruster {}, as a fraction of its range"),
            ("curve", q.FRACTION, "Force of thruster {}: 0 linear in its command, 1 quadratic"),
            ("effectiveness", q.FRACTION, "Effectiveness of thruster {}: 1 full, 0 failed"),
        ):
            name = f"thrust_{name}"
            start = getattr(vehicle, name)[i] if name != "thrust_effectiveness" else 1.0
            yield _parameter(f"{name}[{i + 1}]", f"{name}[{i}]", quantity, what.format(i + 1), start)

    description = "Limit on the norm of the wrench input's force, which keeps its direction; the moment has none"
    yield _parameter("wrench_force_limit", "wrench_force_limit", q.FORCE_LIMIT, description, q.FORCE_LIMIT.maximum)
    description = "Lag of the wrench input, after its limit, 0 for none"
    yield _parameter("wrench_time_constant", "wrench_time_constant", q.TIME_CONSTANT, description, 0.0)
    yield _parameter("substep", "substep", q.SUBSTEP, "Maximum integration step (co-simulation)", 0.005)


def _environment(vehicle: Vehicle) -> Iterator[Variable]:
    for name, quantity, what in (
        ("current", q.CURRENT, "Velocity of the water at the surface, {}"),
        ("current_shear", q.SHEAR, "Shear of the current with depth, {}"),
        ("current_variation", q.CURRENT_DEVIATION, "Standard deviation of the current's Gauss-Markov part, {}"),
    ):
        for i, where in enumerate(("north", "east", "down")):
            yield _parameter(f"{name}.{AXES[i]}", f"{name}[{i}]", quantity, what.format(where))
    for name, quantity, description, start in (
        ("current_correlation_time", q.LONG_TIME, "Correlation time of the current's Gauss-Markov part", 60.0),
        ("current_variation_period", q.LONG_TIME, "Time between knots of that part, linear between them", 1.0),
        ("hull_radius", q.RADIUS,
         "Radius of the sphere that touches the surface (about r_B) and the bottom (about the origin)",
         vehicle.hull_radius),
        ("bottom_depth", q.LENGTH, "Depth of the flat bottom; the maximum for none", q.LENGTH.maximum),
        ("bottom_friction", q.FRICTION, "Coulomb's friction coefficient of the bottom, viscous below 1 cm/s", 0.4),
        ("bottom_time_constant", q.TIME_CONSTANT, "Time constant of contact with the bottom, at least 4 substeps",
         0.02),
        ("gravity", q.GRAVITY, "Gravity that the IMU senses", 9.81),
    ):  # fmt: skip
        yield _parameter(name, name, quantity, description, start)


def _sensors(vehicle: Vehicle) -> Iterator[Variable]:
    for i, (sensor, what) in enumerate(SENSORS):
        description = f"Sample rate of {what}; 0: continuous, without noise"
        yield _parameter(f"{sensor}.rate", f"sensor_rate[{i}]", q.SAMPLE_RATE, description)
        yield _parameter(f"{sensor}.delay", f"delay[{i}]", q.DELAY, "Time from a sample to its delivery")
        for event, description in (("loss", "is lost"), ("outlier", "is an outlier")):
            name, member = f"{sensor}.{event}_probability", f"{event}_probability[{i}]"
            yield _parameter(name, member, q.FRACTION, f"Probability that a sample {description}")
    description = "Standard deviation of an outlier, as a multiple of that of the noise"
    yield _parameter("outlier_scale", "outlier_scale", q.SCALE, description, 20.0)
    for i, (name, unit) in enumerate((
        ("depth_sensor.noise", "m"), ("dvl.velocity_noise", "m/s"), ("dvl.altitude_noise", "m"),
        ("imu.acceleration_noise", "m/s2"), ("imu.angular_velocity_noise", "rad/s"), ("compass.noise", "rad"),
        ("usbl.noise", "m"),
    )):  # fmt: skip
        yield _parameter(name, f"noise[{i}]", q.deviation(unit), "Standard deviation of each sample's noise")
    for name, channel, unit in (
        ("depth_sensor.bias", "MEASURED_DEPTH", "m"),
        *((f"imu.acceleration_bias.{axis}", f"MEASURED_ACCELERATION + {i}", "m/s2") for i, axis in enumerate(AXES)),
        *(
            (f"imu.angular_velocity_bias.{name}", f"MEASURED_ANGULAR_VELOCITY + {i}", "rad/s")
            for i, name in enumerate(VELOCITIES[3:])
        ),
        ("compass.bias", "MEASURED_HEADING", "rad"),
    ):
        yield _parameter(name, f"bias[{channel}]", q.bias(unit), "Constant error")
    for i, axis in enumerate(AXES):
        yield _parameter(
            f"dvl.position.{axis}", f"r_DVL[{i}]", q.LEVER, f"Position of the DVL, body {axis}", vehicle.dvl_position[i]
        )
    description = "Scale error of the DVL, as a fraction of the velocity"
    yield _parameter("dvl.scale_error", "velocity_scale_error", q.SCALE_ERROR, description)


def _discrete(vehicle: Vehicle) -> Iterator[Variable]:
    """Yield the integers, then the Booleans."""
    description = "Seed of all noise and of the current's variation"
    yield replace(_parameter("seed", "seed", q.SEED, description), type="integer")
    description = "Buoyancy fades as the hull leaves the water at depth 0"
    yield replace(_parameter("free_surface", "free_surface", q.FLAG, description), type="boolean")

    def flag(name: str, member: str, description: str, *depends: str) -> Variable:
        return Variable(name, "output", f"outputs.{member}", q.FLAG, description, depends=depends, type="boolean")

    for i in range(vehicle.n_thrusters):
        description = f"The command of thruster {i + 1} is beyond its limits"
        yield flag(
            f"thrust_saturated[{i + 1}]", f"flags.thrust_saturated[{i}]", description,
            *_thruster_names(i, *_THRUSTER[:3], *_THRUSTER[-3:]), "supply_voltage",
        )  # fmt: skip
    description = "The force of the wrench input is beyond its limit"
    yield flag("wrench_saturated", "flags.wrench_saturated", description, *_WRENCH[:4])
    yield flag("bottom_contact", "flags.bottom_touched", "The hull touches the bottom", *_BOTTOM, "hull_radius")
