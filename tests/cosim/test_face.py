"""The public names of `cosim`, as scripts and notebooks use them."""

import ast
import dataclasses
import importlib
import json
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest

import controller
import cosim
import plant_fmu
from cosim.errors import RunError, ScenarioError
from tests.architecture.modules import FILES, ROOT

SHORT = {"time.duration": 0.05, "arbiter.engine": "closed"}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return cosim.run_scenario(cosim.load_scenario("paper").replace(SHORT), tmp_path_factory.mktemp("face") / "run")


@pytest.mark.slow
def test_public_names_are_not_shadowed_by_submodules():
    modules = sorted(module for module in FILES if not module.endswith("__main__"))
    code = (
        f"import importlib, types, cosim\nfor name in {modules!r}:\n    importlib.import_module(name)\n"
        "print([name for name in cosim.__all__ if isinstance(getattr(cosim, name), types.ModuleType)])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_dir_lists_only_public_names():
    assert dir(cosim) == sorted(cosim.__all__)
    with pytest.raises(AttributeError, match="module 'cosim' has no attribute 'anything'"):
        _ = cosim.anything


def test_replace_equals_command_line_overrides():
    paper = cosim.load_scenario("paper")
    changed = paper.replace({"limit.force": 500.0, "regions.SR1.gain": 5000, "initial.position": np.array([1.0, 2, 3])})
    words = ["limit.force=500.0", "regions.SR1.gain=5000", "initial.position=[1.0,2.0,3.0]"]
    assert changed.toml() == cosim.load_scenario("paper", words).toml()
    assert changed.title == cosim.load_scenario("paper", words).title != paper.title
    assert paper.limit.force != 500.0 and paper.toml() == cosim.load_scenario("paper").toml()
    assert changed.replace({"limit.force": 600.0}).limit.force == 600.0


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"limit.forse": 1.0}, "paper: .*limit.forse"),
        ({"limit.force": -1.0}, "paper: limit.force is -1"),
        ({"limit.force": None}, "paper: limit.force: expected a number, got nothing"),
        ({"regions.SR9.gain": 1.0}, "paper: .*SR9"),
        ({"time.duration": "long"}, "paper: .*time.duration"),
        ({"title": object()}, "paper: .*title"),
    ],
)
def test_invalid_replacements_give_one_line_errors(changes, words):
    with pytest.raises(ScenarioError, match=words) as refused:
        cosim.load_scenario("paper").replace(changes)
    assert "\n" not in str(refused.value)


def test_loaded_run_equals_the_returned_run(run):
    again = cosim.load_run(run.folder)
    assert type(again) is type(run) is cosim.Run
    assert again.summary == run.summary == json.loads((run.folder / "summary.json").read_text())
    assert again.files() == run.files() and {"scenario", "record", "summary", "report", "replay"} == run.files().keys()
    assert run.replay() == run.folder / "replay.html" and len(repr(run).splitlines()) == 1


@pytest.mark.medium
def test_paths_may_be_texts_and_scenarios_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("short.toml").write_text(cosim.load_scenario("paper").replace(SHORT).toml())
    Path("scenes.jsonl").write_text("\n".join(cosim.generate_scenes(1)))
    done = cosim.run_scenario("short.toml", "run", report=False)
    assert cosim.load_run("run").summary == cosim.load_run(Path("run")).summary == done.summary
    assert cosim.export_run("run", "csv", "it.csv")[0] == Path("it.csv")
    assert cosim.check_scenario("paper").title == cosim.load_scenario("paper").title
    design = cosim.Design(cosim.vary_from(["initial.position.1=-1,1"]), "grid")
    assert cosim.run_sweep("short.toml", design, "sweep").folder == Path("sweep")
    with pytest.raises(TypeError, match="takes 3 positional arguments"):  # the fourth was the engine
        cosim.run_sweep("short.toml", design, "sweep", "fused", 2)
    with pytest.warns(DeprecationWarning, match=r"cosim\.Sweep is now cosim\.Campaign"):
        assert cosim.Sweep is cosim.Campaign
    for package, name in ((cosim, "Scene"), (controller, "VehicleModel"), (plant_fmu, "shipped_vehicles")):
        with pytest.warns(DeprecationWarning, match=f"{name} is no longer public, but in ") as caught:
            assert getattr(package, name).__name__ == name
        home = str(caught[0].message).rpartition(" in ")[2]
        assert getattr(importlib.import_module(home), name).__name__ == name
    with pytest.warns(DeprecationWarning, match=r"empty_field\(n_regions\) is now Field\(n=n_regions\)"):
        assert importlib.import_module("controller.potential_field").empty_field(2).values.shape == (2,)
    assert len(list(cosim.read_scenes("scenes.jsonl"))) == 1
    assert cosim.run_campaign("scenes.jsonl", "pd", "campaign").folder == Path("campaign")
    assert cosim.compare("scenes.jsonl", ["pd", "sun_cheah"], "comparison").folder == Path("comparison")
    with pytest.raises(ScenarioError, match="scenario 'dokcing' is unknown; did you mean 'docking'"):
        cosim.run_scenario("dokcing")


def test_record_is_a_table_with_units_and_a_data_frame(run):
    table, frame = run.table(), run.frame()
    assert table.column_names == list(frame.columns) == list(run.record.units)
    assert table.schema.field("goal.clearance").metadata[b"unit"] == b"m"
    assert np.array_equal(frame["goal.clearance"], run.record["goal.clearance"])
    assert np.array_equal(table["time"].to_numpy(), run.record["time"])


def test_signals_can_be_plotted(run):
    ax = run.plot("weight.*")
    assert [line.get_label() for line in ax.lines] == ["weight.obstacle", "weight.shape", "weight.depth"]
    assert run.plot("weight.depth", ax=ax) is ax and len(ax.lines) == 4
    with pytest.raises(RunError, match="signals in m and no unit, expected one unit"):
        run.plot("position.x", "weight.*", ax=ax)
    with pytest.raises(RunError, match="signal 'wieght' is unknown"):
        run.plot("wieght")
    plt.close("all")


def test_units_are_plotted_in_axes_of_their_own(run):
    first = run.plot("position.*", "actuation.X", "weight.*", "position.y")
    shown = [(ax.get_ylabel(), [line.get_label() for line in ax.lines]) for ax in first.figure.axes]
    assert [unit for unit, _ in shown] == ["[m]", "[N]", ""] and first is first.figure.axes[0]
    assert [len(names) for _, names in shown] == [3, 1, 3]
    plt.close("all")


@pytest.mark.parametrize("size", [(6.4, 4.8), (3.0, 3.0), (12.0, 4.0)])
@pytest.mark.parametrize("given", [False, True], ids=["new", "given"])
def test_titles_of_plots_lie_within_the_figure(run, size, given):
    """Whatever was changed is listed at the title's end, where it was cut."""
    changes = {"limit.force": 500.0, "arbiter.ramp": 0.25, "initial.position": [0.0, 0.1, 1.0]}
    changed = dataclasses.replace(run, scenario=run.scenario.replace(changes))
    with plt.rc_context({"figure.figsize": size}):
        ax = plt.figure(layout="constrained").add_subplot() if given else None
        ax = changed.plot("weight.*", ax=ax)
    ax.figure.canvas.draw()
    title, figure = ax.title.get_window_extent(), ax.figure.bbox
    assert "limit.force = 500 N" in " ".join(ax.get_title().split())
    assert title.x0 >= 0.0 and title.x1 <= figure.x1 and title.y1 <= figure.y1
    plt.close("all")


def test_notebook_representation_is_escaped(run, monkeypatch):
    monkeypatch.setitem(run.summary, "status", "<script>")
    assert "<script>" not in run._repr_html_() and "&lt;script&gt;" in run._repr_html_()


def test_missing_pandas_error_names_the_install_command(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(RunError, match=r"a data frame needs pandas, of the extra notebook: .*pip install"):
        run.frame()


def test_notebook_cell_can_be_rerun(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scenario = cosim.load_scenario("paper").replace(SHORT)
    first, second = (cosim.run_scenario(scenario, report=False) for _ in range(2))
    assert first.folder != second.folder and np.array_equal(first.record.to_array(), second.record.to_array())
    (once, again) = (cosim.run_scenario(scenario, "mine", report=False, overwrite=True) for _ in range(2))
    assert once.folder == again.folder and len(again.record) == len(first.record)
    with pytest.raises(RunError, match="exists and is not empty"):
        cosim.run_scenario(scenario, "mine", report=False)
    (Path("mine") / "notes.txt").write_text("mine")
    with pytest.raises(RunError, match=r"holds 'notes\.txt', which no run makes"):
        cosim.run_scenario(scenario, "mine", report=False, overwrite=True)
    assert (Path("mine") / "record.parquet").exists() and (Path("mine") / "notes.txt").exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine", "runs"]


def test_texts_of_values_are_short():
    assert repr(cosim.load_scenario("paper")).startswith("Scenario(") and len(repr(cosim.load_scenario("paper"))) < 300


@pytest.mark.slow
def test_the_notebook_runs(tmp_path, monkeypatch):
    """Each of its cells, in their order, as a notebook does."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(plt, "show", lambda: None)
    cells = json.loads((ROOT / "examples" / "notebook.ipynb").read_text())["cells"]
    here = {"__name__": "__main__"}
    for cell in cells:
        if cell["cell_type"] == "code":
            source = "".join(cell["source"])
            ast.parse(source)
            exec(compile(source, "notebook", "exec"), here)
    assert len(here["frame"]) > 1000 and len(here["sweep"].results) == 8
    plt.close("all")
