"""Stick inputs that make a vehicle's parameters identifiable, chosen by their information within limits of space."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from cosim.errors import IdentificationError
from cosim.identification.delays import move_back, usual_delays
from cosim.identification.fit import STAGES, single_thread
from cosim.identification.log import STATES, Log, make_topic
from cosim.identification.parameters import DEFAULT_FREE, DEFAULT_NUISANCES, Parameter, free_parameters, nuisances
from cosim.identification.residuals import Residuals
from cosim.identification.windows import cut_windows
from cosim.scenario.scenario import Scenario, validate_scenario
from cosim.simulation.commands.command_handler import greatest_wrench
from cosim.simulation.commands.commands import Command, ManualControl, SetMode
from cosim.simulation.commands.sources import ScheduledCommands
from cosim.simulation.master import Master
from cosim.simulation.signals import Array
from cosim.simulation.stepped_plant import SteppedPlant
from plant_fmu.vehicle import Vehicle, load_vehicle

Box = tuple[float, float, float]  # m, sizes: north, east, down
StickMode = Literal["manual", "stabilize", "depth_hold"]
Progress = Callable[[float], None]  # receives the completed fraction

ROW = 0.05  # s, period of the record's rows and of the law
PERIOD = 0.1  # s, time between two stick values
SECONDS = 20.0  # s, duration of a segment
RETURN = 10.0  # s, time between two segments, in which the law returns the vehicle to the center of the box
BEGIN = 2.0  # s, time before the first segment
CURRENT = 0.1  # m/s, default of the current in which vehicles stay inside the box
AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
DVL_PERIOD = 0.15  # s, time between two velocities of the DVL
# standard deviations of the sensors' noise [m/s, rad/s, m, rad]
NOISE = {"velocity": 0.005, "angular_velocity": 0.002, "depth": 0.003, "attitude": 0.005}

_GROUPS: tuple[tuple[int, ...], ...] = (  # axes that move together
    (0, 1, 2, 3, 4, 5), (0, 5), (1, 5), (1, 3), (0, 4), (2, 4), (3, 4, 5), (0, 1, 2), (0,), (1,), (2,),
)  # fmt: skip
_BANDS = ((0.05, 0.5), (0.2, 1.5))  # Hz, frequency bands of the multisines
_DWELLS = ((2.0, 4.0), (0.8, 2.5))  # s, shortest and longest time for which a step is held
_MAX_SINES = 7  # sines of each axis
_YAW_RATE = 0.25  # factor on the yaw stick in modes where it commands a rate: a full stick is 202 deg/s
_MOMENT = 0.5  # factor on the sticks of roll, pitch and yaw in manual mode, where they command moments
_SEVERAL_AXES = 0.7  # factor on each stick in segments that move several axes
_STATE = (
    *(f"position.{axis}" for axis in "xyz"), *(f"quaternion.e{i}" for i in range(4)),
    *(f"velocity.{name}" for name in "uvwpqr"),
)  # fmt: skip
_SETTLE = 1.0  # s, time before a candidate segment; windows begin with the segment
_STICK_ROWS = round(PERIOD / ROW)  # rows of the record per stick value
_BOX_FRACTION = 0.7  # fraction of the box that a segment may use, with the start values of the parameters
_MAX_RATE = 2.0  # rad/s, greatest angular velocity about a body axis in a segment
_MAX_TILT = math.sin(math.radians(55.0))  # sine of the maximum tilt in a segment
_REDUCTION = 0.7  # factor on the sticks each time a segment leaves the limits
_MAX_TRIALS = 7  # simulations of a segment or schedule, each with sticks reduced by that factor
_VEHICLES = 8  # number of other vehicles for which forces are reduced, and of random ones that check the result


@dataclass(frozen=True)
class Segment:
    """A piece of stick input."""

    title: str
    mode: StickMode
    sticks: Array  # (n, 6) sticks X Y Z K M N, -1 to 1, each row held for `PERIOD`

    def scaled(self, force: float, moment: float) -> Segment:
        """Scale the sticks of the forces and of the moments; factors [-]."""
        return replace(self, sticks=self.sticks * np.repeat([force, moment], 3))


@dataclass(frozen=True)
class Rehearsal:
    """A simulated run, row by row."""

    times: Array  # (rows,) s
    states: Array  # (rows, 13) position [m, NED], quaternion, velocity [m/s, rad/s, body frame]
    thrust: Array  # (rows, thrusters) N, commanded forces

    def log(self) -> Log:
        """Return the sensors' measurements without noise, together with the standard deviations of the noise."""
        dvl = slice(None, None, max(1, round(DVL_PERIOD / float(self.times[1] - self.times[0]))))
        topics = []
        for name, noise in NOISE.items():
            rows = dvl if name == "velocity" else slice(None)
            topics.append(make_topic(name, self.times[rows], self.states[rows, STATES[name]], noise))
        return Log("rehearsal", self.times, self.thrust, np.zeros((len(self.times), 6)), tuple(topics))


@dataclass(frozen=True)
class Design:
    """A schedule of stick inputs with the accuracy and the motion that are expected of it."""

    start: str  # name of the shipped vehicle, or path of the vehicle's file
    scenario: Scenario  # scenario of the schedule, with the vehicle of `start`
    box: Box
    segments: tuple[Segment, ...]
    candidates: int  # number of candidates
    commands: tuple[tuple[int, Command], ...]  # commands with their steps
    parameters: tuple[Parameter, ...]
    deviations: Array  # (p,) expected standard deviations of the parameters, in their units
    rehearsal: Rehearsal
    current: float  # m/s, speed of the current in which the other vehicles move
    excursions: tuple[float, ...]  # maximum distance of each other vehicle from the center, in halves of the box

    @property
    def center(self) -> Array:
        """Center of the box, shape (3,) [m, NED]."""
        return np.array(self.scenario.initial.position)

    def vehicle_indices(self) -> list[int]:
        """Return the indices of the vehicle's own parameters."""
        return [i for i, p in enumerate(self.parameters) if not p.is_nuisance]


@single_thread()
def design(
    start: str, box: Box, depth: float, duration: float, free: Sequence[str] = DEFAULT_FREE,
    nuisance: Sequence[str] = DEFAULT_NUISANCES, seed: int = 0, progress: Progress = lambda fraction: None,
    current: float = CURRENT,
) -> Design:  # fmt: skip
    """Choose stick inputs that give the most information on the free parameters; depth [m], duration [s]."""
    # Units of arguments: current [m/s]
    vehicle = load_vehicle(start)
    count = math.floor((duration - BEGIN + RETURN) / (SECONDS + RETURN))
    _require_possible(box, depth, duration, current, vehicle)
    trial = excitation_scenario(start, vehicle, depth, _SETTLE + SECONDS)
    axes = greatest_wrench(vehicle) > 0.0
    candidates = list(candidate_segments(axes, np.random.default_rng(seed)))
    usable: list[tuple[Segment, Array]] = []  # with the information of each
    parameters: list[Parameter] = []
    for i, candidate in enumerate(candidates):
        progress(i / (len(candidates) + count))
        limited = _limit_segment(candidate, trial, box)
        if limited is None:
            continue
        segment, rehearsal = limited
        log = rehearsal.log()
        parameters = parameters or free_parameters(vehicle, free) + nuisances(nuisance, [log])
        matrix = information(log, vehicle, parameters)
        if matrix is not None:
            usable.append((segment, matrix))
    if not usable:
        raise IdentificationError(f"--box {box[0]:g} {box[1]:g} {box[2]:g}: is too small for any segment")
    order = choose_segments([matrix for _, matrix in usable], parameters, count)
    scenario = excitation_scenario(start, vehicle, depth, BEGIN + count * (SECONDS + RETURN) - RETURN)
    uncertain = [p for p in parameters if _is_uncertain(p)]
    directions = 2.0 * math.pi * np.arange(_VEHICLES) / _VEHICLES
    fastest = [_variant(scenario, uncertain, np.full(len(uncertain), 0.5), current, angle) for angle in directions]
    segments = keep_inside([usable[i][0] for i in order], scenario, box, fastest)
    commands = tuple(schedule(segments))
    rehearsal = rehearse(scenario, commands)
    matrix = information(rehearsal.log(), vehicle, parameters)
    if matrix is None:
        raise IdentificationError("the schedule leaves no window that can be predicted")
    covariance = np.linalg.inv(matrix + np.diag([p.deviation**-2.0 for p in parameters]))
    rng = np.random.default_rng([seed, 1])
    variants = [
        _variant(scenario, uncertain, rng.uniform(0.5, 1.5, len(uncertain)), current, rng.uniform(0.0, 2.0 * math.pi))
        for _ in range(_VEHICLES)
    ]
    excursions = tuple(
        float(excursions_of(rehearse(other, commands), scenario, box, count).max()) for other in variants
    )
    progress(1.0)
    return Design(
        start, scenario, box, segments, len(candidates), commands, tuple(parameters), np.sqrt(np.diag(covariance)),
        rehearsal, current, excursions,
    )  # fmt: skip


def _require_possible(box: Box, depth: float, duration: float, current: float, vehicle: Vehicle) -> None:
    """Refuse limits within which no segment is possible; depth [m], duration [s], current [m/s]."""
    if duration < BEGIN + SECONDS:
        raise IdentificationError(f"--time {duration:g}: is too short, expected {BEGIN + SECONDS:g} s or more")
    if depth - 0.5 * box[2] < vehicle.hull_radius:
        raise IdentificationError(
            f"--depth {depth:g}: the box of {box[2]:g} m leaves the water, expected "
            f"{0.5 * box[2] + vehicle.hull_radius:g} m or more"
        )
    max_current = 0.5 * min(box[:2]) / SECONDS
    if current > max_current:
        raise IdentificationError(
            f"--current {current:g}: carries the vehicle out of the box within a segment of {SECONDS:g} s, expected "
            f"{max_current:.2g} m/s or less, or a larger --box"
        )


# ---- candidate segments ----


def candidate_segments(axes: NDArray[np.bool_], rng: np.random.Generator) -> Iterator[Segment]:
    """Yield multisines and steps on all groups of axes, in each stick mode; axes (6,)."""
    groups = dict.fromkeys(tuple(i for i in group if axes[i]) for group in _GROUPS)
    modes: tuple[StickMode, ...] = ("manual", "stabilize", "depth_hold")
    for group in filter(None, groups):
        names = "all axes" if len(group) == len(AXES) else " and ".join(AXES[i] for i in group)
        for mode in modes:
            for low, high in _BANDS:
                values = _multisine(low, high, len(group), rng)
                yield Segment(f"{names}: multisine of {low:g} to {high:g} Hz", mode, _sticks(values, group, mode))
            for shortest, longest in _DWELLS:
                values = _steps(shortest, longest, len(group), rng)
                yield Segment(f"{names}: steps of {shortest:g} to {longest:g} s", mode, _sticks(values, group, mode))


def _sticks(values: Array, group: tuple[int, ...], mode: StickMode) -> Array:
    """Return the sticks of all axes, shape (n, 6), from those of a group, (n, axes), scaled for the mode."""
    sticks = np.zeros((len(values), 6))
    sticks[:, list(group)] = values * (1.0 if len(group) == 1 else _SEVERAL_AXES)
    if mode == "manual":
        sticks[:, 3:] *= _MOMENT
    else:
        sticks[:, 5] *= _YAW_RATE
    return sticks


def _multisine(low: float, high: float, count: int, rng: np.random.Generator) -> Array:
    """Return zero-mean sums of sines, whole periods of each, with a maximum value of 1; shape (n, count)."""
    n = round(SECONDS / PERIOD)
    turns = np.unique(np.round(np.geomspace(low, high, _MAX_SINES) * SECONDS).clip(1))
    phases = rng.uniform(0.0, 2.0 * np.pi, (len(turns), count))
    grid = np.arange(n) / n
    waves = np.sin(2.0 * np.pi * turns[:, None, None] * grid[:, None] + phases[:, None, :]).sum(axis=0)
    result: Array = waves / np.abs(waves).max(axis=0)
    return result


def _steps(shortest: float, longest: float, count: int, rng: np.random.Generator) -> Array:
    """Return steps to random levels, shape (n, count); the second half is the first with opposite sign."""
    half = round(SECONDS / PERIOD) // 2
    result = np.zeros((2 * half, count))
    for axis in range(count):
        first, sign = 0, rng.choice((-1.0, 1.0))
        while first < half:
            end = first + round(rng.uniform(shortest, longest) / PERIOD)
            result[first : min(end, half), axis] = sign * rng.choice((0.0, 0.5, 1.0, 1.0))
            first, sign = end, -sign
        result[half:, axis] = -result[:half, axis]
    return result


# ---- simulation ----


def excitation_table(vehicle: str, title: str, depth: float, duration: float) -> dict[str, Any]:
    """Return the table of the scenario in which a schedule is flown; depth [m], duration [s]."""
    return {
        "title": f"Excitation of {title}", "vehicle": vehicle, "time": {"duration": duration, "step": ROW},
        "initial": {"position": [0.0, 0.0, depth]},
        "goal": {"type": "sphere", "center": [0.0, 0.0, depth], "radius": 0.3}, "law": {"name": "deployable"},
        "actuation": {"through": "thrusters"}, "commands": {"enabled": True, "pilot_gain": 1.0},
    }  # fmt: skip


def excitation_scenario(start: str, vehicle: Vehicle, depth: float, duration: float) -> Scenario:
    """Return the scenario in which a schedule is flown; depth [m], duration [s]."""
    return validate_scenario(excitation_table(start, vehicle.name, depth, duration), "excite", vehicle)


def rehearse(
    scenario: Scenario, commands: Sequence[tuple[int, Command]], plant: SteppedPlant | None = None
) -> Rehearsal:
    """Simulate a run with scheduled commands."""
    source, rows = ScheduledCommands(commands), []
    with Master(scenario, plant=plant) as master:
        columns = [column.name for column in master.signals.columns]
        thrust = [f"thrust[{i + 1}]" for i in range(scenario.vehicle.n_thrusters)]
        indices = [columns.index(name) for name in (*_STATE, *thrust)]
        for k in range(scenario.steps + 1):
            master.step(k, source)
            rows.append(master.row[indices])
    table: Array = np.array(rows)
    return Rehearsal(scenario.time.step * np.arange(len(table), dtype=np.float64), table[:, :13], table[:, 13:])


def schedule(segments: Sequence[Segment]) -> list[tuple[int, Command]]:
    """Return the commands of segments with returns between them, each with its step."""
    commands: list[tuple[int, Command]] = []
    step = round(BEGIN / ROW)
    for segment in segments:
        commands += [(step, SetMode(segment.mode)), *_stick_commands(segment, step)]
        step += len(segment.sticks) * _STICK_ROWS
        commands.append((step, SetMode("reach")))
        step += round(RETURN / ROW)
    return commands


def _stick_commands(segment: Segment, step: int) -> list[tuple[int, Command]]:
    return [(step + k * _STICK_ROWS, ManualControl(tuple(row))) for k, row in enumerate(segment.sticks.tolist())]


def _variant(
    scenario: Scenario, parameters: Sequence[Parameter], factors: Array, current: float, angle: float
) -> Scenario:
    """Return a scenario with factors on parameters, in a current [m/s] toward an angle [rad] from north."""
    values = {p.plant: p.start * float(factor) for p, factor in zip(parameters, factors, strict=True)}
    flow = [current * math.cos(angle), current * math.sin(angle), 0.0]
    return scenario.replace({"plant.current": flow, "plant.parameters": values})


def _is_uncertain(p: Parameter) -> bool:
    if p.name.startswith("hydrodynamics.added_mass."):
        row, column = p.name.split(".")[2:]
        return row == column
    return "damping" in p.name


# ---- limits of space, and choice ----


def _limit_segment(segment: Segment, trial: Scenario, box: Box) -> tuple[Segment, Rehearsal] | None:
    """Return the segment with sticks reduced to stay within the limits, and its rehearsal; None if that fails."""
    begin: list[tuple[int, Command]] = [(0, SetMode(segment.mode))]
    center, sizes = np.array(trial.initial.position), _BOX_FRACTION * 0.5 * np.array(box)
    force, moment = 1.0, 1.0
    for _ in range(_MAX_TRIALS):
        reduced = segment.scaled(force, moment)
        rehearsal = rehearse(trial, [*begin, *_stick_commands(reduced, round(_SETTLE / ROW))])
        state = rehearsal.states
        tilt_cosine = 1.0 - 2.0 * np.square(state[:, 4:6]).sum(axis=1)
        is_outside = bool((np.abs(state[:, :3] - center) > sizes).any())
        is_wild = np.abs(state[:, 10:]).max() > _MAX_RATE or tilt_cosine.min() < math.sqrt(1.0 - _MAX_TILT**2)
        if not is_outside and not is_wild:
            return reduced, rehearsal
        force, moment = force * (_REDUCTION if is_outside else 1.0), moment * (_REDUCTION if is_wild else 1.0)
    return None


def keep_inside(
    segments: Sequence[Segment], scenario: Scenario, box: Box, others: Sequence[Scenario]
) -> tuple[Segment, ...]:
    """Return segments with reduced forces where other vehicles would leave the box."""
    result = tuple(segments)
    for _ in range(_MAX_TRIALS):
        commands = schedule(result)
        excursions = np.max(
            [excursions_of(rehearse(other, commands), scenario, box, len(result)) for other in others], axis=0
        )
        if (excursions <= 1.0).all():
            break
        result = tuple(
            s.scaled(_REDUCTION, 1.0) if size > 1.0 else s for s, size in zip(result, excursions, strict=True)
        )
    return result


def excursions_of(rehearsal: Rehearsal, scenario: Scenario, box: Box, count: int) -> Array:
    """Return the maximum distance from the center in each segment and the return after it, in halves of the box."""
    distance = np.abs(rehearsal.states[:, :3] - np.array(scenario.initial.position)) / (0.5 * np.array(box))
    segment = ((rehearsal.times - BEGIN) / (SECONDS + RETURN)).clip(0, count - 1).astype(int)
    return np.array([distance[segment == k].max() for k in range(count)])


def information(log: Log, vehicle: Vehicle, parameters: Sequence[Parameter]) -> Array | None:
    """Return the information of a run on the free parameters, shape (p, p), without prior; None without windows."""
    log = move_back(log, usual_delays(vehicle))
    windows, _ = cut_windows([log], vehicle, ROW, STAGES[0])
    if not windows:
        return None
    residuals = Residuals([log], vehicle, parameters, windows, ROW)
    values = np.array([p.start for p in parameters])
    settings, total = residuals.settings(values), np.zeros((len(values), len(values)))
    for i in range(len(windows)):
        jacobian = residuals.reduced(i, settings, values).jacobian
        total += jacobian.T @ jacobian
    return total


def choose_segments(matrices: Sequence[Array], parameters: Sequence[Parameter], count: int) -> list[int]:
    """Return the indices of the chosen candidates: greedy, then each exchanged once for a better one."""
    free = [i for i, p in enumerate(parameters) if not p.is_nuisance]
    scale = np.array([p.deviation for p in parameters])
    scaled = [matrix * np.outer(scale, scale) for matrix in matrices]
    total = np.eye(len(scale))

    def gain(matrix: Array) -> float:
        """Return the log-determinant of the information on the vehicle's parameters; nuisances are unknown too."""
        covariance = np.linalg.inv(matrix)[np.ix_(free, free)]
        return -float(np.linalg.slogdet(covariance)[1])

    order: list[int] = []
    for k in [*range(count), *range(count)]:
        if len(order) == count:
            total = total - scaled[order[k]]
        best = max(range(len(scaled)), key=lambda i: gain(total + scaled[i]))
        order[k : k + 1] = [best]
        total = total + scaled[best]
    return order
