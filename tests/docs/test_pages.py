"""Every block and command of every page is run, or checked with a stated reason."""

import re
from pathlib import Path

import pytest

from tests.docs.pages import all_pages, blocks, page_name
from tests.docs.runner import check_unrun, run_blocks

PAGES = all_pages()


def _marks(page: Path) -> list[pytest.MarkDecorator]:
    try:
        return [pytest.mark.slow] if any(block.directives.slow for block in blocks(page)) else []
    except AssertionError:  # the page's test says it
        return []


@pytest.mark.medium
@pytest.mark.parametrize("page", [pytest.param(page, marks=_marks(page), id=page_name(page)) for page in PAGES])
def test_code_blocks_run_with_their_shown_output(page, tmp_path):
    run_blocks(blocks(page), tmp_path)


@pytest.mark.medium(fast=9)
@pytest.mark.parametrize("page", PAGES, ids=page_name)
def test_unrun_code_blocks_are_valid_and_give_a_reason(page):
    for block in blocks(page):
        check_unrun(block)


def test_every_code_block_is_found():
    """A line that begins with a fence opens or closes a block, and every page of the documents is among the pages."""
    assert {"README.md", "docs/arbiter.md", "docs/fmu-variables.md"} <= set(map(page_name, PAGES))
    for page in PAGES:
        assert 2 * len(blocks(page)) == len(re.findall(r"^[ >]*(?:```|~~~)", page.read_text(), re.M)), page
