"""Readers of single files: handwritten ones, and FMUs."""

from __future__ import annotations

import io
import shutil
import zipfile
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

from controller import LAWS
from cosim.campaigns.scenes.as_scenario import scene_scenario
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.scene_file import SceneStore, decode_scene
from cosim.logs import import_log
from cosim.logs.column_map import read_map
from cosim.mavlink.wire.signing import load_key
from cosim.scenario.scenario import load_scenario
from cosim.ssp.system_description import read_system
from fuzzy_arbiter import Arbiter
from fuzzy_arbiter import formats as arbiters
from fuzzy_arbiter.command_line.evaluation import evaluate_table
from plant_fmu import Plant, load_vehicle
from plant_fmu.checking.fmu_file import read_fmu
from plant_fmu.description import model_description
from tests.cosim.ssp.test_run_system import SSD, SSV
from tests.fuzzy_arbiter.formats.systems import RICHER
from tests.security.fuzzing.registry import KINDS, ROOT, SCENES, Case, Seeds, reader

# ---- files for people ----------------------------------------------------------------------------------------------


@reader("scenario", "toml", "plant_fmu.toml_tables:read_toml", "plant_fmu.toml_tables:decode")
def scenario(seeds: Seeds) -> Case:
    shapes = str(ROOT / "tests" / "cosim" / "ssp" / "all-shapes.toml")
    texts = (load_scenario(name).toml() for name in ("docking", "harbour", "paper-deployable", shapes))
    return seeds.file("it.toml", load_scenario, *(text.encode() for text in texts))


@reader("scenario, laid over others", "toml", "plant_fmu.toml_tables:read_toml")
def layers(seeds: Seeds) -> Case:
    """A file that names its base and its vehicle."""
    case = seeds.file("it.toml", load_scenario, b'base = "below.toml"\nvehicle = "boat.toml"\ntime.duration = 2\n')
    folder = Path(case.named).parent
    shutil.copy(ROOT / "plant_fmu" / "vehicles" / "odin.toml", folder / "boat.toml")
    (folder / "below.toml").write_text('base = "docking"\nlaw.name = "pd"\n')
    return case


@reader("vehicle", "toml", "plant_fmu.toml_tables:read_toml", "plant_fmu.toml_tables:decode")
def vehicle(seeds: Seeds) -> Case:
    return seeds.file("it.toml", load_vehicle, *(f.read_bytes() for f in (ROOT / "plant_fmu/vehicles").glob("*.toml")))


def _arbiter(format: str, seeds: Seeds) -> Case:
    own = () if format == "fis" else (arbiters.writes(Arbiter().system, format).encode(),)
    tipping = (ROOT / "tests" / "data" / "fuzzy" / f"tipping.{format}").read_bytes()
    rich = arbiters.writes(RICHER[format], format).encode()
    return seeds.file(f"it.{format}", arbiters.load, tipping, rich, *own)


for _format, _kind, _parser in (
    ("json", "json", ["fuzzy_arbiter.formats.json_toml:read_json"]),
    ("toml", "toml", ["fuzzy_arbiter.formats.json_toml:read_toml"]),
    ("fcl", "text", []), ("fis", "text", []), ("fll", "text", []),
):  # fmt: skip
    reader(f"arbiter in {_format.upper()}", _kind, "fuzzy_arbiter.formats:load", *_parser)(partial(_arbiter, _format))


_EVALUATION = "fuzzy_arbiter.command_line.evaluation"


@reader("table of samples", "text", f"{_EVALUATION}:evaluate_table", f"{_EVALUATION}:_rows")
def samples(seeds: Seeds) -> Case:
    arbiter = Arbiter()

    def read(path: Path) -> object:
        return evaluate_table(arbiter, str(path), None, as_json=False)

    return seeds.file("it.csv", read, b'obstacle,shape, depth,note\n0.75,1,0,a\n1,0.5,0.25,"b,c"\n\n0,0,1e-3,\n')


LAW, _SCENES = "ismail_dunnigan", "cosim.campaigns.scenes.scene_file"


@reader("scenes", "jsonl", f"{_SCENES}:decode_scene", f"{_SCENES}:SceneStore.__init__")
def scenes(seeds: Seeds) -> Case:
    gains = LAWS[LAW].gains_type()

    def read(path: Path) -> None:
        with SceneStore(path) as store:
            for line in store.lines(store.seeds):  # what is refused then is a row of the campaign
                refusal = _refusal(lambda line: scene_scenario(decode_scene(line), LAW, gains, Conditions()), line)
                assert refusal is None or str(refusal).isprintable()

    return seeds.file("it.jsonl", read, b"".join(SCENES))


@reader("signing key", "bytes", "cosim.mavlink.wire.signing:load_key")
def key(seeds: Seeds) -> Case:
    case = seeds.file("key", load_key, bytes(range(32)), b"0f" * 32 + b"\n", b"a passphrase\n")
    Path(case.named).touch(0o600)
    Path(case.named).chmod(0o600)
    return case


# ---- FMUs ----------------------------------------------------------------------------------------------------------

SMALL = (
    b'<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="t">'
    b'<CoSimulation modelIdentifier="m"/><ModelVariables>'
    b'<Float64 name="time" valueReference="0" causality="independent"/>'
    b'<Float64 name="x" valueReference="1" causality="output" initial="calculated"><Dimension start="3"/></Float64>'
    b'</ModelVariables><ModelStructure><Output valueReference="1"/></ModelStructure></fmiModelDescription>'
)


def _zipped(description: bytes) -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", description)
        archive.writestr("sources/buildDescription.xml", b'<fmiBuildDescription fmiVersion="3.0"/>')
        archive.writestr("resources/it.txt", b"some words\n" * 20)
    return made.getvalue()


def _refusal(read: Callable[..., object], *arguments: object) -> Exception | None:
    try:
        read(*arguments)
    except KINDS as error:
        return error
    return None


@reader("FMU", "zip", "plant_fmu.unpacking:open_fmu", "plant_fmu.unpacking:parse_member")
def fmu(seeds: Seeds) -> Case:
    """What `check` refuses, a plant refuses with the same line; it also needs a binary, which these have not."""

    def read(path: Path) -> None:
        refusal, refusal_of_plant = (_refusal(opened, path) for opened in (read_fmu, Plant))
        assert refusal is None or str(refusal) == str(refusal_of_plant)
        if refusal:
            raise refusal

    return seeds.file("it.fmu", read, _zipped(SMALL))


@reader("model description, checked", "xml", "plant_fmu.unpacking:_parse_tree")
def description(seeds: Seeds) -> Case:
    case = seeds.file("it.fmu", read_fmu, b"")
    return replace(case, contents=_descriptions(), read=lambda content: case.read(_zipped(content)))


def _descriptions() -> tuple[bytes, ...]:
    from plant_fmu.vehicle_component import make_vehicle_component

    component = make_vehicle_component(load_vehicle("odin"))
    return SMALL, *(model_description(component, fmi, "token").encode() for fmi in (2, 3))


@reader("model description, run", "xml", "plant_fmu.unpacking:_parse_tree", "plant_fmu.running.instance:Instance._load")
def description_run(seeds: Seeds) -> Case:
    """Up to the binary, which these have not: their code is not run."""
    case = description(seeds)
    path = Path(case.named)

    def read(content: bytes) -> None:
        path.write_bytes(_zipped(content))
        Plant(path)

    return replace(case, read=read)


@reader("system of FMUs", "zip", "cosim.ssp.system_description:read_system")
def system(seeds: Seeds) -> Case:
    """Its connections, units and parameters; no FMU of it is read."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("SystemStructure.ssd", SSD)
        archive.writestr("set.ssv", SSV)
        archive.writestr("first.fmu", b"")
    return seeds.file("it.ssp", read_system, made.getvalue())


@reader("state of a plant", "bytes", "plant_fmu.running.state:from_bytes")
def state(seeds: Seeds) -> Case:
    plant = Plant("odin")
    plant.initialize()

    def read(content: bytes) -> None:
        plant.free(plant.deserialize(content))

    return Case((plant.serialize(plant.save()),), read)


# ---- logs of vehicles ----------------------------------------------------------------------------------------------

LOGS = ROOT / "tests" / "data" / "logs"
MAP = (
    b'time = { column = "t", unit = "ms" }\nworld = "ENU"\n[attitude]\ncolumns = ["yaw", "pitch", "roll"]\n'
    b'euler = "ZYX"\nunit = "deg"\n[depth]\ncolumns = ["depth"]\nsign = -1\n'
)
TABLE = b"t,depth,yaw,pitch,roll\n0,1.5,90,0,1\n100,1.6,91,0,1\n200,1.7,,0,1\n300,1.8,93,0,1\n"


def _log(seeds: Seeds, name: str, *contents: bytes, columns: bytes = b"") -> Case:
    """Return the case of a log: it becomes a run, or is refused and leaves none."""
    folder = seeds.folder()
    (folder / "map.toml").write_bytes(columns)

    def read(path: Path) -> None:
        out = folder / "run"
        try:
            run = import_log(
                path, "bluerov2_heavy", out, columns=folder / "map.toml" if columns else None, report=False
            )
        except KINDS:
            assert not out.exists()
            raise
        assert np.all(np.diff(run.record["time"]) > 0.0)
        shutil.rmtree(out)

    return seeds.file(name, read, *contents)


@reader("column map", "toml", "plant_fmu.toml_tables:read_toml", "plant_fmu.toml_tables:decode")
def column_map(seeds: Seeds) -> Case:
    return seeds.file("map.toml", read_map, MAP)


@reader("table of a log", "text", "cosim.logs.formats.table:_batches", "cosim.logs.formats.table:_layout")
def table_of_a_log(seeds: Seeds) -> Case:
    return _log(seeds, "it.csv", TABLE, columns=MAP)


@reader("table of a log in Parquet", "parquet", "cosim.logs.formats.table:_batches", "cosim.logs.formats.table:_layout")
def parquet_of_a_log(seeds: Seeds) -> Case:
    made = io.BytesIO()
    pq.write_table(pa.csv.read_csv(io.BytesIO(TABLE)), made)
    return _log(seeds, "it.parquet", made.getvalue(), columns=MAP)


_TLOG = "cosim.logs.formats.tlog:_Frames"


@reader("telemetry log", "bytes", f"{_TLOG}._parse", f"{_TLOG}._size_at", "cosim.mavlink.wire.framing:parse_header")
def telemetry_log(seeds: Seeds) -> Case:
    return _log(seeds, "it.tlog", (LOGS / "small.tlog").read_bytes()[:40_000])


@reader("dataflash log", "bytes", "cosim.logs.formats.dataflash:Messages._parse", "cosim.logs.formats.dataflash:_learn")
def dataflash_log(seeds: Seeds) -> Case:
    data = (LOGS / "small.BIN").read_bytes()[:60_000]  # of a vehicle with six thrusters, which it now does not say
    return _log(seeds, "it.bin", data.replace(b"FRAME_CONFIG", b"FRAME_CONFIX").replace(b"SERVO", b"SERVX"))


_ULOG = [f"cosim.logs.formats.ulog_messages:{name}" for name in ("ULogMessages._parse", "ULogMessages._size_at",
                                                                 "_Topic.samples")]  # fmt: skip


@reader("log of PX4", "bytes", "cosim.logs.records:Records._read", *_ULOG)
def ulog(seeds: Seeds) -> Case:
    from tests.cosim.logs.test_px4_logs import Dive, write_ulog

    path = seeds.folder() / "it.ulg"
    write_ulog(path, Dive(np.arange(0.0, 4.0, 0.05)))
    return _log(seeds, "it.ulg", path.read_bytes())


@reader("recording of BlueOS", "bytes", "cosim.logs.blueos:_parts", "cosim.logs.bag_records:McapRecords._parse")
def recording(seeds: Seeds) -> Case:
    from tests.cosim.logs.test_blueos import write_recording

    path = seeds.folder() / "it.mcap"
    write_recording(path, 5.0)
    return _log(seeds, "it.mcap", path.read_bytes())


_DEFINITIONS = "cosim.logs.message_definitions:parse_definition"


def _bag(suffix: str, seeds: Seeds) -> Case:
    from tests.cosim.logs import test_bags
    from tests.cosim.logs.dive import Dive

    folder, dive = seeds.folder(), Dive(np.arange(0.0, 4.0, 0.05))
    path = folder / f"it.{suffix}"
    if suffix == "db3":
        test_bags.write_database(folder / "bag", dive).rename(path)
    else:
        {"mcap": test_bags.write_bag, "bag": test_bags.write_ros1}[suffix](path, dive)
    return _log(seeds, path.name, path.read_bytes(), columns=test_bags.MAP.encode())


for _suffix, _module, _parsers in (
    ("mcap", "bag_records", ("McapRecords._parse", "McapRecords._size_at", "McapRecords._chunk")),
    ("db3", "bag_database", ("sqlite_messages",)),
    ("bag", "bag_records", ("RosbagRecords._parse", "RosbagRecords._size_at", "_fields", "_ros1_time")),
):  # fmt: skip
    _names = (f"cosim.logs.{_module}:{_parser}" for _parser in _parsers)
    reader(f"bag in {_suffix}", "bytes", *_names, _DEFINITIONS)(partial(_bag, _suffix))
