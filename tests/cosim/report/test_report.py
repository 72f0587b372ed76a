"""The report: complete, self-contained, and consistent with the numbers."""

import html
import re
from dataclasses import replace
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from cosim.report.contents import contents_of
from cosim.report.figures.figures import drawings
from cosim.report.figures.panels import draw_panels
from cosim.report.figures.sampled_rows import make_figure_data
from cosim.report.figures.style import thin
from cosim.report.figures.time_series import forces
from cosim.report.inline_svg import contrast, dark_color
from cosim.results.paper_claims import paper_claims
from cosim.results.record import Rows
from cosim.results.run_result import load_run
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from tests.page_checker import Checker

FIGURES = [
    "attitude", "clearance", "estimates", "forces", "path-3d", "path-plane", "position-error", "thrusters", "weights",
]  # fmt: skip
SHORT = ("arbiter.engine=closed", "time.duration=0.3")  # long enough to be inside SR1 and SR2


def page_of(run):
    return (run.folder / "report.html").read_text()


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("paper", SHORT),
        pytest.param("paper", SHORT[:1], marks=pytest.mark.slow),
        pytest.param("paper-limited", SHORT[:1], marks=pytest.mark.slow),
    ],
)
def test_page_is_whole_and_needs_no_network(shipped_run, name, overrides):
    page = page_of(shipped_run(name, *overrides, report=True))
    checker = Checker(page)
    assert not [target for target in checker.asked if "://" in target or target.startswith("/")]
    assert "<script" not in page
    assert len(page) < 1_000_000
    assert "{{" not in page and "{%" not in page


def test_every_figure_is_there_as_a_vector_file_numbered_and_with_a_caption(shipped_run):
    run = shipped_run("paper", *SHORT, report=True)
    names = sorted([*FIGURES, "weights-overlap"])
    assert sorted(p.name for p in (run.folder / "figures").iterdir()) == sorted(f"{name}.svg" for name in names)
    checker = Checker(page_of(run))
    assert len(checker.captions) == len(names)
    for i, caption in enumerate(checker.captions):
        assert re.match(rf"Figure {i + 1}\. .{{20,}}", caption)
    for name in names:
        ET.parse(run.folder / "figures" / f"{name}.svg")


def test_figures_over_time_show_recorded_times_and_what_a_spike_would_hide(shipped_run):
    data = make_figure_data(load_run(shipped_run("paper", *SHORT, report=True).folder))
    axes = {drawing.name: drawing.figure.axes for drawing in drawings(data)}
    time = data.record["time"]
    limits = np.array([ax.get_xlim() for ax in axes["weights-overlap"]])
    assert time[0] <= limits.min() and limits.max() <= time[-1] + 1e-6
    dotted = [line for ax in axes["estimates"] for line in ax.lines if line.get_linestyle() == ":"]
    assert not dotted  # but the truth, of dashes of its own
    spike = dict.fromkeys(("actuation.X", "actuation.Y", "actuation.Z"), np.where(time == time[3], 1e5, 3.0))
    arrays = {name: spike.get(name, data.record[name]) for name in data.record.units}
    _, ax = draw_panels(data, forces(replace(data, record=Rows(data.record.columns, arrays)))).axes
    assert ax.yaxis.get_transform().linthresh == 10.0  # N, the next power of ten above 3 √3, which is the norm
    assert ax.get_ylim()[1] == pytest.approx(1.5e5 * 3.0**0.5)


def test_figures_follow_the_theme_and_are_described(shipped_run):
    """Without the theme an inline figure is its file; in the dark every color of it contrasts with the ground."""
    run = load_run(shipped_run("paper", *SHORT, report=True).folder)
    page, captions = page_of(run), {d.name: d.caption for d in drawings(make_figure_data(run))}
    for name in FIGURES:
        file = (run.folder / "figures" / f"{name}.svg").read_text()
        inline = page.partition(f'<figure id="{name}">')[2].partition("<figcaption>")[0]
        theme = re.search(r"<style>@media screen and \(prefers-color-scheme:dark\)\{svg\{(.*?)\}\}</style>", inline)
        plain = re.sub(r"var\(--c\w{6},(#\w{6})\)", r"\1", inline.replace(theme[0], ""))
        assert plain.partition("<metadata>")[2].removesuffix("</div>") == file.partition("<metadata>")[2]
        assert f'aria-label="{html.escape(captions[name])}"' in inline
        dark = dict(re.findall(r"--c(\w{6}):(#\w{6});", theme[1]))
        assert set(re.findall(r"var\(--c(\w{6})", inline)) == dark.keys()
        for light, color in dark.items():
            on_white = contrast(f"#{light}", "#ffffff")
            assert contrast(color, "#16181a") >= min(3.0, on_white) - 0.1, (name, light, color)


@pytest.mark.parametrize(("light", "dark"), [("#000000", "#e6e6e3"), ("#ffffff", "#16181a"), ("#e69f00", "#e69f00")])
def test_grays_change_places_and_light_hues_stay_in_the_dark(light, dark):
    assert dark_color(light) == dark


def test_every_link_target_of_the_page_exists(shipped_run):
    run = shipped_run("paper", *SHORT, report=True)
    checker = Checker(page_of(run))
    assert {"replay.html", "record.parquet", "summary.json", "scenario.toml", "figures/"} < set(checker.asked)
    for target in checker.asked:
        assert (run.folder / target).exists(), target


@pytest.mark.slow
def test_report_of_another_scenario_with_a_hostile_title_and_a_distant_goal(tmp_path):
    """No overlap, hence no figure of it; not the paper's scenario, hence no claims."""
    changes = ["arbiter.engine=closed", "time.duration=0.05", 'compare=""', "goal.center=[0,20,5]"]
    scenario = load_scenario("paper", [*changes, 'title="<script>alert(1)</script> & $x"'])
    run = run_scenario(scenario, tmp_path / "run")
    assert sorted(p.stem for p in run.folder.glob("figures/*.svg")) == FIGURES
    page = page_of(run)
    assert "Beside the paper" not in page
    assert "<script" not in page and "&lt;script&gt;alert(1)&lt;/script&gt; &amp; $x" in page
    root = ET.parse(run.folder / "figures" / "path-plane.svg").getroot()
    width, height = (float(root.get(side).removesuffix("pt")) for side in ("width", "height"))
    assert height < 2 * width


@pytest.mark.slow
def test_claims_carry_this_runs_numbers(shipped_run):
    for name in ("paper", "paper-limited", "paper-calibrated"):
        scenario = load_scenario(name, ["arbiter.engine=closed"])
        summary = shipped_run(name, "arbiter.engine=closed").summary
        reaching, window, avoiding, single, effort, adapting = paper_claims(scenario, summary)
        (start, end), *_ = summary["intersection_windows"]
        assert f"{start:.3f} s to {end:.3f} s" in window.result
        assert ("Never in" in reaching.result) == (not summary["reached"])
        assert ("no evidence" in window.reason) == (name != "paper")
        assert f"{summary['min_clearance']['SR1']:+.3f} m" in avoiding.result
        assert "At most 1" in single.result
        assert "26.82 kN" in effort.result
        assert ("Winds up" in adapting.reason) == (name != "paper")


@pytest.mark.slow
def test_claims_mention_thruster_limits(tmp_path):
    overrides = ["arbiter.engine=closed", "time.duration=20", "actuation.through=thrusters"]
    scenario = load_scenario("paper", overrides)
    summary = run_scenario(scenario, tmp_path / "run", report=False).summary
    assert summary["saturated_time"] == pytest.approx(7.145, abs=0.05)
    reaching, window, *_, adapting = paper_claims(scenario, summary)
    assert "never saturated" not in reaching.reason
    assert "thrusters' limits" in window.reason
    assert "Winds up" in adapting.reason


def test_claims_mention_only_entered_spheres(tmp_path):
    scenario = load_scenario("paper", ["arbiter.engine=closed", "time.duration=1", "initial.position=[0,3,1]"])
    summary = run_scenario(scenario, tmp_path / "run", report=False).summary
    _, window, avoiding, *_ = paper_claims(scenario, summary)
    assert "Never inside SR1 and SR2" in window.result
    assert "sphere" not in avoiding.reason
    assert "starts" in avoiding.reason


SHAPES = {
    "box": '{type="box",center=[2,0,2],size=[1,1,1]}',
    "cylinder": '{type="cylinder",start=[2,0,0],end=[2,0,4],radius=0.4}',
    "ellipsoid": '{type="ellipsoid",center=[2,0,2],semi_axes=[1,0.5,0.3]}',
    "half_space": '{type="half_space",point=[6,0,0],normal=[-1,0,0]}',
    "prism": '{type="prism",corners=[[1,-1],[3,-1],[2,1]],top=1,bottom=3}',
    "pipe": '{type="pipe",points=[[0,1,1],[2,1,2],[4,1,2]],radius=0.3}',
    "cone": '{type="cone",feature=[8,0,5],axis=[-1,0,-0.5],half_angle=0.4,range=4}',
}


@pytest.mark.slow
@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_can_be_drawn_and_be_a_goal(tmp_path, shape):
    shapes = [f"regions.SR1.shape={SHAPES[shape]}", f"goal={SHAPES[shape]}"]
    run = run_scenario(load_scenario("paper", [SHORT[0], "time.duration=0.05", *shapes]), tmp_path / "run")
    assert (run.folder / "figures" / "path-3d.svg").exists()


def test_thinned_curves_keep_their_extremes_and_gaps():
    time = np.linspace(0.0, 1.0, 100_001)
    signal = np.sin(40.0 * time)
    signal[54_321] = 9.0
    signal[30_000:40_000] = np.nan
    few, thinned = thin(time, signal)
    gap = np.isnan(thinned)
    assert len(few) < 2000 and few[0] == 0.0 and few[-1] == 1.0
    assert np.nanmax(thinned) == 9.0 and np.nanmin(thinned) == np.nanmin(signal)
    assert few[gap].min() == pytest.approx(0.3, abs=0.004) and few[gap].max() == pytest.approx(0.4, abs=0.004)
    assert not gap[(few < 0.299) | (few > 0.401)].any()


def test_summary_numbers_are_labeled_with_units(shipped_run):
    run = shipped_run("paper", *SHORT, report=True)
    checker = Checker(page_of(run))
    words = " ".join(" ".join(checker.words).split())
    assert "maximum force that acted, norm [N]" in words
    assert f"{run.summary['max_force']:,.0f}".replace(",", " ") in words
    assert "max_force" not in words and "reach_time" not in words
    assert "cosim run scenario.toml --out again" in words


def test_region_table_gives_violation_time_and_duration(shipped_run):
    run = load_run(shipped_run("paper", *SHORT, report=True).folder)
    rows = {row[0]: row for row in contents_of(run)["regions"].rows}
    signal, time = run.record["SR1.clearance"], run.record["time"]
    assert rows["SR1"][:5] == ("SR1", "sphere", "obstacle", "out of", "hard")
    assert float(rows["SR1"][5].removesuffix(" m").replace("−", "-")) == pytest.approx(signal.min(), rel=1e-3)
    assert float(rows["SR1"][6]) == pytest.approx(time[signal.argmin()], abs=0.005)
    inside = time[signal < 0.0]
    assert float(rows["SR1"][7]) == pytest.approx(inside[-1] - inside[0] + time[1], abs=0.0051)


def test_the_scenario_in_the_report_is_the_scenario(shipped_run):
    run = load_run(shipped_run("paper", *SHORT, report=True).folder)
    (scenario,) = re.findall("</summary>\n<pre>(.*?)</pre>", page_of(run), re.S)
    assert html.unescape(scenario) == run.scenario.toml()
