"""Commands and flags in running text, in tables and in comments exist in the programs."""

import re
import shlex

import pytest

from tests.docs.pages import all_pages, blocks, inline_code, page_name
from tests.docs.programs import MODULES, check_foreign, flags, parses, program, wrong_flags

PAGES = all_pages()
# flags of other programs that the pages speak of
FOREIGN = {
    "--dialect",
    "--editable",
    "--interface-type",
    "--medium",
    "--nthreads",
    "--resolution",
    "--slow",
    "--speedup",
}
OURS = set().union(*(known for name in MODULES for known in flags(name).values()))


def words(text):
    try:
        return shlex.split(text)
    except ValueError:
        return text.split()


def in_comments(block):
    """Return the commands that comments of a block of commands speak of."""
    for line in block.text.splitlines():
        yield from re.findall(r"\b(?:cosim|python -m \w+) [a-z][^;,:)]*", line.partition(" #")[2])


def pieces(page):
    yield from inline_code(page)
    for block in blocks(page):
        if block.language == "sh":
            yield from ((block.line, text) for text in in_comments(block))


@pytest.mark.medium(fast=18)
@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_verbs_and_flags_in_the_text_exist(page):
    wrong = [(line, text, unknown) for line, text in pieces(page) if (unknown := wrong_flags(words(text)))]
    assert not wrong


@pytest.mark.medium(fast=33)
@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_standalone_flags_belong_to_a_known_program(page):
    named = [
        (line, word.partition("=")[0])
        for line, text in inline_code(page)
        for word in re.findall(r"(?<!\S)--[a-z][\w=-]*", text)
    ]
    assert not [(line, flag) for line, flag in named if flag not in OURS | FOREIGN]


@pytest.mark.medium(fast=29)
@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_extras_and_targets_in_the_text_exist(page):
    for _, text in inline_code(page):
        if text.strip():
            check_foreign(words(text))


@pytest.mark.parametrize("name", MODULES)
def test_help_examples_parse(name):
    examples = (MODULES[name]._parser().epilog or "").partition("examples:")[2]
    assert examples.count("\n") > 2 or name in ("plant_fmu", "benchmarks"), "examples of a program that has some"
    for line in filter(None, map(str.strip, examples.splitlines())):
        ours = program(words(line.partition("||")[0]))
        assert ours is not None and parses(*ours) == "", line


def test_nonexistent_verbs_and_flags_are_detected():
    assert wrong_flags(["cosim", "fly", "paper"]) == ["fly"]
    assert wrong_flags(["cosim", "run", "paper", "--quick"]) == ["--quick"]
    assert wrong_flags(["cosim", "replay", "A", "B"]) == []
    assert wrong_flags(["python", "-m", "plant_fmu", "build", "--vehicel", "odin"]) == ["--vehicel"]
    assert wrong_flags(["python", "-m", "benchmarks", "VERB"]) == []
