"""Arrays, sensors on clocks, event mode, and the small FMU: all with the bits of the scalar FMU."""

import functools
import re

import numpy as np
import pytest
from fmpy import read_model_description, simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu

from plant_fmu import Plant, build_fmu, load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.errors import BuildError
from plant_fmu.variables import variables, with_arrays
from plant_fmu.vehicle_component import make_vehicle_component
from tests.plant_fmu.conftest import CoSimulationInstance, refused

SENSORS = ("depth_sensor", "dvl", "imu", "compass", "usbl")
RATES = dict(zip((f"{name}.rate" for name in SENSORS), (20.0, 10.0, 100.0, 10.0, 1.0), strict=True))
START = {"position.z": 3.0, "quaternion.e1": 0.3, "velocity.u": 0.4, "velocity.r": 0.2, "current.x": 0.1,
         "current_variation.y": 0.2, "thrust_time_constant[2]": 0.2, "bottom_depth": 20.0, "seed": 7}  # fmt: skip
NOISE = {"dvl.velocity_noise": 0.01, "imu.acceleration_noise": 0.02, "usbl.noise": 0.3, "depth_sensor.delay": 0.03,
         "dvl.delay": 0.123, "dvl.loss_probability": 0.3, "usbl.outlier_probability": 0.4}  # fmt: skip


@functools.cache
def path_of(**choices):
    return cached_fmu(make_vehicle_component(load_vehicle("odin"), **choices), 3)


@functools.cache
def elements():
    """Return the scalars of each array, and of each other variable itself, by name."""
    by_array = {}
    for v in with_arrays(variables(load_vehicle("odin"))):
        by_array.setdefault(v.array if v.size != 1 else v.name, []).append(v.name)
    return {name: names for name, names in by_array.items() if not name.endswith(".clock")}


def as_arrays(fmu, values):
    """Return values of scalars as values of the variables with arrays; the others of an array as the FMU has them."""
    given = {}
    for name, names in elements().items():
        if names[0] == name:
            given |= {name: values[name]} if name in values else {}
        elif any(scalar in values for scalar in names):
            old = fmu.get(name)
            given[name] = [values.get(scalar, x) for scalar, x in zip(names, old, strict=True)]
    return given


class Pair:
    """The FMU with arrays and the scalar one, in step."""

    def __init__(self, make, start, **events):
        self.arrays, self.scalars = make(path_of(arrays=True), **events), make(path_of())
        self.events = events.get("eventModeUsed", False)
        self.arrays.set_values(as_arrays(self.arrays, start))
        self.scalars.set_values(RATES | start)
        self.arrays.begin()
        self.scalars.begin()
        self.ticks = {name: [] for name in SENSORS}
        if self.events:
            self.handle_event()

    def clocks(self):
        references = [self.arrays.by_name[f"{name}.clock"].valueReference for name in SENSORS]
        return dict(zip(SENSORS, self.arrays.fmu.getClock(references), strict=True))

    def handle_event(self):
        """Note the clocks that tick, end the event, and return the time of the next one."""
        for name, active in self.clocks().items():
            self.ticks[name] += [self.arrays.time] if active else []
        again, *_, defined, time = self.arrays.fmu.updateDiscreteStates()
        assert not again and not any(self.clocks().values())
        self.arrays.fmu.enterStepMode()
        return time if defined else None

    def drive(self, forces):
        self.arrays.set_values({"thrust": forces})
        self.scalars.set_values({f"thrust[{i + 1}]": force for i, force in enumerate(forces)})

    def step(self, h):
        """Make one step, of what length the FMU with arrays makes it."""
        event, terminate, early, last = self.arrays.step(h)
        assert not terminate and (early == (last < self.arrays.time) or not self.events)
        self.arrays.time = last
        self.scalars.step(last - self.scalars.time)
        self.scalars.time = last
        if event:
            self.arrays.fmu.enterEventMode()
            self.handle_event()

    def difference(self):
        """Return the variables that differ, in any bit."""
        names = [name for name in elements() if name in self.arrays.by_name and not name.startswith("actuator")]
        return [
            name
            for name in names
            if np.asarray(self.arrays.get(name), float).tobytes()
            != np.asarray(self.scalars.get(*elements()[name]), float).tobytes()
        ]


@pytest.fixture
def make():
    made = []

    def make_instance(path, **more):
        made.append(CoSimulationInstance(path, **more))
        return made[-1]

    yield make_instance
    for instance in made:
        instance.close()


EVENTS = {"plain": {}, "events": {"eventModeUsed": True}, "early": {"eventModeUsed": True, "earlyReturnAllowed": True}}


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("step", [0.01, 0.037])
@pytest.mark.parametrize("more", [{}, NOISE], ids=["exact", "noisy"])
@pytest.mark.parametrize("mode", EVENTS)
def test_all_values_have_the_bits_of_the_scalar_fmu(make, mode, more, step):
    pair = Pair(make, START | more, **EVENTS[mode])
    for k in range(200):
        pair.drive([10.0 * np.sin(0.05 * k + i) for i in range(8)])
        pair.step(step)
        assert pair.difference() == []
    assert np.abs(pair.arrays.get("velocity")).max() > 0.01


def test_clocks_tick_at_the_times_of_the_sensors(make):
    """By early return: of delayed sensors when a sample is delivered; lost samples do not tick."""
    pair = Pair(make, {"dvl.delay": 0.03, "compass.loss_probability": 1.0}, **EVENTS["early"])
    while pair.arrays.time < 2.0 - 1e-9:
        pair.step(min(0.25, 2.0 - pair.arrays.time))
    expected = {"depth_sensor": np.arange(41) / 20, "dvl": np.arange(20) / 10 + 0.03, "imu": np.arange(201) / 100,
                "compass": [], "usbl": [0.0, 1.0, 2.0]}  # fmt: skip
    for name, times in expected.items():
        assert pair.ticks[name] == pytest.approx(times, abs=1e-9), name


def test_a_step_that_may_not_end_early_ends_with_its_ticks(make):
    pair = Pair(make, {"imu.rate": 0.0}, **EVENTS["events"])
    pair.step(0.02)
    assert pair.ticks["depth_sensor"] == [0.0]
    for _ in range(2):
        pair.step(0.02)
    assert pair.arrays.time == pytest.approx(0.06)
    assert pair.ticks["depth_sensor"] == pytest.approx([0.0, 0.06])  # the sample of 0.05 s, at the end of the step
    assert pair.arrays.get("measured.time.depth_sensor") == [0.05]


def test_a_rate_that_changes_in_event_mode_ticks_in_the_same_event(make):
    instance = make(path_of(arrays=True), **EVENTS["events"]).start()
    clock = [instance.by_name["usbl.clock"].valueReference]
    instance.fmu.updateDiscreteStates()
    instance.fmu.enterStepMode()
    instance.step(0.505)
    instance.fmu.enterEventMode()
    assert not instance.fmu.getClock(clock)[0]
    instance.set_values({"usbl.rate": 4.0})
    assert instance.fmu.getClock(clock)[0]
    assert instance.get("measured.time.usbl") == [0.505]
    again, *_ = instance.fmu.updateDiscreteStates()
    assert not again


@pytest.mark.parametrize("early", [False, True])
def test_fmpy_simulates_with_events_and_arrays(early):
    thrust = np.linspace(-3.0, 4.0, 8)
    common = {"stop_time": 2.0, "output_interval": 0.02}
    names = [f"position.{axis}" for axis in "xyz"]
    scalars = simulate_fmu(
        str(path_of()),
        start_values=RATES | {f"thrust[{i + 1}]": x for i, x in enumerate(thrust)},
        output=names,
        **common,
    )
    arrays = simulate_fmu(
        str(path_of(arrays=True)), start_values={"thrust": list(thrust)}, output=["position", "measured.depth"],
        use_event_mode=True, early_return_allowed=early, **common,
    )  # fmt: skip
    assert len(arrays) > len(scalars)
    last = {round(time, 9): row for time, row in zip(arrays["time"], arrays["position"], strict=True)}
    for row in scalars:
        assert np.abs(last[round(row["time"], 9)] - [row[name] for name in names]).max() < 1e-12
    assert np.abs(arrays["position"][-1]).min() > 1e-4


# ---- states, instances, refusals ----


def test_states_keep_the_clocks(make):
    """Saved in event mode, restored here and in another instance: the same clocks, then the same bits."""
    one, other = (make(path_of(arrays=True), **EVENTS["early"]) for _ in range(2))
    for instance in (one, other):
        instance.set_values(as_arrays(instance, START | NOISE))
        instance.begin()
        instance.fmu.updateDiscreteStates()
        instance.fmu.enterStepMode()
    references = [one.by_name[f"{name}.clock"].valueReference for name in SENSORS]
    _, _, early, last = one.step(0.5)
    assert early and last == 0.01
    one.fmu.enterEventMode()
    active = one.fmu.getClock(references)
    assert any(active)
    data = one.serialize(state := one.save())

    def go_on(instance):
        seen = [instance.fmu.getClock(references), instance.get("position", "measured.acceleration")]
        instance.fmu.updateDiscreteStates()
        instance.fmu.enterStepMode()
        instance.time = 0.01
        for _ in range(40):
            *_, instance.time = instance.fmu.doStep(instance.time, 0.07)
            instance.fmu.enterEventMode()
            seen += [instance.fmu.getClock(references), instance.get("position", "measured.velocity")]
            instance.fmu.updateDiscreteStates()
            instance.fmu.enterStepMode()
        return seen

    first = go_on(one)
    one.restore(state)
    assert go_on(one) == first
    other.restore(other.deserialize(data))
    assert go_on(other) == first
    plain = make(path_of(arrays=True)).start()
    refused(plain, lambda: plain.restore(plain.deserialize(data)), "in event mode, which this instance does not use")
    damaged = bytearray(data)
    damaged[len(data) // 2] ^= 1
    refused(plain, lambda: plain.deserialize(bytes(damaged)), "damaged")


def test_reset_keeps_the_event_mode_and_the_start_values(make):
    instance = make(path_of(arrays=True), **EVENTS["early"]).start(position=[1.0, 2.0, 3.0])
    instance.fmu.reset()
    assert instance.get("position") == [0.0, 0.0, 0.0]
    instance.begin()
    assert instance.fmu.getClock([instance.by_name["imu.clock"].valueReference])[0]


def stepping(make):
    instance = make(path_of(arrays=True), **EVENTS["events"]).start()
    instance.fmu.updateDiscreteStates()
    instance.fmu.enterStepMode()
    return instance


REFUSALS = {
    "more values than elements": (lambda i: i.fmu.setFloat64([28], [0.0] * 9), "9 values given", "8 elements"),
    "fewer": (lambda i: i.fmu.getFloat64([28, 1], 3), "3 values given", "11 elements"),
    "one of an array out of range": (lambda i: i.set_values({"thrust": [0.0] * 7 + [np.nan]}), "thrust[8]"),
    "an element alone": (lambda i: i.fmu.setFloat64([29], [0.0]), "0 elements"),
    "flags": (lambda i: i.fmu.getBoolean([i.by_name["thrust_saturated"].valueReference]), "1 values", "8 elements"),
    "no clock": (lambda i: i.fmu.getClock([28]), "value reference 28 is no clock variable"),
    "a clock that is set": (lambda i: i.fmu.setClock([i.by_name["dvl.clock"].valueReference], [True]), "fmi3SetClock"),
    "a seed": (lambda i: i.fmu.getDirectionalDerivative([1], [28], [1.0] * 7, 3), "7 values given", "8 elements"),
    "step mode twice": (lambda i: i.fmu.enterStepMode(), "entering step mode: not allowed"),
    "continuous time": (lambda i: i.fmu.enterContinuousTimeMode(), "not offered in co-simulation"),
    "time": (lambda i: i.fmu.setTime(1.0), "not offered in co-simulation"),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals_name_what_came(make, case):
    instance = stepping(make)
    call, *words = REFUSALS[case]
    instance.fmu.setTime = lambda t: instance.fmu.fmi3SetTime(instance.fmu.component, t)
    instance.fmu.enterContinuousTimeMode = lambda: instance.fmu.fmi3EnterContinuousTimeMode(instance.fmu.component)
    refused(instance, lambda: call(instance), *words)
    instance.fmu.enterEventMode()
    refused(instance, lambda: instance.set_values({"position": [1.0] * 3}), "position.x: not allowed in event mode")


def test_event_mode_is_for_importers_that_use_it(make):
    instance = make(path_of(arrays=True)).start()
    refused(instance, instance.fmu.enterEventMode, "entering event mode: not offered in co-simulation")
    event, _, early, last = instance.step(0.1)
    assert (event, early, last) == (False, False, 0.1)
    with pytest.raises(FMICallException):
        instance.fmu.enterStepMode()
    assert not instance.fmu.getClock([instance.by_name["imu.clock"].valueReference])[0]


def test_derivatives_of_arrays_are_those_of_their_elements(make):
    pair = Pair(make, START)
    unknowns, knowns = ["der(velocity)", "der(angular_velocity)", "measured.acceleration"], ["thrust", "quaternion"]
    rows, columns = ([s for name in names for s in elements()[name]] for names in (unknowns, knowns))
    expected = pair.scalars.jacobian(rows, columns)
    references = [[pair.arrays.by_name[name].valueReference for name in names] for names in (unknowns, knowns)]
    seeds = np.eye(len(columns))
    got = [pair.arrays.fmu.getDirectionalDerivative(*references, list(seed), len(rows)) for seed in seeds]
    assert np.array_equal(np.array(got).T, expected)
    adjoint = [
        pair.arrays.fmu.getAdjointDerivative(*references, list(seed), len(columns)) for seed in np.eye(len(rows))
    ]
    assert np.allclose(adjoint, expected, rtol=1e-13, atol=0.0)


def test_clocks_tick_in_model_exchange(make):
    model = make(path_of(arrays=True), interface="me")
    model.set_values({f"{name}.rate": 0.0 for name in SENSORS[1:]} | {"position": [0.0, 0.0, 4.0]})
    model.begin()
    clock = [model.by_name["depth_sensor.clock"].valueReference]
    assert model.fmu.getClock(clock)[0]
    assert model.update_discrete() == (False, 0.05)
    model.fmu.enterContinuousTimeMode()
    model.fmu.setTime(0.05)
    model.put_states(np.r_[0.0, 0.0, 5.0, 1.0, np.zeros(23)])
    assert not model.fmu.getClock(clock)[0]
    model.fmu.enterEventMode()
    assert model.fmu.getClock(clock)[0]
    assert model.get("measured.depth") == [5.0]
    assert model.update_discrete() == (False, 0.1)
    assert not model.fmu.getClock(clock)[0]


# ---- description ----


@pytest.mark.medium
@pytest.mark.parametrize("choices", ["arrays", "arrays coupled", "arrays small", "small"])
def test_fmpy_finds_no_problem(choices):
    assert validate_fmu(str(path_of(**dict.fromkeys(choices.split(), True)))) == []


def test_arrays_and_clocks_are_described(make):
    description = read_model_description(str(path_of(arrays=True)))
    by_name = {v.name: v for v in description.modelVariables}
    shapes = {"thrust": (8,), "position": (3,), "quaternion": (4,), "velocity": (3,), "angular_velocity": (3,),
              "thruster_matrix.force": (3, 8), "thrust_saturated": (8,), "mass": ()}  # fmt: skip
    assert {name: tuple(by_name[name].shape) for name in shapes} == shapes
    assert description.coSimulation.hasEventMode and description.modelExchange
    clocked = {v.name: [clock.name for clock in v.clocks] for v in by_name.values() if v.clocks}
    of_dvl = [name for name, clocks in clocked.items() if clocks == ["dvl.clock"]]
    assert of_dvl == ["measured.velocity", "measured.altitude", "measured.time.dvl"]
    assert clocked.keys() == {name for name in by_name if name.startswith("measured.")}
    assert all(by_name[name].variability == "discrete" for name in clocked)
    assert {by_name[f"{name}.clock"].intervalVariability for name in SENSORS} == {"triggered"}
    vehicle = load_vehicle("odin")
    matrix = np.reshape([float(x) for x in by_name["thruster_matrix.moment"].start.split()], (3, 8))
    assert np.array_equal(matrix, vehicle.thruster_matrix[3:])
    assert np.array_equal(np.reshape(make(path_of(arrays=True)).get("thruster_matrix.moment"), (3, 8)), matrix)


@pytest.mark.medium
def test_types_name_the_quantities(fmi):
    description = read_model_description(str(cached_fmu(load_vehicle("odin"), fmi)))
    by_name = {v.name: v for v in description.modelVariables}
    types = {name: by_name[name].declaredType for name in ("thrust[1]", "position.z", "mass", "quaternion.e0")}
    assert {name: kind and (kind.quantity, kind.unit) for name, kind in types.items()} == {
        "thrust[1]": ("Force", "N"), "position.z": ("Length", "m"), "mass": ("Mass", "kg"), "quaternion.e0": None,
    }  # fmt: skip
    assert all(v.declaredType is None or v.declaredType.unit == v.unit for v in by_name.values())


@pytest.mark.medium
def test_the_small_fmu_shows_body_and_thrusters(make, fmi, tmp_path):
    path = build_fmu(load_vehicle("odin"), fmi, tmp_path / "small.fmu", small=True)
    description = read_model_description(str(path))
    assert len(description.modelVariables) == (60 if fmi == 3 else 59)  # FMI 2.0 has no variable for the time
    assert description.modelExchange is None
    small, whole = make(path), make(cached_fmu(load_vehicle("odin"), fmi))
    start = {"position.z": 3.0, "thrust[3]": 20.0, "mass": 130.0, "current.x": 0.3}
    for instance in (small, whole):
        instance.start(**start)
        for _ in range(50):
            instance.step(0.02)
    names = [v.name for v in description.modelVariables if v.causality == "output"]
    assert small.get(*names) == whole.get(*names)


@pytest.mark.medium
def test_plants_take_arrays(tmp_path):
    path = build_fmu(load_vehicle("odin"), 3, tmp_path / "arrays.fmu", arrays=True, small=True)
    with Plant(path) as plant:
        plant.set({"position": [0.0, 0.0, 5.0], "current": np.zeros(3)})
        plant.initialize()
        plant["thrust"] = np.arange(8.0)
        plant.step(0.1)
        assert plant["thruster_force"].tolist() == list(range(8)) and plant["position"].shape == (3,)


def test_arrays_are_for_fmi_3_and_a_vehicle(tmp_path):
    with pytest.raises(BuildError, match=r"FMI version is 2, expected 3 with arrays and clocks"):
        build_fmu(load_vehicle("odin"), 2, tmp_path / "x.fmu", arrays=True)
    component = make_vehicle_component(load_vehicle("odin"))
    with pytest.raises(BuildError, match="are for a vehicle"):
        build_fmu(component, 3, tmp_path / "x.fmu", small=True)
    assert not [*tmp_path.iterdir()]


@pytest.mark.medium
def test_terminals_refer_to_variables(tmp_path):
    for choices in ({"arrays": True}, {"small": True}):
        files = make_vehicle_component(load_vehicle("odin"), **choices).contents(3)
        terminals = files["terminalsAndIcons/terminalsAndIcons.xml"].decode()
        names = {v.name for v in read_model_description(str(path_of(**choices))).modelVariables}
        assert set(re.findall(r'variableName="([^"]+)"', terminals)) <= names
