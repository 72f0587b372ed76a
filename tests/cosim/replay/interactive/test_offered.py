"""What an interactive replay offers, before anything is compiled: numbers and their places, and what it refuses."""

import contextlib
import importlib.util
import json
import subprocess
from dataclasses import asdict, replace
from importlib import resources
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from controller import LAWS, LawError
from controller.regions.region_set import shape_entry
from controller.regions.shapes import ENTRIES
from cosim.command_line.cli import main
from cosim.errors import RunError
from cosim.replay.interactive.adjustable import find_slots
from cosim.replay.interactive.data import flight_data
from cosim.replay.interactive.flight import Flight
from cosim.replay.interactive.module import FlightModule, flight_module
from cosim.replay.interactive.scenario_template import scenario_template
from cosim.scenario.changes import with_values
from cosim.scenario.law_factory import law_of
from cosim.scenario.scenario import load_scenario, validate_scenario
from cosim.ssp.memory import Memory, arrays_of
from plant_fmu.errors import BuildError
from tests.cosim.replay.interactive.conftest import NODE

pytestmark = pytest.mark.medium

WATER = ("current.x", "current.y", "current.z", "buoyancy")
THEN = [[6.1, -2.5, 3.2], [5.3, 0.7, 4.1]]


@pytest.fixture(scope="module")
def docking():
    return Flight(load_scenario("docking")), Memory()


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """Return a function that gives what a page's script asks of its worker for other numbers, without a module."""
    if not NODE:
        pytest.skip("node is not installed")

    def ask(flight, memory, values, failure=None):
        made = FlightModule(flight, memory, b"")
        monkeypatch.setattr("cosim.replay.interactive.data.flight_module", lambda _: made)
        data = flight_data(SimpleNamespace(scenario=flight.scenario, folder="run"))
        (tmp_path / "job.json").write_text(json.dumps({"data": data, "values": values, "failure": failure}))
        command = [NODE, Path(__file__).parent / "job.mjs", str(resources.files("cosim.replay") / "assets")]
        done = subprocess.run([*command, tmp_path / "job.json"], capture_output=True, check=True, timeout=60)
        return json.loads(done.stdout)

    return ask


def written(array, memory, job):
    """Return an array of a flight with the numbers that a page asks for."""
    now, first = np.array(array), memory.keep(array)
    for index, value in job[{np.float64: "numbers", np.int64: "integers"}[array.dtype.type]]:
        if first <= index < first + array.size:
            now.ravel()[index - first] = np.nan if value is None else value
    return now


def same(one, other):
    return one.shape == other.shape and np.array_equal(one, other, equal_nan=one.dtype == np.float64)


def shapes():
    """Return each kind of shape as a table of a scenario, and a prism whose corners are packed in the reverse order."""
    tables = {name: {"type": name} | asdict(entry.example) for name, entry in ENTRIES.items()}
    return tables | {"reversed prism": tables["prism"] | {"corners": tables["prism"]["corners"][::-1]}}


def flight_of(name, overrides=(), **table):
    scenario = load_scenario(name, overrides)
    return Flight(validate_scenario(scenario.table | table, name, scenario.vehicle))


def regions_of_every_shape():
    traits = {"criterion": "shape", "keep": "out", "gain": 1.0, "hard": False}
    return [{"name": name, "shape": shape} | traits for name, shape in shapes().items()]


FLIGHTS = {
    **{law: lambda law=law: flight_of("docking", [f"law.name={law}"]) for law in LAWS},
    **{name: lambda name=name: flight_of(name)
       for name in ("harbour", "depth-transit", "pipe-inspection", "pile-inspection")},
    "wrench": lambda: flight_of("paper", ["arbiter.engine=closed"]),
    "every shape": lambda: flight_of("docking", regions=regions_of_every_shape(), intersection=[]),
    **{f"goals, {name}": lambda shape=shape: flight_of("docking", goal=shape | {"then": THEN})
       for name, shape in shapes().items() if name not in ("orientation", "visibility", "mesh", "points")},
    "goals, mesh": lambda: flight_of("docking", goal=shapes()["mesh"] | {"then": THEN, "offset": -0.2}),
}  # fmt: skip


@pytest.mark.parametrize("case", FLIGHTS)
def test_numbers_that_a_page_writes_are_those_of_the_changed_scenario(case, asked):
    """Everything else stays: no number that is offered enters a computation before the flight."""
    flight, memory = FLIGHTS[case](), Memory()
    slots, moves = find_slots(flight, memory)
    moved = {key: axis for axes in moves if axes for axis, keys in enumerate(axes) for key in keys}
    changes = {  # a region moves as a whole, by steps that leave the length of a cylinder
        slot.key: slot.value + (2.0 ** (moved[slot.key] - 8) if slot.key in moved else 1.3e-4 * (i + 1))
        for i, slot in enumerate(slots)
    }
    table = with_values(flight.scenario.table, changes)
    other = Flight(validate_scenario(table, flight.scenario.name, flight.scenario.vehicle))
    job = asked(flight, memory, changes)
    kept = set()
    for array, changed in zip(*(arrays_of((of.fly, of.control)) for of in (flight, other)), strict=True):
        is_center = array is flight.model.goal_center or array is flight.data.goal_center
        if is_center and shape_entry(flight.scenario.goal).center is None:
            continue  # rounds displacements in the record of a moving goal alone
        is_kept = array.dtype == np.float64 and array is not flight.noise and array is not flight.rows
        got = written(array, memory, job) if is_kept else array
        # points of rings are sums, whose order is another one in the page
        assert same(got, changed) or (array is flight.model.mission.centers and np.abs(got - changed).max() < 1e-12)
        if is_kept:
            kept |= set(range(memory.keep(array), memory.keep(array) + array.size))
    assert {index for index, _ in job["numbers"]} <= kept
    gains = dict(map(tuple, job["gains"]))
    assert [gains[i] for i in range(len(gains))] == list(other.law.gains)
    starts = flight.start | {name: dict(map(tuple, job["starts"]))[flight.reference(name)] for name in WATER}
    assert starts == other.start
    sensing = other.scenario.sensing
    assert job["noise"] == [sensing.position_noise, sensing.velocity_noise]


def test_gains_water_noise_and_positions_are_adjustable(docking):
    flight, _ = docking
    slots, moves = find_slots(*docking)
    keys = {slot.key for slot in slots}
    assert keys > {f"law.gains.{name}" for name in flight.scenario.law.gains._fields}
    assert keys > {"plant.current.0", "plant.parameters.buoyancy", "sensing.position_noise", "sensing.velocity_noise"}
    names = ["goal", *(secondary.region.name for secondary in flight.scenario.regions)]
    assert [name for name, axes in zip(names, moves, strict=True) if axes is None] == ["heading"]


@pytest.mark.parametrize("name", LAWS)
def test_laws_compute_nothing_from_gains_before_their_steps(name):
    """A page would change the gain, and not the number that the law has computed from it."""
    scenario = load_scenario("docking", [f"law.name={name}"])
    usual = law_of(scenario)
    for gain, value in usual.gains._asdict().items():
        changed = usual.gains._replace(**{gain: 0.5 * value + 0.01})
        with contextlib.suppress(LawError):  # the law refuses the value
            law = law_of(replace(scenario, law=replace(scenario.law, gains=changed)))
            assert law.gains == changed
            assert [a.tobytes() for a in arrays_of(law.memory)] == [a.tobytes() for a in arrays_of(usual.memory)]


def test_regions_of_every_shape_with_a_position_are_movable():
    numbers = {"cylinder": 6, "pipe": 9, "prism": 12, "reversed prism": 12, "depth_band": 1, "orientation": 0}
    slots, moves = find_slots(flight_of("docking", regions=regions_of_every_shape(), intersection=[]), Memory())
    assert [sum(map(len, axes or ())) for axes in moves[1:]] == [numbers.get(name, 3) for name in shapes()]
    assert {slot.key for slot in slots} >= {key for axes in moves if axes for keys in axes for key in keys}


@pytest.mark.parametrize("time", [0.5, 2.0, 9.0])
@pytest.mark.parametrize("law", ["pd", "deployable"])
def test_added_failure_is_that_of_a_scenario_with_it(law, time, asked):
    own = [{"thruster": 2, "time": 3.0}, {"thruster": 5, "time": 1.0, "stuck": True}]
    own.append({"thruster": 7, "time": 2.0, "effectiveness": 0.4})
    failures, settings = [own, [*own, {"thruster": 3, "time": time}]], ["report_failures=true", f"law.name={law}"]
    flight, other = (flight_of("docking", settings, failures=of) for of in failures)
    memory = Memory()
    job = asked(flight, memory, {}, {"thruster": 3, "time": time})
    for name in ("failed", "failure_steps", "remaining"):
        assert same(written(getattr(flight.model, name), memory, job), getattr(other.model, name)[:-1]), name
    if flight.model.law_gives_wrench:
        for name in ("inverse", "lower", "upper"):
            mine, theirs = getattr(flight.data.allocator, name), getattr(other.data.allocator, name)
            assert len(theirs) == 5 and same(written(mine, memory, job), theirs[:-1]), name


def test_filled_template_equals_the_scenario(docking, tmp_path):
    flight, slots = docking[0], find_slots(*docking)[0]
    template, values = scenario_template(flight.scenario, slots), {slot.key: repr(slot.value) for slot in slots}
    filled = [values.get(key, '"Again"') for key in template["keys"]]
    parts = [part for pair in zip(template["parts"], [*filled, ""], strict=True) for part in pair]
    (tmp_path / "again.toml").write_text("".join(parts))
    again = load_scenario(tmp_path / "again.toml")
    assert again.title == "Again"
    assert again.table | {"title": ""} == flight.scenario.table | {"title": ""}


@pytest.mark.parametrize(
    ("name", "changes", "said"),
    [
        ("paper", [], "arbiter.engine is 'skfuzzy', expected 'closed' for an interactive replay"),
        (
            "docking",
            ["master.order=jacobi"],
            "master.order is 'jacobi', expected 'gauss-seidel' for an interactive replay",
        ),
        ("docking", ["plant.fmi=2"], "plant.fmi is 2, expected 3 for an interactive replay"),
        ("docking", ["commands.enabled=true"], "commands.enabled is True, expected False for an interactive replay"),
    ],
)
def test_unsupported_scenarios_are_rejected_by_key(name, changes, said):
    with pytest.raises(RunError, match=said):
        Flight(load_scenario(name, changes))


def test_several_runs_are_rejected_without_a_file(tmp_path, capsys):
    assert main(["report", "--replay", "one", "other", "--interactive", "--out", str(tmp_path / "page.html")]) != 0
    assert "2 runs, expected one for an interactive replay" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_missing_webassembly_compiler_error_names_the_install_command(monkeypatch, tmp_path):
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *_: str(tmp_path))
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *rest: None if name == "ziglang" else found(name, *rest)
    )
    with pytest.raises(BuildError, match=r"pip install .*ziglang"):
        flight_module(load_scenario("docking", ["time.duration=0.1"]))


def test_imported_log_is_rejected():
    run = SimpleNamespace(folder="dive", scenario=SimpleNamespace(log="dive.tlog"))
    with pytest.raises(RunError, match=r"imported from dive\.tlog"):
        flight_data(run)
