"""What a page that flies offers, before anything is compiled: numbers and their places, and what it refuses."""

import importlib.util
from types import SimpleNamespace

import numpy as np
import pytest

from cosim.command_line.cli import main
from cosim.errors import RunError
from cosim.replay.interactive.adjustable import changed_scenario, find_slots
from cosim.replay.interactive.data import flight_data
from cosim.replay.interactive.flight import Flight
from cosim.replay.interactive.module import flight_module
from cosim.replay.interactive.scenario_template import scenario_template
from cosim.replay.interactive.sources import flight_sources
from cosim.scenario.scenario import load_scenario
from cosim.simulation.environment import shape_center
from cosim.ssp.memory import Memory
from plant_fmu.errors import BuildError

pytestmark = pytest.mark.medium


@pytest.fixture(scope="module")
def docking():
    flight, memory = Flight(load_scenario("docking")), Memory()
    flight_sources(flight, memory, "token")
    return flight, memory, *find_slots(flight, memory)


def test_gains_water_noise_and_positions_are_adjustable(docking):
    flight, _, slots, moves = docking
    keys = {slot.key for slot in slots}
    assert keys > {f"law.gains.{name}" for name in flight.scenario.law.gains._fields}
    assert keys > {"plant.current.0", "plant.parameters.buoyancy", "sensing.position_noise", "sensing.velocity_noise"}
    names = ["goal", *(secondary.region.name for secondary in flight.scenario.regions)]
    assert [name for name, axes in zip(names, moves, strict=True) if axes is None] == ["heading"]


def test_values_in_memory_equal_those_of_the_changed_scenario(docking):
    flight, memory, slots, _ = docking
    changes = {slot.key: slot.value + 1.3e-4 * (i + 1) for i, slot in enumerate(slots)}
    other = Flight(changed_scenario(flight.scenario, changes))
    numbers = {place: changes[slot.key] for slot in slots for kind, place in slot.places if kind == "number"}
    seen = set()
    for array, changed in zip(flight.arrays(), other.arrays(), strict=True):
        if array.dtype == np.float64 and array.size and not memory.is_named(array):
            at = memory.keep(array)
            put = [numbers.get(at + i, x) for i, x in enumerate(array.ravel())]
            seen |= {at + i for i in range(array.size)} & numbers.keys()
            np.testing.assert_array_equal(put, changed.ravel())
    assert seen == numbers.keys() and len(seen) >= 18
    gains = {place: changes[slot.key] for slot in slots for kind, place in slot.places if kind == "gain"}
    assert [gains[i] for i in range(len(gains))] == list(other.law.gains)


def test_a_cylinder_moves_by_its_middle():
    """The law is given middle, axis and half length, of which the last two stay when both ends move by the same."""
    ends = "type = 'cylinder', start = [9,5.1,1], end = [9,5.1,6], radius = 0.3"
    cylinder = f"{{name = 'leg', criterion = 'obstacle', keep = 'out', gain = 100.0, shape = {{{ends}}}}}"
    flight, memory = Flight(load_scenario("docking", [f"regions=[{cylinder}]", "intersection=[]"])), Memory()
    flight_sources(flight, memory, "token")
    slots, moves = find_slots(flight, memory)
    path = "regions.0.shape"
    assert moves[1] == tuple((f"{path}.start.{axis}", f"{path}.end.{axis}") for axis in range(3))
    changes = {slot.key: slot.value + 0.34 for slot in slots if slot.key.startswith(path) and slot.key[-1] == "1"}
    other = Flight(changed_scenario(flight.scenario, changes))
    places = {place for slot in slots if slot.key in changes for kind, place in slot.places if kind == "middle"}
    assert len(changes) == 2
    differs = set()
    for array, changed in zip(flight.arrays(), other.arrays(), strict=True):
        if array.dtype == np.float64 and array.size and not memory.is_named(array):
            at = memory.keep(array) + np.flatnonzero((array != changed).ravel() & ~np.isnan(array).ravel())
            differs |= set(at.tolist())
            assert (changed.ravel()[at - memory.keep(array)] == sum(changes.values()) / 2.0).all()
    assert differs == places and len(places) >= 1


@pytest.mark.parametrize(
    ("shape", "movable"),
    [("type='box', center=[7.1,0.1,4], size=[1,2,1], quaternion=[0.9,0.1,0,0.4]", True),
     ("type='ellipsoid', center=[7.1,0.3,4], semi_axes=[0.3,0.7,1.1]", True),
     ("type='cylinder', start=[7.1,0,3], end=[7.2,0,5], radius=0.7", True),
     ("type='prism', corners=[[6,-1],[8,-1],[8,1],[6,2]], top=3, bottom=5", False)],
    ids=["box", "ellipsoid", "cylinder", "prism"],
)  # fmt: skip
def test_each_place_of_goals_in_turn_is_offered(shape, movable):
    """The loop is given differences to the goal's center, which the page computes from both keys to the last bit."""
    goal = f"goal={{{shape}, then=[[6.1,-2.5,3.2],[5.3,0.7,4.1]]}}"
    flight, memory = Flight(load_scenario("docking", [goal])), Memory()
    flight_sources(flight, memory, "token")
    slots, moves = find_slots(flight, memory)
    assert (moves[0] is not None) == movable
    changes = {s.key: s.value + 0.0137 * (i + 1) for i, s in enumerate(slots) if s.key.startswith("goal.")}
    assert len(changes) == 6 + (sum(map(len, moves[0])) if movable else 0)
    changed = Flight(changed_scenario(flight.scenario, changes)).setup.goal_places.ravel()
    ends = [[changes.get(f"goal.{end}.{axis}", 0.0) for axis in range(3)] for end in ("start", "end")]
    middle = [(a + b) / 2.0 for a, b in zip(*ends, strict=True)] if any(map(any, ends)) else [None] * 3
    center = [changes.get(f"goal.center.{axis}", middle[axis]) for axis in range(3)]
    center = [x if x is not None else y for x, y in zip(center, shape_center(flight.scenario.goal), strict=True)]
    places = {
        place: changes[s.key] - center[int(s.key[-1])] for s in slots for kind, place in s.places if kind == "shift"
    }
    assert [places[memory.keep(flight.setup.goal_places) + i] for i in range(6)] == changed.tolist()


def test_filled_template_equals_the_scenario(docking, tmp_path):
    flight, _, slots, _ = docking
    template, values = scenario_template(flight.scenario, slots), {slot.key: repr(slot.value) for slot in slots}
    filled = [values.get(key, '"Again"') for key in template.keys]
    parts = [part for pair in zip(template.parts, [*filled, ""], strict=True) for part in pair]
    (tmp_path / "again.toml").write_text("".join(parts))
    again = load_scenario(tmp_path / "again.toml")
    assert again.title == "Again"
    assert again.table | {"title": ""} == flight.scenario.table | {"title": ""}


@pytest.mark.parametrize(
    ("name", "changes", "said"),
    [
        ("paper", [], "arbiter.engine is 'skfuzzy', expected 'closed' for a page that flies"),
        ("docking", ["master.order=jacobi"], "master.order is 'jacobi', expected 'gauss-seidel' for a page that flies"),
        ("docking", ["plant.fmi=2"], "plant.fmi is 2, expected 3 for a page that flies"),
        ("docking", ["commands.enabled=true"], "commands.enabled is True, expected False for a page that flies"),
    ],
)
def test_unsupported_scenarios_are_rejected_by_key(name, changes, said):
    with pytest.raises(RunError, match=said):
        Flight(load_scenario(name, changes))


def test_several_runs_are_rejected_without_a_file(tmp_path, capsys):
    assert main(["report", "--replay", "one", "other", "--interactive", "--out", str(tmp_path / "page.html")]) != 0
    assert "2 runs, expected one for a page that flies" in capsys.readouterr().err
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
        flight_data(run, ())
