"""Words that the code and the documents no longer use, from ``banned.toml``."""

import ast
import io
import re
import tokenize
import tomllib
from collections.abc import Iterator
from pathlib import Path

from tests.architecture.modules import ROOT

FOLDERS = ("fuzzy_arbiter", "plant_fmu", "controller", "cosim", "tests", "benchmarks", "docs", "examples")
LISTED = tomllib.loads((Path(__file__).with_name("banned.toml")).read_text(encoding="utf-8"))
IDENTIFIERS: tuple[str, ...] = tuple(LISTED["identifiers"])
PHRASES: tuple[str, ...] = tuple(LISTED["phrases"])
_OLD_NAMES_ALLOWED = {ROOT / "CHANGELOG.md"}  # it says what was renamed


def python_files() -> list[Path]:
    """Return the Python files that are searched."""
    return sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))


def markdown_files() -> list[Path]:
    """Return the pages that are searched."""
    pages = {*ROOT.glob("*.md"), *(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.md"))}
    return sorted(pages - _OLD_NAMES_ALLOWED)


def find_identifiers(source: str, identifiers: tuple[str, ...]) -> list[tuple[int, str]]:
    """Return line and name of each banned name in Python code; a name within a longer one does not count."""
    banned = set(identifiers)
    if not any(name in source for name in banned):
        return []
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    return [(t.start[0], t.string) for t in tokens if t.type == tokenize.NAME and t.string in banned]


def find_phrases(text: str, phrases: tuple[str, ...]) -> list[str]:
    """Return the banned phrases that a text has as whole words, in any case and across line breaks."""
    plain = " ".join(text.split()).lower()
    return [p for p in phrases if re.search(rf"(?<!\w){re.escape(p.lower())}(?!\w)", plain)]


def prose(source: str) -> str:
    """Return the docstrings of Python code, and its comments, joined across lines."""
    tree = ast.parse(source)
    documented = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    texts = [ast.get_docstring(node) or "" for node in ast.walk(tree) if isinstance(node, documented)]
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    comments = [token.string.lstrip("#: ") for token in tokens if token.type == tokenize.COMMENT]
    return "\n\n".join([*texts, "\n".join(comments)])


def find_all() -> Iterator[str]:
    """Yield a line for each banned word that the repository has, with its place."""
    for path in python_files():
        source, where = path.read_text(encoding="utf-8"), path.relative_to(ROOT)
        for line, name in find_identifiers(source, IDENTIFIERS):
            yield f"{where}:{line}: identifier {name}"
        if find_phrases(re.sub(r"\n\s*#", " ", source), PHRASES):  # before the slower search
            yield from (f"{where}: phrase {phrase!r}" for phrase in find_phrases(prose(source), PHRASES))
    for path in markdown_files():
        found = find_phrases(path.read_text(encoding="utf-8"), PHRASES)
        yield from (f"{path.relative_to(ROOT)}: phrase {phrase!r}" for phrase in found)
