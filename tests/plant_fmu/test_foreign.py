"""FMUs of others in `Plant`: what other tools take, what an FMU says, and how each of its failures ends."""

import logging
import subprocess
import sys
import zipfile

import numpy as np
import pytest

from plant_fmu import Plant, PlantError
from tests.foreign_fmu import MODES, build_foreign_fmu
from tests.plant_fmu.conftest import members


@pytest.fixture(scope="module")
def foreign(once):
    """Return a function that returns the FMU of a version."""

    def make(folder):
        for fmi in (2, 3):
            extra = {"canGetAndSetFMUstate" if fmi == 2 else "canGetAndSetFMUState": "true"}
            outputs = {f"y{i}": 20 + i for i in range(10)}
            build_foreign_fmu(folder / f"{fmi}.fmu", fmi, outputs=outputs, array=fmi == 3, **extra)

    return lambda fmi: once("foreign", make) / f"{fmi}.fmu"


@pytest.fixture
def made(foreign, fmi):
    """Return a function that returns an initialized plant which fails from 1 s on."""
    plants = []

    def make(mode, start=True):
        plants.append(Plant(foreign(fmi)))
        plants[-1].set({"mode": MODES.index(mode), "at": 1.0})
        if start:
            plants[-1].initialize()
            plants[-1].step(0.5)
            plants[-1].step(0.5)
        return plants[-1]

    yield make
    for plant in plants:
        plant.close()


@pytest.mark.parametrize(
    ("mode", "time", "words"),
    [
        ("error", 1.0, ("-7 of x is 0.250, 12.5% of 99", "%d of %s is %.3f, %5.1f%% of %lu")),
        ("fatal", 1.0, ("out of memory",) * 2),
        ("discard", 1.25, ("the FMU discarded the step",) * 2),
        ("end", 1.25, ("the FMU requests the end of the simulation",) * 2),
        ("null message", 1.0, ("the FMU failed without a message: Error",) * 2),
        ("no input", 1.0, ("the FMU failed without a message: Discard",) * 2),
        ("warned", 1.0, ("x is too large",) * 2),
        ("percent", 1.0, ("fails at 50",) * 2),
    ],
)
def test_failures_are_told_apart(made, fmi, mode, time, words):
    """Arguments of a message are those of printf in FMI 2.0; FMI 3.0 has none."""
    plant = made(mode)
    with pytest.raises(PlantError) as caught:
        plant.step(0.5)
    text = str(caught.value)
    assert text == f"t = {time:g} s: {words[fmi - 2]}" or (mode == "percent" and words[fmi - 2] in text)
    assert plant.time == time
    if mode == "fatal":
        for act in (lambda: plant.step(0.5), plant.reset, lambda: plant["gain"], lambda: plant.set({"gain": 2.0})):
            with pytest.raises(PlantError, match="has failed fatally"):
                act()
    else:
        plant.reset()
        plant.initialize()
        plant.step(0.5)


def test_a_part_of_a_step_is_no_step(made, fmi):
    plant = made("short")
    if fmi == 2:  # says nothing of how far a step went that succeeded
        plant.step(0.5)
        return
    with pytest.raises(PlantError, match=r"t = 1.25 s: the FMU made a part of the step alone"):
        plant.step(0.5)
    assert plant.time == 1.25


def test_formats_that_do_not_fit_are_survived(made, fmi):
    """The conversions before the first that is none are made."""
    with pytest.raises(PlantError) as caught:
        made("formats").step(0.5)
    if fmi == 2 and sys.platform == "linux":
        assert str(caught.value) == "t = 1 s: a (unknown) b (unknown) c %*d d %2147483647d %.99999999999f %q"


def test_sums_of_small_steps_are_whole_steps(tmp_path):
    """An FMU that adds up its own steps is late by a rounding, more at later times."""
    with Plant(build_foreign_fmu(tmp_path / "it.fmu", 3)) as plant:
        plant.set({"mode": MODES.index("short"), "at": 1.0})
        plant.initialize(1e6)
        plant.step(1e-3)  # reaches 0.5 ms less: within a billionth of the time
        plant.reset()
        plant.set({"mode": MODES.index("short"), "at": 1.0})
        plant.initialize(1e6)
        with pytest.raises(PlantError, match="the FMU made a part of the step alone"):
            plant.step(1.0)


@pytest.mark.parametrize(("mode", "words"), [("ok", ["terminated", "freed"]), ("discard", ["terminated", "freed"]),
                                             ("error", ["freed"]), ("fatal", [])])  # fmt: skip
def test_close_terminates_what_still_runs(made, caplog, mode, words):
    plant = made(mode)
    if mode != "ok":
        with pytest.raises(PlantError):
            plant.step(0.5)
    with caplog.at_level(logging.DEBUG, "plant_fmu"):
        caplog.clear()
        plant.close()
    assert [record.message for record in caplog.records] == [f"FMU: {word}" for word in words]


def test_terminate_ends_until_reset(made, caplog):
    plant = made("ok")
    with caplog.at_level(logging.DEBUG, "plant_fmu"):
        plant.terminate()
        for act in (lambda: plant.step(0.5), plant.terminate):
            with pytest.raises(PlantError, match=r"after terminate\(\), until reset\(\)"):
                act()
        with pytest.raises(PlantError, match=r"terminated; reset\(\) it first"):
            plant.initialize()
        plant.reset()
        plant.close()
    assert [record.message for record in caplog.records] == ["FMU: terminated", "FMU: freed"]


def test_a_state_is_discarded_unless_it_is_kept(made):
    """FMUs may keep what they need to go back, or not, by this argument of `doStep`."""
    plant = made("ok")
    assert plant["y9"] == 1.0
    state = plant.save()
    plant.step(0.5)
    assert plant["y9"] == 0.0
    plant.free(state)
    plant.step(0.5)
    assert plant["y9"] == 1.0


def test_experiment_is_passed(made):
    plant = made("ok", start=False)
    for wrong, words in (
        ({"stop_time": -1.0}, "stop time is -1.0 s, expected 0.0 s"),
        ({"tolerance": -1e-6}, "expected a number above 0"),
        ({"stop_time": float("nan")}, "stop time is nan s, expected 0.0 s"),
        ({"time": float("nan")}, "start time is nan s, expected a finite number"),
        ({"tolerance": float("nan")}, "tolerance is nan"), ({"stop_time": "1"}, "stop time is '1', expected seconds"),
    ):  # fmt: skip
        with pytest.raises(PlantError, match=words):
            plant.initialize(**wrong)
    plant.initialize(0.5, stop_time=7.5, tolerance=1e-5)
    assert (plant["y0"], plant["y1"], plant.time) == (1e-5, 7.5, 0.5)


def test_declared_steps_are_checked(fmi, tmp_path):
    path = build_foreign_fmu(
        tmp_path / "it.fmu", fmi, fixedInternalStepSize="0.1" if fmi == 3 else "",
        canHandleVariableCommunicationStepSize="",
    )  # fmt: skip
    with Plant(path) as plant:
        plant.initialize()
        if fmi == 3:
            with pytest.raises(PlantError, match="expected a multiple of the FMU's fixedInternalStepSize of"):
                plant.step(0.15)
        plant.step(0.1 + 0.2)
        plant.step(0.3)
        with pytest.raises(PlantError, match=r"step is 0\.1 s, expected 0\.3 s as before"):
            plant.step(0.1)
        plant.reset()
        plant.initialize()
        plant.step(0.1)


def test_arrays_are_numpy_arrays(foreign):
    with Plant(foreign(3)) as plant:
        plant.set({"A": [[1.0, 2.0], [3.0, 4.0]], "gain": 3.0})
        plant.initialize()
        np.testing.assert_array_equal(plant["A"], [[1.0, 2.0], [3.0, 4.0]])
        plant["A"] = np.eye(2, dtype=int)
        np.testing.assert_array_equal(plant["A"], np.eye(2))
        assert plant["gain"] == 3.0
        for wrong in ([1.0, 2.0], 1.0, np.zeros((2, 3))):
            with pytest.raises(PlantError, match=r"A has shape .*, expected \(2, 2\)"):
                plant["A"] = wrong
        with pytest.raises(PlantError, match="A is nan, expected a number"):
            plant["A"] = np.full((2, 2), np.nan)


def test_a_file_that_is_twice_in_an_fmu_is_one_file(foreign, fmi, tmp_path):
    files = members(foreign(fmi))

    def write(content):
        with zipfile.ZipFile(tmp_path / "it.fmu", "w") as archive:
            for name, data in [*files.items(), ("extra.txt", b"once")]:
                archive.writestr(name, data)
            with pytest.warns(UserWarning, match="Duplicate name"):
                archive.writestr("extra.txt", content)
        return tmp_path / "it.fmu"

    Plant(write(b"once")).close()
    with pytest.raises(PlantError, match=r"'extra\.txt' would be written over"):
        Plant(write(b"more"))


def test_what_other_tools_take_is_taken(fmi, tmp_path):
    """An undefined unit, a variability that does not fit, and a text as in no standard."""
    path = build_foreign_fmu(tmp_path / "it.fmu", fmi)
    files = members(path)
    xml = files["modelDescription.xml"].replace(
        b'causality="parameter" variability="tunable"', b'causality="parameter"'
    )
    xml = xml.replace(b'start="0.0"', b'start="0.0" unit="parsec" comment="none"')
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in (files | {"modelDescription.xml": xml}).items():
            archive.writestr(name, data)
    with Plant(path) as plant:
        assert plant.inputs.channels[0].unit == "parsec"
        plant["gain"] = 2.0
        plant.initialize()
        plant["u0"] = 3.0
        plant.step(0.1)
        assert plant["y0"] == 6.0


def test_rounding_beyond_either_end_of_a_range_is_clipped(fmi, tmp_path):
    path = build_foreign_fmu(tmp_path / "it.fmu", fmi)
    files = members(path)
    xml = files["modelDescription.xml"].replace(b'start="1.0"', b'start="1.0" min="1" max="1"')
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in (files | {"modelDescription.xml": xml}).items():
            archive.writestr(name, data)
    with Plant(path) as plant:
        plant.initialize()
        for value in (1.0 - 1e-12, 1.0 + 1e-12):
            plant["gain"] = value
            assert plant["gain"] == 1.0


PYTHON_FMU = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real

class Doubler(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u, self.y, self.p = 0.0, 0.0, 1.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))
        self.register_variable(Real("p", causality=Fmi2Causality.parameter, start=1.0))

    def do_step(self, current_time, step_size):
        if self.u < 0.0:
            raise ValueError("u is negative")
        self.y = 2.0 * self.u
        return True
"""


@pytest.mark.medium
def test_fmu_of_pythonfmu_runs_and_fails(tmp_path):
    """With its default variability. Its error reaches the message, and its process ends well."""
    builder = pytest.importorskip("pythonfmu.builder")
    (tmp_path / "doubler.py").write_text(PYTHON_FMU)
    builder.FmuBuilder.build_FMU(tmp_path / "doubler.py", tmp_path)
    code = """
import sys
from plant_fmu import Plant, PlantError
with Plant(sys.argv[1]) as plant:
    plant["p"] = 2.0
    plant.initialize()
    plant["u"] = 4.0
    plant.step(0.1)
    print(plant["y"])
    plant["u"] = -1.0
    try:
        plant.step(0.1)
    except PlantError as error:
        print(error)
"""
    call = [sys.executable, "-c", code, str(tmp_path / "Doubler.fmu")]
    done = subprocess.run(call, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[0] == "8.0" and "u is negative" in done.stdout.splitlines()[1]
