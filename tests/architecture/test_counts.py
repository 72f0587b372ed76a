"""Size counts of the repository and the list of banned words."""

import shutil
import subprocess

import pytest

from tests.architecture import banned, counts, coverage
from tests.architecture.modules import ROOT


def test_banned_words_are_absent():
    found = list(banned.find_all())
    assert not found, "\n".join(found)


def test_banned_lists_are_sorted_without_duplicates():
    for words in (banned.IDENTIFIERS, banned.PHRASES):
        assert list(words) == sorted(set(words))


def test_identifiers_are_banned_as_whole_names():
    source = 'def heed(order):\n    """Heed the order."""\n    heeded = order.heed()\n    return heeded, "heed"\n'
    assert banned.find_identifiers(source, ("heed",)) == [(1, "heed"), (3, "heed")]
    assert banned.find_identifiers(source, ("order_of",)) == []


def test_phrases_are_banned_across_lines_and_in_any_case():
    source = 'x = "as it came"\n\n\ndef f():\n    """Keep it As it\n    came."""\n    # and as it\n    # came here\n'
    assert banned.find_phrases(banned.prose(source), ("as it came",)) == ["as it came"]
    assert banned.find_phrases(banned.prose('x = "as it came"\n'), ("as it came",)) == []
    assert banned.find_phrases("as it comes", ("as it come",)) == []


@pytest.mark.skipif(shutil.which("wc") is None, reason="there is no wc")
def test_word_counts_equal_those_of_wc():
    pages = counts.pages()
    done = subprocess.run(["wc", "-w", *pages], capture_output=True, text=True, check=True, env={"LC_ALL": "C.UTF-8"})
    assert [int(line.split()[0]) for line in done.stdout.splitlines()[:-1]] == [counts.words_of(p) for p in pages]


@pytest.mark.slow  # all of the code is read
def test_counts_are_printed(capsys):
    counts.main()
    printed = capsys.readouterr().out
    assert f"modules at cosim's root            {counts.modules_per_folder()['cosim']}\n" in printed
    assert "banned words found" in printed


def test_generated_pages_do_not_count_as_handwritten():
    for page in counts.GENERATED:
        assert counts.words_of(ROOT / page) > 1000 and counts.words_by_hand(ROOT / page) == 0
    for page in ("docs/performance.md", "docs/scenarios.md"):
        assert counts.words_of(ROOT / page) - counts.words_by_hand(ROOT / page) > 500
    assert counts.words_of(ROOT / "README.md") == counts.words_by_hand(ROOT / "README.md")


def test_coverage_is_measured_by_tests_that_exist():
    assert [test for part in coverage.PARTS for test in part.tests if not (ROOT / test).exists()] == []
