"""Pages of the documents: their code blocks, with the directives above them, and what they have in running text."""

import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

from tests.docs.directives import Directives, PageError, looks_like_one

ROOT = Path(__file__).parents[2]
BESIDE = Path(__file__).parent / "beside"  # of pages that are to be free of directives: NAME.toml
_COMMENT = re.compile(r"<!--(.*?)-->", re.S)


def all_pages() -> list[Path]:
    """Return every page of Markdown that a reader may meet."""
    return sorted([*ROOT.glob("*.md"), ROOT / "fuzzy_arbiter" / "README.md", *(ROOT / "docs").rglob("*.md")])


def page_name(page: Path) -> str:
    """Return the path from the repository, or the name of a page elsewhere."""
    return page.relative_to(ROOT).as_posix() if page.is_relative_to(ROOT) else page.name


@dataclass(frozen=True)
class Block:
    """A fenced block: `line` is that of its first line of code, from 1."""

    page: str
    line: int
    language: str
    text: str
    directives: Directives

    @property
    def where(self) -> str:
        return f"{self.page}:{self.line}"


def blocks(page: Path) -> list[Block]:
    """Return the code blocks of a page, in order; what no rule covers is a PageError."""
    tokens = MarkdownIt("commonmark").parse(page.read_text(encoding="utf-8"))
    return list(_blocks(page_name(page), tokens, _beside(page)))


def _beside(page: Path) -> dict[str, list[str]]:
    """Return the directives of a page's blocks from a separate file, by the beginning of a block."""
    path = (BESIDE / page_name(page)).with_suffix(".toml")
    return tomllib.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def inline_code(page: Path) -> list[tuple[int, str]]:
    """Return line and text of every piece of code in running text and tables."""
    found = []
    tokens = MarkdownIt("commonmark").enable("table").parse(page.read_text(encoding="utf-8"))
    for token in tokens:
        line = token.map[0] + 1 if token.map else 0
        found += [(line, child.content) for child in token.children or [] if child.type == "code_inline"]
    return found


def _blocks(name: str, tokens: list[Token], beside: dict[str, list[str]]) -> Iterator[Block]:
    above: list[str] = []  # comments that await their fence
    awaited = dict(beside)
    for token in tokens:
        line = token.map[0] + 1 if token.map else 0
        if token.type == "html_block":
            above += [text.strip("\n ") for text in _COMMENT.findall(token.content)]
        elif token.type == "fence":
            language = token.info.strip()
            where = f"{name}:{line + 1}"
            if not language:
                raise PageError(f"{where}: a block without a language")
            for begins in [begins for begins in awaited if token.content.startswith(begins)]:
                above += awaited.pop(begins)
            yield Block(name, line + 1, language, token.content, Directives.read(where, above))
            above = []
        elif token.type == "code_block":
            raise PageError(f"{name}:{line}: an indented block: use a fence with a language")
        else:
            _refuse_lost(f"{name}:{line}", above)
            above = []
    _refuse_lost(f"{name}: end", above)
    if awaited:
        raise PageError(f"{name}: no block begins with {next(iter(awaited))!r}, as {BESIDE.name}/ has it")


def _refuse_lost(where: str, comments: list[str]) -> None:
    for text in comments:
        if looks_like_one(text):
            raise PageError(f"{where}: no block follows the directive {text.splitlines()[0]!r}")
