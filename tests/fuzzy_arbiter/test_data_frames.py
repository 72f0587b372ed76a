"""Data frames of pandas as inputs; other columns are ignored."""

import pytest

from fuzzy_arbiter import Arbiter, Result
from fuzzy_arbiter.errors import InputError
from tests.fuzzy_arbiter.test_inputs_and_results import ROWS, TIPPING

pd = pytest.importorskip("pandas")


@pytest.fixture
def tipping():
    return Arbiter(system=TIPPING)


@pytest.fixture
def frame():
    service, food = zip(*ROWS, strict=True)
    return pd.DataFrame({"who": ["a", "b", "c"], "food": food, "service": service}, index=[7, 5, 3])


def test_data_frame_gives_columns_by_name(tipping, frame):
    columns = tipping.batch(frame)
    assert isinstance(columns, Result)
    assert columns["tip"].tolist() == tipping.batch(ROWS)[:, 0].tolist()
    assert frame.assign(**columns._asdict())["tip"].tolist() == columns["tip"].tolist()


def test_data_frame_row_is_a_sample(tipping, frame):
    for i, row in enumerate(ROWS):
        assert tipping(frame.iloc[i]) == tipping(row)
        assert tipping.explain(frame.iloc[i]) == tipping.explain(row)


@pytest.mark.parametrize(
    ("ask", "fault"),
    [
        (lambda a: a.batch(pd.DataFrame({"service": [1.0]})), "food: column is missing in service; expected"),
        (
            lambda a: a.batch(pd.DataFrame([[1, 2, 3]], columns=["food", "food", "service"])),
            "food: column stands twice",
        ),
        (lambda a: a.batch(pd.DataFrame({"service": [3, None], "food": [4, 5]})), "row 1: service is nan"),
        (lambda a: a.batch(pd.DataFrame({"service": [3, 99], "food": [4, 5]})), "row 1: service is 99.0, expected a n"),
        (
            lambda a: a.batch(pd.DataFrame({"service": ["3"], "food": [4]})),
            "got a text among the values; expected rows of num",
        ),
        (lambda a: a(pd.DataFrame({"service": [3], "food": [4]})), "service: input is .*; for columns there is batch"),
        (lambda a: a(pd.Series([3.0, 4.0])), "service: input is missing"),
    ],
)
def test_mismatched_data_frames_are_rejected(tipping, ask, fault):
    with pytest.raises(InputError, match=fault):
        ask(tipping)
