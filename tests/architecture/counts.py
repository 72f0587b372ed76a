"""Count modules, lines and words of the repository: ``python -m tests.architecture.counts``."""

import ast
import io
import re
import statistics
import sys
import tokenize
from collections import Counter
from dataclasses import astuple, dataclass
from pathlib import Path

from tests.architecture import public
from tests.architecture.modules import FILES, PACKAGES, ROOT, tree_of
from tests.architecture.rooms import room_of

# other languages of the product: what a comment is in them, and their names in the table
_COMMENTS = {
    (".c", ".h"): ("C", re.compile(r"/\*.*?\*/|//[^\n]*", re.S)),
    (".js",): ("JavaScript", re.compile(r"/\*.*?\*/|^\s*//[^\n]*", re.S | re.M)),
    (".css",): ("CSS", re.compile(r"/\*.*?\*/", re.S)),
}
_DOCUMENTED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef

# pages that the code writes from its own tables; and such tables within pages: of figures, and of a scenario's keys
GENERATED = ("docs/fmu-variables.md", "docs/reference/command-line.md")
_GENERATED_PARTS = re.compile(
    r"<!-- figures: .*?<!-- end of figures -->|^\| key \| unit \| default \| meaning \|\n.*?\n\n", re.S | re.M
)


def words_by_hand(page: Path) -> int:
    """Return the number of handwritten words of a page, without generated ones."""
    if page.relative_to(ROOT).as_posix() in GENERATED:
        return 0
    return len(_GENERATED_PARTS.sub("", page.read_text(encoding="utf-8")).split())


@dataclass
class Lines:
    """Line counts of Python text, by purpose."""

    code: int = 0  # without docstrings, comments and blank lines
    docstrings: int = 0  # all lines of docstrings
    comments: int = 0  # lines that hold nothing but a comment

    def __add__(self, other: "Lines") -> "Lines":
        return Lines(*(a + b for a, b in zip(astuple(self), astuple(other), strict=True)))


def python_lines(path: Path) -> Lines:
    """Count the lines of a Python file by purpose."""
    docstrings: set[int] = set()
    for node in ast.walk(tree_of(path)):
        if isinstance(node, _DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
            docstrings |= set(range(node.body[0].lineno, (node.body[0].end_lineno or 0) + 1))
    code: set[int] = set()
    comments = set()
    layout = {tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER, tokenize.ENCODING}
    for token in tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline):
        if token.type == tokenize.COMMENT:
            comments.add(token.start[0])
        elif token.type not in layout:
            code |= set(range(token.start[0], token.end[0] + 1))
    return Lines(len(code - docstrings), len(docstrings), len(comments - code))


def lines_per_room() -> dict[str, Lines]:
    """Count the Python lines of each room of `cosim` and of each other package."""
    rooms: dict[str, Lines] = {}
    for module, path in FILES.items():
        parts = module.split(".")
        inside = parts[0] == "cosim" and (len(parts) > 2 or path.name == "__init__.py")
        room = ".".join(parts[: 2 if inside else 1])
        rooms[room] = rooms.get(room, Lines()) + python_lines(path)
    return rooms


def lines_of_other_languages() -> Counter[str]:
    """Count the lines of C, JavaScript and CSS of the four packages, without comments and blank lines."""
    counts: Counter[str] = Counter()
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*")):
            for suffixes, (language, comment) in _COMMENTS.items():
                if path.suffix in suffixes:
                    text = comment.sub("", path.read_text(encoding="utf-8"))
                    counts[language] += sum(bool(line.strip()) for line in text.splitlines())
    return counts


def lines_of_tests() -> int:
    """Count all lines of the tests."""
    return sum(len(path.read_text(encoding="utf-8").splitlines()) for path in (ROOT / "tests").rglob("*.py"))


def lines_of_public_docstrings() -> int:
    """Count the docstring lines of public names and their members."""
    targets = {what.path: what for what in map(public.target, public.names())}
    members = [m for what in targets.values() if what.is_class for m in public.members(what)]
    documented = {what.path: what for what in [*targets.values(), *members]}.values()
    return sum(
        (what.docstring.endlineno or 0) - (what.docstring.lineno or 0) + 1 for what in documented if what.docstring
    )


def table() -> list[tuple[str, str]]:
    """Return each count with what it counts."""
    folders = Counter(room_of(module) for module in FILES)
    lines = {module: len(path.read_text(encoding="utf-8").splitlines()) for module, path in FILES.items()}
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    by_hand = {page.relative_to(ROOT).as_posix(): words_by_hand(page) for page in pages}
    generated = sum(len(page.read_text(encoding="utf-8").split()) for page in pages) - sum(by_hand.values())
    longest = max(lines, key=lambda module: lines[module])
    rooms, others = lines_per_room(), lines_of_other_languages()
    product = sum(rooms.values(), Lines())
    return [
        ("lines of Python code", str(product.code)),
        *((f"  {room}", f"{count.code}, docstrings {count.docstrings}") for room, count in sorted(rooms.items())),
        ("lines of C, JavaScript, CSS", f"{others.total()}: {', '.join(f'{k} {n}' for k, n in others.items())}"),
        ("lines of docstrings", f"{product.docstrings}, of public names {lines_of_public_docstrings()}"),
        ("lines of comments", str(product.comments)),
        ("lines of tests", str(lines_of_tests())),
        ("modules of the four packages", str(len(FILES))),
        ("folders of the four packages", str(len(folders))),
        ("modules per folder, greatest", ", ".join(f"{room} {n}" for room, n in folders.most_common(5))),
        ("modules at cosim's root", str(folders["cosim"])),
        ("lines of a module, median", f"{statistics.median(lines.values()):g}"),
        ("lines of a module, greatest", f"{lines[longest]} ({longest})"),
        ("public names", str(len(public.names()))),
        ("words of README and docs, by hand", str(sum(by_hand.values()))),
        ("  longest pages", ", ".join(f"{page} {n}" for page, n in Counter(by_hand).most_common(5))),
        (
            "  generated besides",
            f"{generated}: {', '.join(GENERATED)}; tables of figures and keys",
        ),
    ]


def main() -> None:
    """Print the counts."""
    rows = table()
    width = max(len(name) for name, _ in rows)
    sys.stdout.write("".join(f"{name:<{width}}  {value}\n" for name, value in rows))


if __name__ == "__main__":
    main()
