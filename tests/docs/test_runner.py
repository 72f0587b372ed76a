"""The page runner: incorrect pages fail. The correct ones are the documents themselves."""

import re

import pytest

from tests.docs.comparing import same_output, same_value, shown_result
from tests.docs.directives import PageError
from tests.docs.pages import blocks
from tests.docs.runner import check_unrun, run_blocks


@pytest.fixture
def run(tmp_path):
    """Return a function that runs a page of a given text, in a folder of its own, which it returns."""

    def run_text(text):
        page = tmp_path / "page.md"
        page.write_text(text)
        folder = tmp_path / "folder"
        folder.mkdir()
        run_blocks(blocks(page), folder)
        return folder

    return run_text


def fence(language, text, *directives):
    return "\n".join(["", *(f"<!-- {directive} -->" for directive in directives), f"```{language}", text, "```", ""])


WRONG = [
    (fence("python", "1 / 3  # 0.334"), "shows 0.334, is 0.333"),
    (fence("python", "if True:\n    'a'  # 'b'"), "page.md:4: shows 'b', is 'a'"),
    (fence("python", "print(2)  # 3"), "shows 3, printed 2"),
    (fence("python", "x = 2  # 3"), "shows 3, is 2"),
    (fence("python", "(1, 2)  # (1, 2"), "looks like a result"),
    (fence("python", "x = [\n  2,  # 3\n]"), "nobody checks"),
    (fence("python", "x = 1\nx / 0"), "page.md:3: ZeroDivisionError"),
    (fence("python", "x = = 1"), "no Python"),
    (fence("python", "1 / 0", "alone"), "ZeroDivisionError"),
    (fence("python", "1  # 1", "alone"), "print them"),
    (fence("sh", "cosim show nothing"), "ends with 2, expected 0"),
    (fence("sh", "python -m plant_fmu list", "exits: 1"), "ends with 0, expected 1"),
    (fence("sh", "ls nothing"), "ends with 2"),
    (fence("sh", "frobnicate"), "no command that the tests run"),
    (fence("sh", "ls | cat"), "one command a line"),
    (fence("sh", "$ ls"), "one command a line"),
    (fence("sh", "ls 'a"), "No closing quotation"),
    (fence("sh", "ls \\"), "nothing follows"),
    (fence("sh", "pip install '.[sails]'"), "no extra sails"),
    (fence("sh", "pip install './fuzzy_arbiter[mcap]'"), "fuzzy_arbiter/.* no extra mcap"),
    (fence("sh", "make sail"), "no target sail"),
    (fence("python", "print(1)") + fence("text", "2"), "printed was"),
    (fence("sh", "ardusub", "not run: needs it") + fence("text", "2"), "of no block"),
    (fence("", "x"), "without a language"),
    ("words\n\n    cosim run paper\n", "indented"),
    (fence("cobol", "x"), "nobody checks blocks of 'cobol'"),
    (fence("python", "x = 1", "skip"), "unknown directive 'skip'"),
    ("<!-- not run: needs it -->\n\nwords\n", "no block follows"),
    (fence("python", "x = 1", "not run: later"), "unknown reason"),
    (fence("sh", "cosim run paper --quick", "not run: takes minutes"), "know --quick"),
    (fence("sh", "cosim rerun DIR ROW", "not run: takes minutes"), "invalid int"),
    (fence("toml", "a = 1"), "expected one of"),
    (fence("toml", "a = = 1", "scenario"), "block.toml"),
    (fence("toml", "[time]\nduratoin = 1.0", "scenario onto: paper"), "duratoin"),
    (fence("json", '{"a": 1'), "page.md:3"),
    (fence("json", '{"command": "fly"}', "commands of: harbour"), "is refused"),
    (fence("json", '{"seed": 1}', "scenes"), "start"),
    (fence("c", "int f( { }"), "error"),
    (fence("sh", "ls", 'setup sh "cosim"\nls\n'), "no command begins with 'cosim'"),
]


@pytest.mark.parametrize(("text", "why"), WRONG, ids=[why for _, why in WRONG])
def test_incorrect_blocks_fail(text, why, run):
    with pytest.raises(PageError, match=why):
        run(text)


def test_file_block_is_written_with_its_base_scenario(run):
    folder = run(fence("toml", "[time]\nduration = 5.0", "scenario onto: docking", "file: mine.toml"))
    assert (folder / "mine.toml").read_text().startswith('base = "docking"\n[time]')


def test_unrun_commands_are_checked_for_unknown_flags(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(fence("sh", "cosim run paper --outt runs/a"))
    (block,) = blocks(page)
    with pytest.raises(PageError, match=re.escape("does not know --outt")):
        check_unrun(block)


@pytest.mark.parametrize(
    ("shown", "same", "different"),
    [
        ("0.5", 0.54, 0.56), ("0.50", 0.504, 0.54), ("1", 1, 1.0000001), ("1e3", 1000.4, 2000.0), ("True", True, False),
        ("(0.1, ..., 0.3)", (0.1, 5, 6, 0.3), (0.1, 5, 6, 0.4)), ("{'a': -0.5}", {"a": -0.5}, {"a": 0.5}),
        ('"alpha_3"', "alpha_3", "alpha_2"), ("[1, 2]", [1, 2], [1, 2, 3]), ("[1, 2, 3]", [1, 2, 3], [1, 2]),
    ],
)  # fmt: skip
def test_values_are_compared_to_their_shown_digits(shown, same, different):
    assert same_value(shown, same) and not same_value(shown, different)


def test_only_literals_in_comments_are_results():
    assert shown_result("array([1.0, 2.0])") == "array([1.0, 2.0])"
    assert shown_result("inside: (1, 2)") == "(1, 2)"
    assert not any(map(shown_result, ("meters", "f(2)", "[deg C]")))


def test_output_is_compared_by_lines():
    assert same_output("a\n...\nd", "a  \nb\nc\nd\n") and same_output("took ... s", "took 0.3 s\n")
    assert not same_output("a\nb", "a b\n") and not same_output("a", "a\nb\n")


def test_separate_directive_without_a_block_is_rejected(tmp_path, monkeypatch):
    monkeypatch.setattr("tests.docs.pages.BESIDE", tmp_path)
    (tmp_path / "page.toml").write_text('"cosim show" = ["slow"]\n"cosim fly" = ["slow"]\n')
    (tmp_path / "page.md").write_text(fence("sh", "cosim show paper"))
    with pytest.raises(PageError, match=re.escape("page.md: no block begins with 'cosim fly'")):
        blocks(tmp_path / "page.md")
