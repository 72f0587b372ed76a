"""Tables of what users get wrong: in a line of tests/data/refusals a request, and parts of the one-line answer."""

import pytest

from tests.conftest import DATA


def refusals(name, marks=lambda asked: ()):
    """Return the cases of a table; `marks` of a request are those of its case."""
    lines = (DATA / "refusals" / f"{name}.txt").read_text(encoding="utf-8").splitlines()
    cases = [line.split(" => ") for line in lines]
    return [pytest.param(asked, said.split(" ... "), marks=marks(asked), id=asked) for asked, said in cases]
