"""Commands and flags in running text, in tables and in comments exist in the programs."""

import re
import shlex

import pytest

from docs.reference.command_line import verbs
from tests.docs.pages import ROOT, all_pages, blocks, inline_code, page_name
from tests.docs.programs import MODULES, check_foreign, flags, parses, program, wrong_flags

PAGES = all_pages()
# flags of other programs that the pages speak of
FOREIGN = {
    "--dialect", "--editable", "--interface-type", "--medium", "--nthreads", "--resolution", "--slow", "--speedup",
}  # fmt: skip
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
    parser = MODULES[name]._parser()
    helps = {name: parser.epilog or ""} | {verb: one.epilog or "" for verb, one, _ in verbs(parser)}
    assert name != "cosim" or all("examples:" in text and ROOT.joinpath(text.split()[-1]).exists()
                                  for verb, text in helps.items() if verb != name)  # fmt: skip
    lines = [line for text in helps.values() for line in text.partition("examples:")[2].splitlines() if "  " in line]
    assert len(lines) > 2 or name in ("plant_fmu", "benchmarks"), "examples of a program that has some"
    for line in map(str.strip, lines):
        ours = program(words(line.partition("||")[0].partition(" > ")[0]))
        assert ours is not None and parses(*ours) == "", line


def test_nonexistent_verbs_and_flags_are_detected():
    assert wrong_flags(["cosim", "fly", "paper"]) == ["fly"]
    assert wrong_flags(["cosim", "run", "paper", "--quick"]) == ["--quick"]
    assert wrong_flags(["cosim", "replay", "A", "B"]) == ["replay"]
    assert wrong_flags(["python", "-m", "plant_fmu", "build", "--vehicel", "odin"]) == ["--vehicel"]
    assert wrong_flags(["python", "-m", "benchmarks", "VERB"]) == []
