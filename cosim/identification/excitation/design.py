"""The choice of segments: greedy, by the information that each adds on the free numbers, within limits of space."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cosim.errors import IdentificationError
from cosim.identification.excitation.rehearsal import Rehearsal, rehearse
from cosim.identification.excitation.scenario_text import ROW, load, scenario_text
from cosim.identification.excitation.segments import PERIOD, SECONDS, Segment, candidates
from cosim.identification.fit import STAGES, single_thread
from cosim.identification.log import Log
from cosim.identification.parameters import DEFAULT_FREE, DEFAULT_NUISANCES, Parameter, free_parameters, nuisances
from cosim.identification.residuals import Residuals
from cosim.identification.windows import cut_windows
from cosim.scenario.scenario import Scenario
from cosim.simulation.commands.command_handler import greatest_wrench
from cosim.simulation.commands.commands import Command, ManualControl, SetMode
from plant_fmu.vehicle import Vehicle, load_vehicle

Array = NDArray[np.float64]

RETURN = 10.0  # s, time between two segments, in which the law returns the vehicle to the center of the box
BEGIN = 2.0  # s, time before the first segment
_SETTLE = 1.0  # s, time before a candidate segment; windows begin with the segment
_STICKS = round(PERIOD / ROW)  # rows of the record per stick value
_USED = 0.7  # fraction of the box that a segment may use, with the start values of the numbers
_FASTEST = 2.0  # rad/s, greatest angular velocity about a body axis in a segment
_STEEPEST = math.sin(math.radians(55.0))  # sine of the greatest tilt in a segment
_SMALLER = 0.7  # factor on the sticks each time a segment leaves the limits
_TRIES = 7  # most simulations of a segment or schedule, each with sticks reduced by that factor
CURRENT = 0.1  # m/s, default of the current in which vehicles stay inside the box
_OTHERS = 8  # number of other vehicles for which forces are reduced, and of random ones that check the result


@dataclass(frozen=True)
class Design:
    """A schedule of stick inputs with the accuracy and the motion that are expected of it."""

    start: str  # name of the shipped vehicle, or path of the vehicle's file
    vehicle: Vehicle
    box: tuple[float, float, float]  # m, sizes of the box: north, east, down
    depth: float  # m, depth of the center of the box
    duration: float  # s, duration of the whole schedule
    segments: tuple[Segment, ...]
    tried: int  # number of candidates
    left_out: int  # number of candidates that leave the limits even with reduced sticks, or have no window
    commands: tuple[tuple[int, Command], ...]  # commands with their steps
    parameters: tuple[Parameter, ...]
    deviations: Array  # (p,) expected standard deviations of the parameters, in their units
    rehearsal: Rehearsal
    current: float  # m/s, speed of the current in which the other vehicles move
    excursions: tuple[float, ...]  # greatest distance of each other vehicle from the center, in halves of the box

    def vehicle_part(self) -> list[int]:
        """Return the indices of the vehicle's own parameters."""
        return [i for i, p in enumerate(self.parameters) if not p.is_nuisance]


def design(
    start: str,
    box: tuple[float, float, float],
    depth: float,
    duration: float,
    free: Sequence[str] = DEFAULT_FREE,
    nuisance: Sequence[str] = DEFAULT_NUISANCES,
    seed: int = 0,
    progress: Callable[[float], None] = lambda part: None,
    current: float = CURRENT,
) -> Design:
    """Choose stick inputs that give the most information on the free numbers; box [m], depth [m], duration [s]."""
    # with current [m/s]
    with single_thread():
        return _design(start, box, depth, duration, free, nuisance, seed, progress, current)


def _design(
    start: str, box: tuple[float, float, float], depth: float, duration: float, free: Sequence[str],
    nuisance: Sequence[str], seed: int, progress: Callable[[float], None], current: float,
) -> Design:  # fmt: skip
    vehicle = load_vehicle(start)
    count = math.floor((duration - BEGIN + RETURN) / (SECONDS + RETURN))
    if count < 1:
        raise IdentificationError(f"--time {duration:g}: is too short, expected {BEGIN + SECONDS:g} s or more")
    top = depth - 0.5 * box[2]
    if top < vehicle.hull_radius:
        raise IdentificationError(
            f"--depth {depth:g}: the box of {box[2]:g} m leaves the water, expected "
            f"{0.5 * box[2] + vehicle.hull_radius:g} m or more"
        )
    most = 0.5 * min(box[:2]) / SECONDS
    if current > most:
        raise IdentificationError(
            f"--current {current:g}: carries the vehicle out of the box within a segment of {SECONDS:g} s, expected "
            f"{most:.2g} m/s or less, or a larger --box"
        )
    trial = load(scenario_text(start, depth, _SETTLE + SECONDS, "trial"), start)
    reach = greatest_wrench(vehicle.thruster_matrix, vehicle.thrust_min, vehicle.thrust_max)
    tried = list(candidates(reach > 0.0, np.random.default_rng(seed), 1))
    kept: list[Segment] = []
    found: list[Array] = []
    parameters: list[Parameter] = []
    for i, segment in enumerate(tried):
        progress(i / (len(tried) + count))
        fitting = _within(segment, trial, box)
        if fitting is None:
            continue
        made, rehearsal = fitting
        log = rehearsal.log()
        parameters = parameters or free_parameters(vehicle, free) + nuisances(nuisance, [log])
        matrix = information([log], vehicle, parameters)
        if matrix is not None:
            kept.append(made)
            found.append(matrix)
    if not kept:
        raise IdentificationError(f"--box {box[0]:g} {box[1]:g} {box[2]:g}: is too small for any segment")
    order = _choose(found, parameters, count)
    whole = load(scenario_text(start, depth, BEGIN + count * (SECONDS + RETURN) - RETURN, "excite"), start)
    rng = np.random.default_rng([seed, 1])
    segments = keep_inside([kept[i] for i in order], whole, box, fastest_others(whole, parameters, current))
    commands = tuple(schedule(segments))
    rehearsal = rehearse(whole, commands)
    matrix = information([rehearsal.log()], vehicle, parameters)
    if matrix is None:
        raise IdentificationError("the schedule leaves no window that can be predicted")
    covariance = np.linalg.inv(matrix + _prior(parameters))
    others = draw_others(whole, parameters, current, rng)
    excursions = tuple(float(farthest(rehearse(other, commands), whole, box, count).max()) for other in others)
    progress(1.0)
    return Design(
        start, vehicle, box, depth, whole.time.duration, segments, len(tried), len(tried) - len(kept), commands,
        tuple(parameters), np.sqrt(np.diag(covariance)), rehearsal, current, excursions,
    )  # fmt: skip


def draw_others(
    scenario: Scenario, parameters: Sequence[Parameter], current: float, rng: np.random.Generator
) -> list[Scenario]:
    """Return scenarios of random vehicles, each in a current of random direction; current [m/s]."""
    found = []
    for _ in range(_OTHERS):
        values = {p.plant: p.start * rng.uniform(0.5, 1.5) for p in parameters if _is_uncertain(p)}
        found.append(_in_current(scenario, values, current, rng.uniform(0.0, 2.0 * math.pi)))
    return found


def fastest_others(scenario: Scenario, parameters: Sequence[Parameter], current: float) -> list[Scenario]:
    """Return scenarios of the fastest vehicle of `draw_others`, in currents of evenly spaced directions."""
    # with current [m/s]
    values = {p.plant: 0.5 * p.start for p in parameters if _is_uncertain(p)}
    return [_in_current(scenario, values, current, 2.0 * math.pi * k / _OTHERS) for k in range(_OTHERS)]


def _in_current(scenario: Scenario, values: dict[str, float], current: float, angle: float) -> Scenario:
    """Return a scenario with other plant parameters, in a current [m/s] towards an angle [rad] from north."""
    flow = [current * math.cos(angle), current * math.sin(angle), 0.0]
    return scenario.replace({"plant.current": flow, "plant.parameters": values})


def keep_inside(
    segments: Sequence[Segment], scenario: Scenario, box: tuple[float, float, float], others: Sequence[Scenario]
) -> tuple[Segment, ...]:
    """Return segments with reduced forces where other vehicles would leave the box; box [m]."""
    found = list(segments)
    for _ in range(_TRIES):
        commands = schedule(found)
        parts = np.max([farthest(rehearse(other, commands), scenario, box, len(found)) for other in others], axis=0)
        if (parts <= 1.0).all():
            break
        found = [
            Segment(s.title, s.mode, s.sticks * np.repeat([_SMALLER, 1.0], 3)) if part > 1.0 else s
            for s, part in zip(found, parts, strict=True)
        ]
    return tuple(found)


def farthest(flown: Rehearsal, scenario: Scenario, box: tuple[float, float, float], count: int) -> Array:
    """Return the greatest distance from the center in each segment and the return after it, in halves of the box."""
    away = np.abs(flown.states[:, :3] - np.array(scenario.initial.position)) / (0.5 * np.array(box))
    segment = ((flown.times - BEGIN) / (SECONDS + RETURN)).clip(0, count - 1).astype(int)
    return np.array([away[segment == k].max() for k in range(count)])


def schedule(segments: Sequence[Segment]) -> list[tuple[int, Command]]:
    """Return the commands of segments with returns between them, each with its step."""
    commands: list[tuple[int, Command]] = []
    step = round(BEGIN / ROW)
    for segment in segments:
        commands.append((step, SetMode(segment.mode)))
        commands += _stick_commands(segment, step)
        step += len(segment.sticks) * _STICKS
        commands.append((step, SetMode("reach")))
        step += round(RETURN / ROW)
    return commands


def information(logs: Sequence[Log], vehicle: Vehicle, parameters: Sequence[Parameter]) -> Array | None:
    """Return the information of runs on the free numbers, shape (p, p), without the prior; None without windows."""
    windows, _ = cut_windows(logs, vehicle, ROW, STAGES[0])
    if not windows:
        return None
    residuals = Residuals(logs, vehicle, parameters, windows, ROW)
    values = np.array([p.start for p in parameters])
    settings, total = residuals.settings(values), np.zeros((len(values), len(values)))
    for i in range(len(windows)):
        jacobian = residuals.reduced(i, settings, values).jacobian
        total += jacobian.T @ jacobian
    return total


def _stick_commands(segment: Segment, step: int) -> list[tuple[int, Command]]:
    return [(step + k * _STICKS, ManualControl(tuple(sticks))) for k, sticks in enumerate(segment.sticks.tolist())]


def _within(segment: Segment, trial: Scenario, box: tuple[float, float, float]) -> tuple[Segment, Rehearsal] | None:
    """Return the segment with sticks reduced to stay within the limits, and its rehearsal; None if that fails."""
    settle = round(_SETTLE / ROW)
    begin: list[tuple[int, Command]] = [(0, SetMode(segment.mode))]
    center, sizes = np.array(trial.initial.position), _USED * 0.5 * np.array(box)
    push, turn = 1.0, 1.0
    for _ in range(_TRIES):
        made = Segment(segment.title, segment.mode, segment.sticks * np.repeat([push, turn], 3))
        rehearsal = rehearse(trial, [*begin, *_stick_commands(made, settle)])
        state = rehearsal.states
        down = 1.0 - 2.0 * np.square(state[:, 4:6]).sum(axis=1)  # cosine of the tilt
        far = bool((np.abs(state[:, :3] - center) > sizes).any())
        wild = np.abs(state[:, 10:]).max() > _FASTEST or down.min() < math.sqrt(1.0 - _STEEPEST**2)
        if not far and not wild:
            return made, rehearsal
        push, turn = push * (_SMALLER if far else 1.0), turn * (_SMALLER if wild else 1.0)
    return None


def _choose(found: Sequence[Array], parameters: Sequence[Parameter], count: int) -> list[int]:
    """Return the indices of the chosen candidates: greedy, then each exchanged once for a better one."""
    free = [i for i, p in enumerate(parameters) if not p.is_nuisance]
    scale = np.array([p.deviation for p in parameters])
    matrices = [matrix * np.outer(scale, scale) for matrix in found]
    total = np.eye(len(scale))

    def gain(matrix: Array) -> float:
        """Return the log-determinant of the information on the vehicle's numbers; nuisances are unknown too."""
        covariance = np.linalg.inv(matrix)[np.ix_(free, free)]
        return -float(np.linalg.slogdet(covariance)[1])

    order: list[int] = []
    for _ in range(count):
        best = max(range(len(found)), key=lambda i: gain(total + matrices[i]))
        order.append(best)
        total = total + matrices[best]
    for place in range(count):
        without = total - matrices[order[place]]
        order[place] = max(range(len(found)), key=lambda i: gain(without + matrices[i]))
        total = without + matrices[order[place]]
    return order


def _is_uncertain(p: Parameter) -> bool:
    if p.name.startswith("hydrodynamics.added_mass."):
        row, column = p.name.split(".")[2:]
        return row == column
    return "damping" in p.name


def _prior(parameters: Sequence[Parameter]) -> Array:
    return np.diag([p.deviation**-2.0 for p in parameters])
