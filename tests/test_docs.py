"""The documents match the code."""

import importlib.util
import re
from pathlib import Path

import pytest

from cosim.scenario.toml_file import list_scenarios

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_have_existing_targets(page):
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text()):
        assert target.startswith("http") or (page.parent / target).exists(), target


def test_paths_in_the_architecture_page_exist():
    text = (ROOT / "docs" / "architecture.md").read_text()
    places = re.findall(r"`((?:fuzzy_arbiter|plant_fmu|controller|cosim|tests)/[\w./]*)(?:: (\w+))?`", text)
    assert len(places) > 40
    for path, name in places:
        assert (ROOT / path).exists(), path
        assert not name or re.search(rf"\b(?:def|class) {name}\b", (ROOT / path).read_text()), (path, name)


def test_files_that_scripts_of_pages_name_exist():
    text = "".join(path.read_text() for path in (ROOT / "cosim/replay/assets").glob("*.js"))
    paths = re.findall(r"\bcosim/[\w/]+\.py\b", text)
    assert paths and all((ROOT / path).exists() for path in paths), paths


def test_lines_beside_equations_stand_in_their_files():
    text = (ROOT / "docs" / "theory.md").read_text()
    rows = re.findall(r"^\|.*\| `(.*)` \| `(\w+\.py)` \|$", text, re.M)
    assert len(rows) > 20
    for line, file in rows:
        lines = (ROOT / "controller" / "laws" / "deployable" / file).read_text().splitlines()
        assert line in {" ".join(known.partition("  #")[0].split()) for known in lines}, (line, file)


def test_readme_names_the_shipped_scenarios():
    readme = " ".join((ROOT / "README.md").read_text().split())
    assert f"Shipped scenarios: {', '.join(list_scenarios())}." in readme


def test_the_keys_of_a_scenario_are_documented_as_the_code_has_them():
    path = ROOT / "docs" / "reference" / "scenario_keys.py"
    spec = importlib.util.spec_from_file_location("scenario_keys_page", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.PAGE.read_text() == module.page(), f"run python {path.relative_to(ROOT)}"
    assert "| `time.step` | s | 0.001 |" in module.page() and "| `limit.force` | N | `inf` |" in module.page()


@pytest.mark.slow
def test_reproduction_table_holds_the_measured_figures(shipped_run):
    text = (ROOT / "docs" / "reproduction.md").read_text()
    rows = {
        line.split("|")[1].strip(): [cell.strip() for cell in line.split("|")[2:5]]
        for line in text.splitlines()
        if line.startswith("| ")
    }
    for column, name in enumerate(("paper", "paper-limited", "paper-calibrated")):
        summary = shipped_run(name, "arbiter.engine=closed").summary
        (start, end), *_ = summary["intersection_windows"]
        assert rows["inside SR1 and SR2, s"][column] == f"{start:.3f}–{end:.3f}"
        clearances = ", ".join(f"{summary['min_clearance'][r]:.3f}".replace("-", "−") for r in ("SR1", "SR2"))
        assert rows["clearance to SR1, SR2, m"][column] == clearances
        assert rows["maximum speed, m/s"][column] == f"{summary['max_speed']:.2f}"
