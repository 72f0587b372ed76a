"""The model, the data and the plant's calls of a step, from a scenario."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from controller import Law, VehicleState
from controller.navigation.measurements import SENSORS, VALUES, Measurements
from controller.navigation.navigation_memory import empty_memory
from controller.regions import pack
from controller.regions.region_set import shape_center
from controller.regions.shapes.visibility import Visibility
from cosim.scenario.goal_mission import TURNING_RATE, camera_heading
from cosim.scenario.scenario import Scenario
from cosim.scenario.sensor_suite import outage_schedule, scenario_sensors, sensor_model
from cosim.simulation.actuation_limits import failure_stages
from cosim.simulation.bindings import is_compiled, outputs_of
from cosim.simulation.columns import columns_of_channels
from cosim.simulation.component_map import component_columns
from cosim.simulation.environment import pack_target
from cosim.simulation.signals import Signals
from cosim.step.arbiter_inputs import ArbiterSignals, empty_signals, empty_state, pack_inputs
from cosim.step.mission_legs import MissionModel
from cosim.step.region_positions import RegionEvaluation
from cosim.step.step_model import N_CALLS, Array, Integers, StepData, StepModel
from plant_fmu.running.channels import Channel

STREAM = 1  # second part of the seed, as in scored scenes: a scene and a scenario of one seed have the same noise
_FORCES = ("thruster_force[", "actuator.wrench.", "actuation.")  # outputs of the end of a step begin with one
_ROUNDING = 1e-6  # tolerance of times, as a fraction of a step
NO_CLOCK: Integers = np.empty(0, np.int64)
_MOTION = (
    *(f"position.{axis}" for axis in "xyz"),
    *(f"quaternion.e{i}" for i in range(4)),
    *(f"velocity.{axis}" for axis in "uvwpqr"),
)
SENSED = (*(f"measured.{name}" for name in VALUES), *(f"measured.time.{sensor}" for sensor in SENSORS))


def exchanged_variables(scenario: Scenario) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of the inputs and outputs of the plant that a step without a record exchanges with it."""
    sensed = SENSED if scenario.sensing.through == "sensors" else ()
    if scenario.actuation.through == "thrusters":
        n = scenario.vehicle.n_thrusters
        forces = (*(f"thruster_force[{i + 1}]" for i in range(n)), *(f"actuation.{axis}" for axis in "XYZ"))
        return tuple(f"thrust[{i + 1}]" for i in range(n)), (*_MOTION, *sensed, *forces)
    wrench = tuple(f"actuator.wrench.{axis}" for axis in "XYZ")  # states: they cost no evaluation
    return tuple(f"wrench.{axis}" for axis in "XYZKMN"), (*_MOTION, *sensed, *wrench)


def make_model(scenario: Scenario, law: Law, clock: Integers = NO_CLOCK, for_record: bool = False) -> StepModel:
    """Make the constants of a step."""
    sensing, step = scenario.sensing, scenario.time.step
    sensors = scenario_sensors(scenario)
    outages = outage_schedule(scenario.outages, sensors, step)
    failures = sorted(
        (math.ceil(f.time / step - _ROUNDING), f.thruster - 1, math.nan if f.stuck else f.effectiveness)
        for f in scenario.failures
    )
    names = ["goal", *(secondary.region.name for secondary in scenario.regions)]
    through_thrusters = scenario.actuation.through == "thrusters"
    return StepModel(
        step=step,
        steps=scenario.steps,
        control_every=scenario.control_every,
        arbiter_every=scenario.arbiter_every,
        jacobi=scenario.master.order == "jacobi",
        commands=scenario.commands.enabled,
        for_record=for_record,
        criteria=np.array(scenario.criterion_places, np.int64),
        priorities=np.array([secondary.priority for secondary in scenario.regions]),
        inputs=pack_inputs(scenario.regions, scenario.criteria, scenario.rules, scenario.arbiter.ramp),
        moving=bool(scenario.moving),
        moving_regions=np.array([names.index(name) for name in scenario.moving], np.int64),
        goal_center=np.array(shape_center(scenario.goal)),
        mission=make_mission_model(scenario),
        exact=sensing.exact,
        dead_from=sensing.dead_from,
        dead_until=sensing.dead_from + sensing.dead_for,
        frozen=sensing.frozen,
        through_sensors=sensing.through == "sensors",
        sensors=sensor_model(sensors),
        outage_steps=np.array([step for step, _, _ in outages], np.int64),
        outage_sensors=np.array([sensor for _, sensor, _ in outages], np.int64),
        outage_losses=np.array([loss for _, _, loss in outages]),
        failed=np.array([thruster for _, thruster, _ in failures], np.int64),
        failure_steps=np.array([due for due, _, _ in failures], np.int64),
        remaining=np.array([remaining for _, _, remaining in failures]),
        report_failures=scenario.report_failures,
        through_thrusters=through_thrusters,
        law_gives_wrench=law.output == "wrench",
        thruster_matrix=scenario.vehicle.thruster_matrix[:, : None if through_thrusters else 0],
        dead_band=np.array(scenario.vehicle.thrust_dead_band, dtype=float),
        curve=np.array(scenario.vehicle.thrust_curve, dtype=float),
        **{
            field: next((i for i, diagnostic in enumerate(law.diagnostics) if diagnostic.name == name), -1)
            for field, name in (("bound", "bound"), ("isolated", "failed_thruster"), ("limit", "thrust_limit"))
        },
        clock=clock,
    )


def make_mission_model(scenario: Scenario) -> MissionModel:
    """Make the table of a mission's legs."""
    mission, attitude = scenario.mission, scenario.law.desired_quaternion
    bow, camera = camera_heading(attitude, scenario.regions)
    centers, stops, paces, stays, radii, headings, faces, features, speeds = map(
        np.array, zip(*mission.legs, strict=True)
    )
    centers[0] = 0.0  # that of the goal itself
    if not mission.uses_features:
        features = np.full_like(features, np.nan)
    kept = np.where(np.isnan(headings), 0.0, headings - bow)
    views = [scenario.regions[i].region.shape for i in mission.views]
    return MissionModel(
        centers=centers,
        stops=stops.astype(float),
        paces=paces,
        stays=np.ceil(stays / scenario.time.step - _ROUNDING).astype(np.int64),
        radii=radii,
        headings=np.where(faces, np.nan, kept),
        features=features,
        speeds=speeds,
        views=np.array(mission.views, np.int64),
        view_features=np.reshape([shape.feature for shape in views if isinstance(shape, Visibility)], (-1, 3)),
        turns=mission.turns,
        attitude=np.array(attitude),
        camera=camera,
        turning_rate=TURNING_RATE,
    )


class NoiseSource:
    """Draws the noise of position and linear velocity of control steps, in turn."""

    def __init__(self, scenario: Scenario, rows: int, rng: np.random.Generator | None = None) -> None:
        sensing = scenario.sensing
        self._deviation: Array = np.repeat([sensing.position_noise, sensing.velocity_noise], 3)
        self._rng, self._drawn = rng or np.random.default_rng([sensing.seed, STREAM]), 0
        none = sensing.exact or sensing.through == "sensors"
        self.values: Array = np.zeros((0 if none else rows, 6))  # [m, m/s]; control step c is in row c modulo rows

    def draw(self, control_steps: int) -> None:
        """Draw up to a number of control steps, at most as many as there are rows beyond those drawn before."""
        rows, n = len(self.values), control_steps - self._drawn
        if rows and n > 0:
            indices = np.arange(self._drawn, control_steps) % rows
            self.values[indices] = self._deviation * self._rng.standard_normal((n, 6))
            self._drawn = control_steps


def make_noise(scenario: Scenario) -> Array:
    """Draw the noise of position and linear velocity of each control step, shape (control steps, 6) [m, m/s]."""
    n = 1 + scenario.steps // scenario.control_every
    source = NoiseSource(scenario, n)
    source.draw(n)
    return source.values


def step_signals(scenario: Scenario, law: Law, inputs: Sequence[str], outputs: Sequence[str]) -> Signals:
    """Return the row of a step without a record, which exchanges some inputs and outputs with the plant."""
    sent, read = ([Channel(name, "", "") for name in names] for names in (inputs, outputs))
    columns = columns_of_channels(scenario, read, (), sent, law.diagnostics)
    left_out = {f"{name}.value" for name in ("goal", *(secondary.region.name for secondary in scenario.regions))}
    if law.output == "thrusters":
        left_out |= {f"command.{axis}" for axis in "XYZKMN"}
    return Signals([column for column in columns if column.name not in left_out])


def first_origins(mission: MissionModel, n: int) -> Array:
    """Return the shifts of n regions at the start [m, NED], shape (n, 3): of those that a mission moves."""
    origins = np.zeros((n, 3))
    origins[mission.views] = mission.features[0] - mission.view_features
    return origins


def make_data(scenario: Scenario, model: StepModel, law: Law, signals: Signals, inputs: Sequence[str],
              outputs: Sequence[str], noise: Array, flags: Sequence[str] = ()) -> StepData:  # fmt: skip
    """Make state and signals of a step; noise (control steps, 6)."""
    m, n, c = scenario.vehicle.n_thrusters, len(scenario.regions), len(scenario.criteria)

    def view(first: str, size: int) -> Array:
        return signals.view(first, size) if size and first in signals else np.zeros(size)

    first_force = next(i for i, name in enumerate(outputs) if name.startswith(_FORCES))
    health = np.ones(m)
    # law and arbiter get arrays of their own, also where these equal the true ones
    state = VehicleState(view("sensed.x", 3), view("sensed.e0", 4), view("sensed.u", 6), health,
                         view("deviation.position.x", 12))  # fmt: skip
    values, clearances = view("goal.value", n + 1), view("goal.clearance", n + 1)
    memberships = view(f"membership.{scenario.criterion_names[0]}", c) if c else np.zeros(0)
    made, rules = empty_signals(model.inputs, n, c), scenario.rules.inputs
    of_rules = view(f"arbiter.{rules[0].name}", len(rules)) if model.inputs.kinds.size else memberships
    plant_inputs = view(inputs[0], len(inputs))
    wrench = plant_inputs[inputs.index("wrench.X") :][:6] if "wrench.X" in inputs else np.zeros(6)
    own, commands = min(len(inputs), m + 6), scenario.commands.enabled
    regions = pack([secondary.region for secondary in scenario.regions])
    out = outputs_of(law)
    of_components, n_components = component_columns(scenario), len(scenario.components)
    return StepData(
        row=signals.row,
        now=signals.row[:1],
        outputs=view(outputs[0], len(outputs)),
        first_applied=first_force,
        forces=view("thruster_force[1]", m if model.through_thrusters else 0),
        force=view("actuation.X" if "actuation.X" in outputs else "actuator.wrench.X", 3),
        flags=view(flags[0], len(flags)) if flags else np.zeros(0),
        inputs=plant_inputs,
        wrench=wrench,
        delayed=np.zeros((round(scenario.vehicle.command_delay / model.step) + model.jacobi, own)),
        goal=pack_target(scenario.goal_region) if commands else pack([scenario.goal_region]),
        regions=regions,
        goal_center=np.array(shape_center(scenario.goal)),
        goal_origin=np.zeros((1, 3)),
        region_origins=first_origins(model.mission, n),
        shifts=view(f"{scenario.moving[0]}.shift.x", 3 * len(scenario.moving)).reshape(-1, 3)
        if scenario.moving
        else np.zeros((0, 3)),
        shown_stop=view("goal.place", 1),
        arrivals=np.full(len(scenario.mission.stops), np.nan),
        feature=model.mission.features[0].copy(),
        attitude=law.attitude_target if is_compiled(law) else np.zeros(4),
        speed_limit=law.speed_limit if is_compiled(law) and law.takes_speed else np.array(np.inf),
        true_state=VehicleState(view("position.x", 3), view("quaternion.e0", 4), view("velocity.u", 6), health),
        state=state,
        arbiter_state=empty_state(),
        noise=noise,
        measurements=Measurements(view(SENSED[0], len(VALUES)), view(SENSED[len(VALUES)], len(SENSORS))),
        navigation=empty_memory(),
        true_evaluation=RegionEvaluation(values, np.zeros((n + 1, 3)), np.zeros((n + 1, 3)), clearances),
        arbiter_evaluation=RegionEvaluation(
            np.zeros(n + 1), np.zeros((n + 1, 3)), np.zeros((n + 1, 3)), np.zeros(n + 1)
        ),
        signals=ArbiterSignals(memberships, of_rules, *made[2:]),
        shown_inputs=view(f"arbiter.{rules[0].name}", 0 if model.inputs.kinds.size else len(rules))
        if scenario.arbiter.file
        else np.zeros(0),
        by_criterion=view(f"weight.{scenario.criterion_names[0]}", c) if c else np.zeros(0),
        weights=np.zeros(n),
        calls=np.zeros(N_CALLS, np.int64),
        components=np.zeros(2 * n_components, np.int64),
        exchanges=np.zeros(2 * (n_components + 1) if model.jacobi else 0, np.int64),
        component_outputs=view(of_components[0].name if of_components else "", len(of_components)),
        component_results=np.zeros(len(of_components)),
        law=out,
        expected=np.full(6, np.nan),
        estimate=view("estimate.phi1", 4),
        report=view(f"law.{law.diagnostics[0].name}", out.report.size) if law.diagnostics else np.zeros(0),
        command=view("command.X", 6),
        saturated=view("allocation_saturated", 1),
        thrusts=plant_inputs[: m if model.through_thrusters else 0],
        allocator=failure_stages(scenario, model),
        stuck=np.full(own, np.nan),
        ticks=np.zeros(2, np.int64),
    )
