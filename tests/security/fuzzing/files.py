"""Readers of single files: those that people write, and FMUs."""

from __future__ import annotations

import io
import shutil
import zipfile
from dataclasses import replace
from functools import partial
from pathlib import Path

from controller import LAWS
from cosim.campaigns.scenes.as_scenario import scene_scenario
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.scene_file import decode_scene
from cosim.campaigns.scenes.scene_store import SceneStore
from cosim.mavlink.wire.signing import read_key
from cosim.scenario.scenario import load_scenario
from fuzzy_arbiter import Arbiter
from fuzzy_arbiter import formats as arbiters
from fuzzy_arbiter.command_line.files import read_text
from fuzzy_arbiter.command_line.values import evaluated_table
from plant_fmu import Plant, load_vehicle
from plant_fmu.description import model_description
from plant_fmu.importers import read_fmu
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


@reader(
    "table of samples", "text", "fuzzy_arbiter.command_line.files:read_text", "fuzzy_arbiter.command_line.values:_rows"
)
def samples(seeds: Seeds) -> Case:
    arbiter = Arbiter()

    def read(path: Path) -> object:
        return evaluated_table(arbiter, *read_text(str(path), None), as_json=False)

    return seeds.file("it.csv", read, b'obstacle,shape, depth,note\n0.75,1,0,a\n1,0.5,0.25,"b,c"\n\n0,0,1e-3,\n')


@reader(
    "scenes",
    "jsonl",
    "cosim.campaigns.scenes.scene_file:decode_scene",
    "cosim.campaigns.scenes.scene_store:SceneStore.__init__",
)
def scenes(seeds: Seeds) -> Case:
    gains = LAWS["ismail_dunnigan"].gains_type()

    def read(path: Path) -> None:
        with SceneStore(path) as store:
            for line in store.lines(store.seeds):  # what is refused then is a row of the campaign
                with_error = None
                try:
                    scene_scenario(decode_scene(line), "ismail_dunnigan", gains, Conditions())
                except KINDS as error:
                    with_error = error
                assert with_error is None or str(with_error).isprintable()

    return seeds.file("it.jsonl", read, b"".join(SCENES))


@reader("signing key", "bytes", "cosim.mavlink.wire.signing:read_key")
def key(seeds: Seeds) -> Case:
    case = seeds.file("key", read_key, bytes(range(32)), b"0f" * 32 + b"\n", b"a passphrase\n")
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


@reader("FMU", "zip", "plant_fmu.unpacking:opened", "plant_fmu.unpacking:_parsed")
def fmu(seeds: Seeds) -> Case:
    return seeds.file("it.fmu", read_fmu, _zipped(SMALL))


@reader("model description, checked", "xml", "plant_fmu.unpacking:_tree")
def description(seeds: Seeds) -> Case:
    case = seeds.file("it.fmu", read_fmu, b"")
    return replace(case, contents=_descriptions(), read=lambda content: case.read(_zipped(content)))


def _descriptions() -> tuple[bytes, ...]:
    from plant_fmu.vehicle_component import of_vehicle

    component = of_vehicle(load_vehicle("odin"))
    return SMALL, *(model_description(component, fmi, "token").encode() for fmi in (2, 3))


@reader("model description, run", "xml", "plant_fmu.unpacking:_tree", "plant_fmu.running.instance:Instance._load",
        "plant_fmu.running.instance:_described")  # fmt: skip
def description_run(seeds: Seeds) -> Case:
    """Up to the binary, which these have not: their code is not run."""
    case = description(seeds)
    path = Path(case.named)

    def read(content: bytes) -> None:
        path.write_bytes(_zipped(content))
        Plant(path)

    return replace(case, read=read)


@reader("state of a plant", "bytes", "plant_fmu.running.state:from_bytes")
def state(seeds: Seeds) -> Case:
    plant = Plant("odin")
    plant.initialise()

    def read(content: bytes) -> None:
        plant.free(plant.deserialise(content))

    return Case((plant.serialise(plant.save()),), read)
