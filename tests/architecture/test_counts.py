"""Size counts of the repository and the list of banned words."""

from tests.architecture import banned, counts
from tests.architecture.modules import ROOT


def test_banned_words_are_absent():
    assert "\n".join(banned.find_all()) == ""


def test_banned_lists_are_sorted_without_duplicates():
    for words in (banned.IDENTIFIERS, banned.PHRASES):
        assert list(words) == sorted(set(words))


def test_identifiers_are_banned_as_whole_names_and_phrases_across_lines_in_any_case():
    source = 'def heed(order):\n    """Heed the\n    order."""\n    heeded = order.heed()\n    return heeded, "heed"\n'
    assert banned.find_identifiers(source, ("heed",)) == [(1, "heed"), (4, "heed")]
    assert banned.find_phrases(banned.prose(source), ("heed the order", "heed the orders")) == ["heed the order"]
    assert banned.find_phrases(banned.prose('x = "heed the order"\n'), ("heed the order",)) == []


def test_generated_pages_do_not_count_as_handwritten():
    for page in counts.GENERATED:
        assert counts.words_of(ROOT / page) > 1000 and counts.words_by_hand(ROOT / page) == 0
    assert counts.words_of(ROOT / "README.md") == counts.words_by_hand(ROOT / "README.md")
