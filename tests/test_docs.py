"""What the documents say is what the code does."""

import re
import shutil
from pathlib import Path

import pytest

from cosim.cli import main
from cosim.scenario import load_scenario
from cosim.scenario_file import shipped_scenarios

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)\)", page.read_text()):
        assert target.startswith("http") or (page.parent / target).exists(), target


def test_readme_shows_what_the_arbiter_says():
    code = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S).group(1)
    *setup, last = code.strip().splitlines()
    call, _, comment = last.partition("#")
    names = {}
    exec("\n".join(setup), names)
    assert eval(call, names) == eval(comment[comment.index("(") :])


def test_docs_fmu_snippet_runs(tmp_path, monkeypatch):
    from plant_fmu import cached_fmu, load_vehicle

    code = re.search(r"```python\n(.*?)```", (ROOT / "docs" / "fmu.md").read_text(), re.S).group(1)
    monkeypatch.chdir(tmp_path)
    shutil.copy(cached_fmu(load_vehicle("odin"), 3), tmp_path / "odin.fmu")
    names = {}
    exec(code, names)
    assert names["result"]["position.x"][-1] > 1.0


def test_docs_fmu_plant_runs():
    *_, code = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "fmu.md").read_text(), re.S)
    names = {}
    exec(code, names)
    assert names["speed"] > 0.1 and not names["cut"]
    assert names["B"].shape == (2, 14) and (names["B"][0, :2] > 0).all()
    assert names["plant"].time == 1.0


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


@pytest.mark.slow
def test_commands_of_the_tour_are_understood(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tour = re.search(r"## A short tour\n+```\n(.*?)```", (ROOT / "README.md").read_text(), re.S).group(1)
    commands = [line.split("#")[0].split() for line in tour.splitlines() if line.startswith("cosim")]
    assert {words[1] for words in commands} >= {"run", "check", "campaign", "sweep", "package", "sitl"}
    nobody_comes = {"listen": (["--seconds", "0.1"], 1), "sitl": (["--timeout", "0.1"], 2)}
    scenes = (ROOT / "tests" / "data" / "scenes" / "plain.jsonl").read_text().splitlines()
    (tmp_path / "scenes.jsonl").write_text(scenes[0])
    for _, *words in commands:
        words = words[: words.index(">")] if ">" in words else words
        if words[0] == "run":
            words = [w for w in words if w not in ("--rate", "1")] + ["--set", "time.duration=0.01", "--no-report"]
            words += ["--set", "arbiter.engine=closed"]
        brief, code = nobody_comes.get(words[0], ([], 0))
        assert main([*words, *brief]) == code
