"""Systems of FMUs that are run, and written as one FMU: those of scenarios, and others with each part of SSP."""

import sys
import zipfile

import fmpy
import numpy as np
import pyarrow.parquet as pq
import pytest
from mcap.reader import make_reader

from cosim.command_line.cli import main
from cosim.errors import RunError
from cosim.run.run_system import run_system
from cosim.ssp.system import MOTION
from cosim.ssp.system_description import read_system
from plant_fmu.archive import write_archive
from plant_fmu.errors import FmuFileError
from tests.cosim.ssp.test_system import TEN_MS, jacobi
from tests.foreign_fmu import MODES, build_foreign_fmu

SHORT = [*TEN_MS, "time.duration=3.0"]
ARGUMENTS = [f"--set={change}" for change in SHORT]


@pytest.mark.medium
def test_a_scenario_as_a_system_and_as_one_fmu_has_the_bits_of_its_run(tmp_path, monkeypatch, capsys):
    """All outputs of the three FMUs are those of Jacobi's order, in our master and in FMPy with the one FMU."""
    monkeypatch.chdir(tmp_path)
    assert main(["export", "paper", *ARGUMENTS, "--to", "ssp"]) == 0
    assert main(["run", "paper.ssp", "--out", "run"]) == 0
    record = pq.read_table("run/record.parquet")
    ours = np.transpose([record[f"plant.{name}"] for name in MOTION])
    np.testing.assert_array_equal(ours, jacobi("paper", SHORT))
    for fmi, source in ((2, ["paper", *ARGUMENTS]), (3, ["paper.ssp"])):
        assert main(["export", *source, "--to", "fmu", "--fmi", str(fmi), "--out", "one.fmu", "--force"]) == 0
        outputs = record.column_names[1:]
        rows = fmpy.simulate_fmu("one.fmu", stop_time=3.0, step_size=0.01, output_interval=0.01, output=outputs)
        assert len(rows) == len(record) and {"controller.goal.clearance", "arbiter.weight.depth"} <= {*outputs}
        for name in outputs:
            np.testing.assert_array_equal(rows[name], record[name], name)
    capsys.readouterr()
    monkeypatch.setitem(sys.modules, "fmu_manipulation_toolbox.container", None)
    monkeypatch.setitem(sys.modules, "fmu_manipulation_toolbox", None)
    assert main(["export", "paper.ssp", "--to", "fmu", "--out", "none.fmu"]) == 2
    message = capsys.readouterr().err
    assert "the extra container" in message and "pip install" in message and message.count("\n") == 1


# ---- systems of others ----

SSD = """<?xml version="1.0"?>
<SystemStructureDescription xmlns="http://ssp-standard.org/SSP1/SystemStructureDescription" version="1.0" name="two"
 xmlns:c="http://ssp-standard.org/SSP1/SystemStructureCommon" xmlns:v="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
 xmlns:m="http://ssp-standard.org/SSP1/SystemStructureParameterMapping">
<System name="root"><Connectors><Connector name="k" kind="parameter"><c:Real/></Connector></Connectors>
<ParameterBindings><ParameterBinding source="set.ssv"/></ParameterBindings>
<Elements>
<Component name="first" source="first.fmu" type="application/x-fmu-sharedlibrary"><Connectors>
<Connector name="u" kind="input"><c:Real unit="m"/></Connector>
<Connector name="y" kind="output"><c:Real unit="m"/></Connector>
</Connectors></Component>
<System name="inner"><Connectors><Connector name="in" kind="input"><c:Real unit="km"/></Connector>
<Connector name="out" kind="output"><c:Real/></Connector></Connectors>
<ParameterBindings><ParameterBinding><ParameterValues><v:ParameterSet version="1.0" name="s"><v:Parameters>
<v:Parameter name="second.gain"><v:Real value="-1.0"/></v:Parameter></v:Parameters></v:ParameterSet></ParameterValues>
</ParameterBinding></ParameterBindings>
<Elements><Component name="second" source="./first.fmu"><Connectors>
<Connector name="u" kind="input"><c:Real/></Connector>
<Connector name="y" kind="output"><c:Real/></Connector></Connectors></Component></Elements>
<Connections><Connection startConnector="in" endElement="second" endConnector="u"/>
<Connection startElement="second" startConnector="y" endConnector="out"/></Connections></System>
</Elements>
<Connections><Connection startElement="first" startConnector="y" endElement="inner" endConnector="in"/>
<Connection startElement="inner" startConnector="out" endElement="first" endConnector="u">
<c:LinearTransformation factor="500.0" offset="1.0"/></Connection></Connections></System>
<Units><c:Unit name="m"><c:BaseUnit m="1"/></c:Unit><c:Unit name="km"><c:BaseUnit m="1" factor="1000"/></c:Unit></Units>
<DefaultExperiment startTime="0.0" stopTime="0.5"/></SystemStructureDescription>"""
SSV = """<s:ParameterSet xmlns:s="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" name="set">
<s:Parameters><s:Parameter name="first.gain"><s:Real value="3.0"/></s:Parameter>
<s:Parameter name="first.mode"><s:Real value="0"/></s:Parameter>
<s:Parameter name="first.at"><s:Real value="0.2"/></s:Parameter></s:Parameters></s:ParameterSet>"""
MAPPING = """BooleanMappingTransformation><c:MapEntry source="true" target="true"/></c:BooleanMappingTransformation"""
BUS = '<Elements><SignalDictionaryReference name="bus" dictionary="d"/>'
STEP = ["time.step=0.1"]


@pytest.fixture(scope="module")
def gain(once):
    """Return an FMU whose output is a gain times its input."""

    def make(folder):
        build_foreign_fmu(folder / "gain.fmu", 2, inputs={"u": 10}, outputs={"y": 20})

    return (once("gain", make) / "gain.fmu").read_bytes()


def write_system(path, gain, ssd=SSD, ssv=SSV):
    write_archive(path, {"SystemStructure.ssd": ssd.encode(), "set.ssv": ssv.encode(), "first.fmu": gain})
    return path


@pytest.mark.medium
def test_systems_in_systems_units_and_parameters(gain, tmp_path):
    """Two gains in a circle, through kilometers, a linear transformation and the connectors of a system."""
    run = run_system(write_system(tmp_path / "two.ssp", gain), tmp_path / "run", STEP)
    record, summary = pq.read_table(run.folder / "record.parquet"), run.summary
    first, second = [3.0], [0.0]  # the offset of the second line reaches the first FMU while all of them initialize
    for _ in range(5):
        first, second = [*first, 3.0 * (500.0 * second[-1] + 1.0)], [*second, -1.0 * first[-1] / 1000.0]
    np.testing.assert_allclose(record["first.y"], first, rtol=1e-15)
    np.testing.assert_allclose(record["inner.second.y"], second, rtol=1e-15)
    assert (summary["status"], summary["steps"], summary["system"]) == ("completed", 5, "two")
    page = (run.folder / "report.html").read_text()
    assert all(part in page for part in ("figures/first-1.svg", "figures/inner.second-1.svg", "completed: 5 steps"))
    assert "<td>first.y</td><td>0.001</td>" in page


def test_a_run_is_exported_and_reported_again_as_far_as_it_has_no_vehicle(gain, tmp_path, capsys, monkeypatch):
    """Also a killed one, without summary and figures."""
    monkeypatch.chdir(tmp_path)
    run_system(write_system(tmp_path / "two.ssp", gain), tmp_path / "run", STEP, report=False)
    (tmp_path / "run" / "summary.json").unlink()
    assert main(["report", "run", "--format", "html,png"]) == 0
    assert "killed: 5 steps" in (tmp_path / "run" / "report.html").read_text()
    assert (tmp_path / "run" / "figures" / "first-1.png").stat().st_size > 1000
    assert main(["export", "run", "--to", "csv", "--signals", "first.*"]) == 0
    assert main(["export", "run", "--to", "mcap"]) == 0
    assert (tmp_path / "run.csv").read_text().splitlines()[:2] == ["time,first.y", "0.0,3.0"]
    with (tmp_path / "run.mcap").open("rb") as file:
        assert make_reader(file).get_summary().statistics.message_count == 3 * 6
    capsys.readouterr()
    for arguments in (
        ["export", "run", "--to", "tlog"],
        ["export", "run", "--to", "rrd"],
        ["report", "run", "--replay"],
    ):
        assert main(arguments) == 2
        message = capsys.readouterr().err
        assert (
            "run: holds a run of a system of FMUs, which has no known vehicle" in message and message.count("\n") == 1
        )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('source="first.fmu"', 'source="../first.fmu"', "first: source is '../first.fmu', expected a file in it"),
        ("application/x-fmu-sharedlibrary", "application/x-ssp-package", "first is of type 'application"),
        ('source="first.fmu"', 'source="first.fmu" implementation="ModelExchange"', "expected CoSimulation"),
        ('name="inner"', 'name="first"', "name 'first' of a System is empty or taken"),
        ('endConnector="u">', 'endConnector="v">', "first: first.fmu has no variable 'v'"),
        ('startConnector="y" endE', 'startConnector="gain" endE', "first.gain is connected, but of causality"),
        ('LinearTransformation factor="500.0" offset="1.0"/', MAPPING, "first.u: BooleanMappingTransformation is not"),
        ('m="1" factor', 's="1" factor', "inner.in is in 'km', which 'm' of first.y is not"),
        ('<c:Unit name="km">', '<c:Unit name="mm">', "inner.in is in 'km', expected 'm' of first.y"),
        ('source="set.ssv"', 'source="none.ssv"', "ParameterBinding: source is 'none.ssv', expected a file in it"),
        ("second.gain", "third.gain", "parameter inner.third.gain is of no FMU and no connector"),
        ('value="-1.0"', 'value="INF"', "parameter second.gain is 'INF', expected a finite"),
        ('value="-1.0"', 'value="much"', "line 15: Element 'Real', attribute 'value': 'much' is not a valid value"),
        ('kind="input"', 'kind="in"', "line 9: Element 'Connector', attribute 'kind': [facet 'enumeration']"),
        ('name="first" ', "", "line 8: Element 'Component': The attribute 'name' is required but missing"),
        ('factor="500.0"', 'scale="500.0"', "'LinearTransformation', attribute 'scale': The attribute 'scale' is not"),
        ('<v:Real value="-1.0"/>', '<v:Enumeration value="one"/>', "second.gain is of type Enumeration, expected"),
        ("second.gain", "second.gian", "FMU variable 'gian' is unknown; did you mean 'gain'"),
        ('stopTime="0.5"', "", "time.duration is not stated, expected seconds above 0, such as by --set time.duration"),
        ('startTime="0.0"', 'startTime="5"', "startTime is 5 s, expected 0"),
        ("<Elements>", BUS, "bus is a SignalDictionaryReference"),
        ('startElement="second" startConnector="y" endC', 'startConnector="out" endC', "connected in a cycle"),
        ("</System>", "", "is no XML that can be read"),
    ],
)  # fmt: skip
def test_what_is_not_supported_is_refused_by_name(gain, tmp_path, capsys, monkeypatch, old, new, words):
    """In one line; nothing is left of the run."""
    monkeypatch.chdir(tmp_path)
    ssd = SSD.replace(old, new, 1)
    assert ssd != SSD
    write_system(tmp_path / "two.ssp", gain, ssd)
    assert main(["run", "two.ssp", "--set", *STEP, "--out", "run"]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1 and words in message and not (tmp_path / "run").exists()


@pytest.mark.medium
@pytest.mark.parametrize(("mode", "words"), [("error", "t = 0.2"), ("nan", "y is nan, expected a finite number")])
def test_a_failure_names_fmu_and_time_and_keeps_the_record(gain, tmp_path, capsys, monkeypatch, mode, words):
    monkeypatch.chdir(tmp_path)
    ssv = SSV.replace('first.mode"><s:Real value="0"', f'first.mode"><s:Real value="{MODES.index(mode)}"')
    write_system(tmp_path / "two.ssp", gain, ssv=ssv)
    assert main(["run", "two.ssp", "--set", *STEP, "--out", "run"]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1 and "first (first.fmu)" in message and words in message
    assert len(pq.read_table("run/record.parquet")) == 3
    assert '"failed: first' in (tmp_path / "run" / "summary.json").read_text()


def test_hostile_files(tmp_path):
    """No zip file, none with a description, a description with entities, none of a system."""
    (tmp_path / "text.ssp").write_text("words")
    with zipfile.ZipFile(tmp_path / "fmu.ssp", "w") as archive:
        archive.writestr("modelDescription.xml", "<a/>")
    for name, ssd in (("entity", '<!DOCTYPE a [<!ENTITY b "c">]><a/>'), ("empty", "<a/>")):
        write_archive(tmp_path / f"{name}.ssp", {"SystemStructure.ssd": ssd.encode()})
    for name in ("text", "fmu", "entity", "empty", "none"):
        with pytest.raises((RunError, FmuFileError), match=rf"{name}.ssp: "):
            read_system(tmp_path / f"{name}.ssp")
