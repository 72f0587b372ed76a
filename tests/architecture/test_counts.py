"""Size counts of the repository."""

from tests.architecture import counts
from tests.architecture.modules import ROOT


def test_generated_pages_do_not_count_as_handwritten():
    for page in counts.GENERATED:
        assert counts.words_of(ROOT / page) > 1000 and counts.words_by_hand(ROOT / page) == 0
    assert counts.words_of(ROOT / "README.md") == counts.words_by_hand(ROOT / "README.md")
