"""Files in an FMU beside description and binary, against FMPy's schemas and parsers of HTML and images."""

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree as ET

import fmpy
import matplotlib.image
import pytest
from fmpy import read_model_description
from lxml import etree

from plant_fmu import load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.contents import contents
from plant_fmu.contents.page import page
from plant_fmu.variables import variables
from tests.plant_fmu.conftest import EACH_VEHICLE, members

ROOT = Path(__file__).parents[2]
SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi3"
TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
VOID = {"meta", "link", "br", "hr", "img"}


class Page(HTMLParser):
    """Keeps the text of cells, all links and ids; a tag closed out of turn is an error."""

    def __init__(self, text):
        super().__init__()
        self.open, self.links, self.ids, self.rows, self.text = [], [], set(), [], []
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attributes):
        named = dict(attributes)
        self.links += [named[key] for key in ("href", "src") if key in named and tag != "use"]
        self.ids |= {named["id"]} if "id" in named else set()
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)
        if {"td", "th"} & set(self.open):
            self.rows[-1][-1] += data


@pytest.fixture(params=EACH_VEHICLE)
def vehicle(request):
    return load_vehicle(request.param)


@pytest.mark.slow
def test_fmu_holds_reproducible_documentation_files(vehicle, fmi):
    made = contents(vehicle, fmi)
    assert made == contents(vehicle, fmi)
    assert made.items() <= members(cached_fmu(vehicle, fmi)).items()


def test_file_locations_follow_the_fmi_version(vehicle):
    two, three = contents(vehicle, 2), contents(vehicle, 3)
    assert "model.png" in two and not any(name.startswith("terminalsAndIcons") for name in two)
    assert "model.png" not in three and {TERMINALS, "terminalsAndIcons/icon.png"} <= three.keys()


def test_the_page_is_well_formed_and_needs_no_network(vehicle, fmi):
    made = contents(vehicle, fmi)
    read = Page(made["documentation/index.html"].decode())
    for link in read.links:
        if link.startswith("#"):
            assert link[1:] in read.ids
        else:
            assert f"documentation/{link}" in made
    text = " ".join(read.text)
    assert vehicle.source in text
    assert not {"{{", "{%", "}}", "%}"} & set(text.split())


def test_page_documents_every_variable(vehicle, fmi):
    described = read_model_description(cached_fmu(vehicle, fmi)).modelVariables
    rows = {cells[0]: cells for cells in Page(page(vehicle, fmi)).rows if len(cells) >= 4}
    for v in described:
        if v.causality != "independent":
            _, unit, *numbers, description = rows[v.name]
            assert unit == (v.unit or "") and len(numbers) == 1 + (v.start is not None)  # a range, after the start
            assert description.startswith(v.description)


def test_page_escapes_special_characters_in_titles(vehicle):
    odd = replace(vehicle, title="a < b & $c", source="<script>x</script> {{ vehicle.name }} 5 %")
    assert {"a < b & $c", "<script>x</script> {{ vehicle.name }} 5\N{NO-BREAK SPACE}%"} <= set(Page(page(odd, 3)).text)


def test_license_files_are_included(vehicle, fmi):
    made = contents(vehicle, fmi)
    licence = made["documentation/licenses/license.txt"].decode()
    assert licence.startswith((ROOT / "LICENSE").read_text().rstrip())
    assert "fmi-headers.txt" in licence
    header = made["documentation/licenses/fmi-headers.txt"].decode()
    assert header.startswith("Copyright") and "Modelica Association" in header and header.rstrip().endswith("---")


def test_the_icon_is_a_picture_with_clear_corners():
    folder = ROOT / "plant_fmu" / "contents" / "pages"
    picture = matplotlib.image.imread(folder / "icon.png")
    assert picture.shape == (128, 128, 4)
    assert picture[0, 0, 3] == 0.0 and picture[64, 64, 3] == 1.0
    assert ET.parse(folder / "icon.svg").getroot().get("viewBox") == "0 0 128 128"


def test_terminals_are_valid_and_name_inputs_and_outputs(vehicle):
    document = etree.fromstring(contents(vehicle, 3)[TERMINALS])
    etree.XMLSchema(file=str(SCHEMA / "fmi3TerminalsAndIcons.xsd")).assertValid(document)
    by_name = {v.name: v for v in read_model_description(cached_fmu(vehicle, 3)).modelVariables}
    named = [member.get("variableName") for member in document.iter("TerminalMemberVariable")]
    assert {by_name[name].causality for name in named} == {"input", "output"}
    assert len(named) == len(set(named))
    grouped = {n for n, v in by_name.items() if v.causality in ("input", "output") and ("." in n or "[" in n)}
    assert set(named) == grouped
    for terminal in document.iter("Terminal"):
        names = [member.get("memberName") for member in terminal.findall("TerminalMemberVariable")]
        assert len(names) == len(set(names))
        assert terminal.get("description")


def test_terminals_match_manual_result():
    document = ET.fromstring(contents(load_vehicle("odin"), 3)[TERMINALS])

    def at(*path):
        element = document.find("Terminals")
        for name in path:
            (element,) = (child for child in element.findall("Terminal") if child.get("name") == name)
        return {m.get("memberName"): m.get("variableName") for m in element.findall("TerminalMemberVariable")}

    assert at("pose", "position") == {a: f"position.{a}" for a in "xyz"}
    assert at("pose", "quaternion") == {f"e{i}": f"quaternion.e{i}" for i in range(4)}
    assert at("pose", "attitude") == {a: f"attitude.{a}" for a in ("roll", "pitch", "yaw")}
    assert at("velocity") == {a: f"velocity.{a}" for a in "uvwpqr"}
    assert at("wrench") == {a: f"wrench.{a}" for a in "XYZKMN"}
    assert at("thrusters", "thruster[8]") == {
        "command": "thrust[8]",
        "force": "thruster_force[8]",
        "saturated": "thrust_saturated[8]",
    }


def test_vehicle_with_one_thruster_has_complete_documentation(fmi):
    odin = load_vehicle("odin")
    short = {key: value[:1] for key, value in vars(odin).items() if key.startswith("thrust_")}
    one = replace(odin, thruster_matrix=odin.thruster_matrix[:, :1], **short)
    rows = {cells[0] for cells in Page(contents(one, fmi)["documentation/index.html"].decode()).rows if cells}
    assert {v.name for v in variables(one) if v.role != "time"} <= rows
    assert "thrust[2]" not in rows


@pytest.mark.parametrize("own", [False, True], ids=["shipped", "own"])
def test_guide_names_the_existing_files(own):
    """One of the package brings a manoeuvre, one's own brings none."""
    vehicle = load_vehicle("odin")
    if own:
        vehicle = replace(vehicle, name="mine", mass=126.0)
    made = contents(vehicle, 3)
    files = {Path(name).name for name in made if name.startswith("extra/")} - {"fmi-ls-manifest.xml"}
    named = set(re.findall(rf"^{vehicle.name}\S*", made["documentation/fmi-ls-ref.txt"].decode(), re.MULTILINE))
    assert named == files
    assert len(files) == (1 if own else 4)
