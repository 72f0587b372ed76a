"""Comparisons of laws on the same scenes, and paired statistics."""

import json
import math

import pytest

from controller import LAWS, IsmailDunniganLaw
from controller.paper_law import Gains
from cosim.campaigns.comparison import compare, medians_where_completed, paired_differences
from cosim.campaigns.pages.comparison_page import write_comparison_page
from cosim.campaigns.scenes.flyer import Score
from cosim.campaigns.scenes.scene_rows import row_of
from cosim.errors import RunError
from tests.cosim.campaigns.scene_data import BRIEF, HARD, results_of, write


class Idle(IsmailDunniganLaw):
    """A law that commands zero."""

    name = "idle"

    @staticmethod
    def function(state, goal, regions, weights, gains, memory, forces):
        forces[:] = 0.0


@pytest.fixture
def idle(monkeypatch):
    monkeypatch.setitem(LAWS, "idle", Idle)


@pytest.fixture
def scenes(tmp_path):
    return write(tmp_path / "scenes.jsonl", HARD[:2])


@pytest.mark.medium
def test_laws_are_compared_on_the_same_scenes(tmp_path, scenes, idle):
    out = tmp_path / "out"
    done = compare(scenes, ["ismail_dunnigan", "idle"], out, BRIEF, {"ismail_dunnigan": Gains(k_p1=9.0)})
    assert sorted(p.name for p in out.iterdir()) == ["compare.json", "idle", "ismail_dunnigan"]
    numbers = json.loads((out / "compare.json").read_text())
    assert numbers == done.numbers and numbers["scenes"] == 2
    assert numbers["laws"]["ismail_dunnigan"]["gains"]["k_p1"] == 9.0
    assert numbers["laws"]["idle"] == json.loads((out / "idle" / "summary.json").read_text())
    assert done.campaigns["idle"].results["effort"].tolist() == [0.0, 0.0]
    (paired,) = numbers["paired"]
    assert paired["laws"] == ["ismail_dunnigan", "idle"] and paired["neither"] == 2 and paired["p"] is None


@pytest.mark.parametrize(
    ("laws", "words"),
    [
        (["ismail_dunnigan"], "expected two or more"),
        (["ismail_dunnigan", "ismail_dunnigan"], "each once"),
        (["ismail_dunnigan", "nil"], "'nil'"),
    ],
)
def test_invalid_law_selection_is_rejected(tmp_path, scenes, laws, words):
    with pytest.raises(RunError, match=words):
        compare(scenes, laws, tmp_path / "out", BRIEF)
    assert not (tmp_path / "out").exists()


def test_foreign_folder_is_rejected(tmp_path, scenes, idle):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "precious").write_text("x")
    with pytest.raises(RunError, match="holds 'precious'"):
        compare(scenes, ["ismail_dunnigan", "idle"], tmp_path / "out", BRIEF)
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["precious"]


@pytest.fixture
def results(tmp_path):
    def of(name, *scores):
        return results_of(tmp_path / name, [row_of(i, score, 0.01) for i, score in enumerate(scores)])

    return of


def score(time, clearance, effort):
    return Score(math.isfinite(time), time, clearance, effort, 1.0, 1e-6, -1)


def test_paired_comparison_uses_scenes_completed_by_either_law(results):
    mine = results(
        "mine", score(30.0, 0.1, 100.0), score(40.0, -0.1, 1.0), score(math.inf, 0.1, 2.0), score(50.0, 0.0, 200.0)
    )
    other = results(
        "other", score(60.0, 0.1, 50.0), score(1.0, 0.1, 1.0), score(1.0, 0.1, 1.0), score(math.inf, 0.3, 70.0)
    )
    both = {"mine": mine, "other": other}
    assert medians_where_completed("mine", "other", both) == {
        "completed_by": "mine", "scenes": 2, "beside": "other", "completed_by_both": 1,
        "reach_time": {"mine": 40.0, "other": None},  # between 60 s and never
        "effort": {"mine": 150.0, "other": 60.0},
    }  # fmt: skip
    assert medians_where_completed("other", "mine", both) == {
        "completed_by": "other", "scenes": 3, "beside": "mine", "completed_by_both": 1,
        "reach_time": {"other": 1.0, "mine": 40.0}, "effort": {"other": 1.0, "mine": 2.0},
    }  # fmt: skip


def test_differences_use_scenes_completed_by_both_laws(results):
    mine = results("mine", *(score(time, 0.1, 10.0 * time) for time in (3.0, 5.0, 9.0, math.inf)))
    other = results("other", *(score(time, 0.1, 10.0 * time) for time in (1.0, 4.0, math.inf, 2.0)))
    found = paired_differences("mine", "other", {"mine": mine, "other": other})
    assert [found[name] for name in ("both", "only_one", "only_other", "neither")] == [2, 1, 1, 0]
    assert found["differences"]["reach_time"]["median"] == 1.5 and found["differences"]["effort"]["median"] == 15.0


@pytest.mark.parametrize("laws", [{}, [], None, {"none": {}}])
def test_comparison_without_laws_is_rejected(tmp_path, laws):
    (tmp_path / "compare.json").write_text(json.dumps({"laws": laws}))
    with pytest.raises(RunError, match="holds no comparison of laws"):
        write_comparison_page(tmp_path, 0)
