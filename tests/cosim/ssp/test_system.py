"""A scenario as a system of FMUs: the same run in independent masters as in Jacobi order here."""

import io
import re
import shlex
import zipfile
from importlib import resources
from pathlib import Path

import fmpy.ssp
import numpy as np
import pytest
from fmpy.ssp.ssd import get_connections, read_ssd
from lxml import etree

from cosim.command_line.cli import main
from cosim.errors import RunError
from cosim.scenario.scenario import load_scenario
from cosim.simulation.make_step import STREAM
from cosim.simulation.master import Master
from cosim.ssp import package_system
from cosim.ssp.system import MOTION
from plant_fmu.running.co_simulation_instance import CoSimulationInstance
from tests.cosim.scenario.test_criteria import RULES, SCENARIO
from tests.cosim.ssp.masters import fmpy as run_in_fmpy
from tests.cosim.ssp.masters import in_master
from tests.cosim.ssp.noise import Noise

ROOT = Path(__file__).parents[3]
ALL_SHAPES = Path(__file__).parent / "all-shapes.toml"
CLOSED = "arbiter.engine=closed"
TEN_MS = [CLOSED, "time.step=0.01", "time.control=0.01", "time.arbiter=0.01"]


@pytest.fixture(scope="module")
def packed(tmp_path_factory):
    """The system of every shape of region, FMI 2.0."""
    return package_system(load_scenario(ALL_SHAPES), tmp_path_factory.mktemp("ssp") / "all.ssp")


@pytest.mark.slow
def test_a_master_with_another_step_is_warned(packed, capfd):
    """In FMPy, which prints the log of FMUs; the scenario has a step of 10 ms, the law a period of 30 ms."""
    run_in_fmpy(packed, 20, 0.02)
    warnings = [line for line in capfd.readouterr().out.splitlines() if "late" in line]
    assert len(warnings) == 1
    assert "the law runs at t = 0.04 s, 0.01 s late: steps do not divide time.control = 0.03 s" in warnings[0]
    run_in_fmpy(packed, 20, 0.01)
    assert "late" not in capfd.readouterr().out


class Motion:
    """Position, quaternion and velocity before each step and after the last."""

    def __init__(self, signals):
        self.at, self.rows = [signals.index(name) for name in MOTION], []

    def observe(self, k, row):
        self.rows.append(row[self.at])


def jacobi(name, settings=()):
    """Fly a scenario in our own master in Jacobi's order, with the packaged controller's noise in place of NumPy's."""
    scenario, numpys = load_scenario(name, [*settings, "master.order=jacobi"]), np.random.default_rng
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(np.random, "default_rng", lambda seed: Noise(seed[0]) if seed[1] == STREAM else numpys(seed))
        master = Master(scenario)
    with master:
        motion = Motion(master.signals)
        master.run([motion])
    return np.array(motion.rows)


def compared(ours, theirs):
    np.testing.assert_allclose(theirs, ours[1:], rtol=0.0, atol=1e-10)


@pytest.mark.medium
def test_fmpy_simulation_equals_own_run(packed):
    """With every shape, regions and goal on the move, a current, a lag, and three periods."""
    scenario = load_scenario(ALL_SHAPES)
    ours = jacobi(ALL_SHAPES)
    assert np.linalg.norm(ours[-1, :3] - ours[0, :3]) > 0.5
    compared(ours, run_in_fmpy(packed, scenario.steps, scenario.time.step))


@pytest.mark.slow
def test_documentation_example_runs(tmp_path, monkeypatch, capsys):
    text = (ROOT / "docs" / "ssp.md").read_text()
    command, code = re.search(r"```sh\ncosim (.*?)```", text, re.S)[1], re.search(r"```python\n(.*?)```", text, re.S)[1]
    monkeypatch.chdir(tmp_path)
    assert main(shlex.split(command.replace("\\\n", " "))) == 0
    names = {}
    exec(code, names)
    assert len(names["result"]) == 3000
    assert names["result"]["plant.position.z"][-1] == pytest.approx(6.2665, abs=1e-3)


def assert_system_flies_as_the_run(name, settings, tmp_path, master="fmpy", fmi=2):
    scenario = load_scenario(name, settings)
    path = package_system(scenario, tmp_path / "s.ssp", fmi)
    compared(jacobi(name, settings), in_master(master, path, scenario.steps, scenario.time.step, tmp_path / "rows.npy"))
    return path


# with noise, delays, lost samples and outliers of the data sheets, two outages and a failed thruster
ON_SENSORS = [
    "sensing.through=sensors", "sensing.position_noise=0", "sensing.velocity_noise=0", "sensing.seed=4",
    "outages=[{sensor='dvl', time=1.0, duration=1.5}, {sensor='usbl', time=2.015, duration=9.0}]",
    "failures=[{thruster=3, time=2.0}]", "time.duration=6.0",
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("master", "fmi"), [("fmpy", 2), ("ecos", 2), ("ecos", 3), ("libcosim", 2), ("oms", 2)])
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        *((name, [*TEN_MS, "time.duration=30.0"]) for name in ("paper", "paper-limited")),
        *((name, []) for name in ("docking", "pipe-inspection", "inspection-visibility")),
        ("harbour", ["time.duration=60.0"]),
        ("docking", ON_SENSORS),
    ],
    ids=["paper", "paper-limited", "docking", "pipe-inspection", "inspection-visibility", "harbour", "sensors"],
)
def test_masters_reproduce_shipped_scenarios(name, settings, master, fmi, tmp_path):
    """The laws on wrench and thrusters, noise, regions on the move, four criteria: whole runs, of harbour a minute."""
    # in the first step FMPy's connectors are 0, those of the others hold the plant's first outputs
    assert_system_flies_as_the_run(name, settings, tmp_path, master, fmi)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("paper", [*TEN_MS, "law.name='antonelli'"]),
        ("paper", [*TEN_MS, "law.name='sun_cheah'"]),
        ("paper", [*TEN_MS, "law.name='unarbitrated'", "actuation.through='thrusters'"]),
        ("docking", ["law.name='pd'", "sensing.dead_from=0.5", "sensing.dead_for=0.3", "sensing.frozen=true"]),
        # its yaw swings up, and with it what is rounded: by 9 % a step, above 1e-10 after 1.2 s
        ("docking", ["law.name='pid_cbf'", "time.duration=1.0"]),
        ("docking", ["sensing.dead_from=0.5", "sensing.dead_for=0.3"]),
        ("pile-inspection", ["initial.position=[5.7, 0.0, 3.0]", "goal.stay=0.2", "goal.then.0.tolerance=0.3"]),
        ("docking", ["goal.then=[[6.5, -3.0, 3.0]]", "goal.stay=0.2", "goal.center=[6.8, -3.0, 3.0]"]),
    ],
)
def test_every_law_equals_its_python_run(name, settings, tmp_path):
    assert_system_flies_as_the_run(name, ["time.duration=2.0", *settings], tmp_path)


# ---- the file ----


def test_system_description_is_valid_and_matches_its_fmus(packed, tmp_path):
    with zipfile.ZipFile(packed) as archive:
        archive.extractall(tmp_path)
    schema = Path(fmpy.ssp.__file__).parent / "schema" / "SystemStructureDescription.xsd"
    etree.XMLSchema(etree.parse(schema)).assertValid(etree.parse(tmp_path / "SystemStructure.ssd"))
    (experiment,) = etree.parse(tmp_path / "SystemStructure.ssd").iterfind("{*}DefaultExperiment")
    assert dict(experiment.attrib) == {"startTime": "0.0", "stopTime": "2.0"}
    described = read_ssd(str(packed))
    for component in described.system.elements:
        model = fmpy.read_model_description(str(tmp_path / component.source))
        variables = {v.name: v for v in model.modelVariables}
        for connector in component.connectors:
            assert variables[connector.name].causality == connector.kind
        shown = {connector.name for connector in component.connectors}
        if component.name != "plant":  # whose thrusters nobody drives here
            assert {v.name for v in model.modelVariables if v.causality == "input"} <= shown
    ends = [end for _, end in get_connections(described.system)]
    inputs = [c for component in described.system.elements for c in component.connectors if c.kind == "input"]
    assert len(ends) == len(inputs) == 13 + 6 + 3 + 3  # each once


def test_connected_variables_have_equal_units(packed):
    with zipfile.ZipFile(packed) as archive:
        root = etree.fromstring(archive.read("SystemStructure.ssd"))
    ns = {"ssd": root.nsmap["ssd"], "ssc": root.nsmap["ssc"]}
    units = {
        (component.get("name"), connector.get("name")): connector.find("ssc:Real", ns).get("unit")
        for component in root.iterfind(".//ssd:Component", ns)
        for connector in component.iterfind(".//ssd:Connector", ns)
    }
    for c in root.iterfind(".//ssd:Connection", ns):
        ends = [(c.get(f"{end}Element"), c.get(f"{end}Connector")) for end in ("start", "end")]
        assert units[ends[0]] == units[ends[1]], ends
    defined = {unit.get("name") for unit in root.iterfind("./ssd:Units/ssc:Unit", ns)}
    assert {unit for unit in units.values() if unit} == defined


def test_plant_start_values_match_the_scenario(packed, tmp_path):
    with zipfile.ZipFile(packed) as archive:
        archive.extract("resources/plant.fmu", tmp_path)
    with CoSimulationInstance(tmp_path / "resources" / "plant.fmu") as plant:
        plant.initialize()
        got = {name: plant[name] for name in ("position.x", "quaternion.e2", "velocity.u", "current.y", "weight")}
        assert got == {"position.x": 0.5, "quaternion.e2": 0.6, "velocity.u": 0.1, "current.y": -0.05, "weight": 1230.0}
        assert plant["wrench_force_limit"] == 200.0 and plant["seed"] == 7 and plant["free_surface"] is True


def test_package_is_reproducible_and_holds_no_python(packed, tmp_path):
    again = package_system(load_scenario(ALL_SHAPES), tmp_path / "again.ssp")
    assert again.read_bytes() == packed.read_bytes()
    with zipfile.ZipFile(packed) as archive:
        names = archive.namelist()
        for name in names:
            if name.endswith(".fmu"):
                names += zipfile.ZipFile(io.BytesIO(archive.read(name))).namelist()
    assert not [name for name in names if ".py" in name]


def test_packaged_scenario_reproduces_the_package(packed, tmp_path):
    with zipfile.ZipFile(packed) as archive:
        inner = tmp_path / "all-shapes.toml"
        inner.write_bytes(archive.read("documentation/scenario.toml"))
    assert package_system(load_scenario(inner), tmp_path / "again.ssp").read_bytes() == packed.read_bytes()


@pytest.mark.slow
def test_custom_vehicle_is_packaged(packed, tmp_path):
    shipped = resources.files("plant_fmu") / "vehicles" / "odin.toml"
    (tmp_path / "mine.toml").write_text(shipped.read_text().replace('name = "odin"', 'name = "mine"'))
    scenario = load_scenario(ALL_SHAPES, [f"vehicle='{tmp_path / 'mine.toml'}'"])
    with zipfile.ZipFile(package_system(scenario, tmp_path / "mine.ssp")) as archive:
        archive.extractall(tmp_path / "out")
    assert str(tmp_path) not in (tmp_path / "out" / "documentation" / "scenario.toml").read_text()
    again = load_scenario(tmp_path / "out" / "documentation" / "scenario.toml")
    assert again.vehicle.name == scenario.vehicle.name


# ---- what it cannot be ----


@pytest.mark.parametrize(
    ("name", "changes", "said"),
    [
        ("paper", [], "arbiter.engine is 'skfuzzy', expected 'closed' or 'exact'"),
        ("paper", [CLOSED, "commands.enabled=true"], "commands.enabled is true, expected false"),
        ("paper", [CLOSED, "goal.streamed=true"], "goal.streamed is true, expected false"),
        ("paper", [CLOSED, "regions.SR2.streamed=true"], "regions.SR2.streamed is true, expected false"),
    ],
)
def test_unsupported_scenario_is_rejected_by_key(name, changes, said, tmp_path):
    with pytest.raises(RunError) as caught:
        package_system(load_scenario(name, changes), tmp_path / "s.ssp")
    assert str(caught.value).startswith(said)
    assert not list(tmp_path.iterdir())


def test_step_that_does_not_divide_a_period_is_rejected(tmp_path, capsys):
    out = tmp_path / "s.ssp"
    assert main(["export", "--to", "ssp", str(ALL_SHAPES), "--set", "time.step=0.02", "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert "time.control" in said and "a whole multiple of time.step (0.02 s)" in said and said.count("\n") == 1
    assert not out.exists()


# ---- the command ----


def test_package_command_writes_the_system(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["export", str(ALL_SHAPES), "--to", "ssp"]) == 0
    assert capsys.readouterr().out == "all-shapes.ssp\n"
    assert zipfile.is_zipfile("all-shapes.ssp")


def test_package_command_reports_errors_in_one_line(tmp_path, capsys):
    out = tmp_path / "nowhere" / "s.ssp"
    assert main(["export", "--to", "ssp", str(ALL_SHAPES), "--out", str(out)]) == 2
    assert "nowhere" in capsys.readouterr().err
    assert main(["export", "--to", "ssp", "paper", "--out", str(tmp_path / "s.ssp")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "arbiter.engine" in said
    assert not list(tmp_path.iterdir())


CRITERIA = 'criteria=[{name="obstacle"},{name="depth",order=0},{name="shape"},{name="visibility"}]'


@pytest.mark.slow
def test_a_system_has_as_many_criteria_as_the_scenario(tmp_path):
    path = assert_system_flies_as_the_run(ALL_SHAPES, ["time.duration=0.5", CRITERIA], tmp_path)
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(io.BytesIO(archive.read("resources/arbiter.fmu"))) as fmu:
        described = fmu.read("modelDescription.xml").decode()
    assert re.findall(r'name="weight\.(\w+)"', described) == ["depth", "obstacle", "shape", "visibility"]


@pytest.mark.slow
def test_custom_memberships_and_rules_are_packaged(tmp_path):
    """With inputs that are no memberships: a clearance, a speed, the time and such."""
    (tmp_path / "mine.toml").write_text(RULES)
    (tmp_path / "scenario.toml").write_text(SCENARIO)
    assert_system_flies_as_the_run(tmp_path / "scenario.toml", ["time.duration=1.0"], tmp_path)
