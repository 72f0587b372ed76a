"""What the documents say is what the code does."""

import re
from pathlib import Path

import pytest

from cosim.scenario import load_scenario
from cosim.scenario_file import shipped_scenarios

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)\)", page.read_text()):
        assert target.startswith("http") or (page.parent / target).exists(), target


def test_readme_names_the_shipped_scenarios():
    readme = " ".join((ROOT / "README.md").read_text().split())
    assert f"Shipped scenarios: {', '.join(shipped_scenarios())}." in readme


def test_every_key_of_a_scenario_is_documented():
    text = (ROOT / "docs" / "scenarios.md").read_text()

    def keys(table, prefix=""):
        for key, value in table.items():
            if isinstance(value, dict) and value and key not in ("goal", "shape", "gains"):
                yield from keys(value, f"{prefix}{key}.")
            elif isinstance(value, list) and value and isinstance(value[0], dict):
                yield from keys(value[0], f"{prefix}{key}[].")
            else:
                yield f"{prefix}{key}"

    for key in keys(load_scenario("paper").table):
        assert f"`{key}" in text, key


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
        assert rows["greatest speed, m/s"][column] == f"{summary['max_speed']:.2f}"
