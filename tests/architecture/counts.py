"""Count modules, lines and words of the repository: ``python -m tests.architecture.counts``."""

import re
import statistics
import sys
from collections import Counter
from pathlib import Path

from tests.architecture import banned, public
from tests.architecture.modules import FILES, ROOT
from tests.architecture.rooms import room_of

# pages that the code writes from its own tables; and such tables within pages: of figures, and of a scenario's keys
GENERATED = ("docs/fmu-variables.md", "docs/reference/command-line.md")
_GENERATED_PARTS = re.compile(
    r"<!-- figures: .*?<!-- end of figures -->|^\| key \| unit \| default \| meaning \|\n.*?\n\n", re.S | re.M
)


def pages() -> list[Path]:
    """Return README and the pages of the documents."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def words_of(page: Path) -> int:
    """Return how many words a page has, as ``wc -w`` counts them."""
    return len(page.read_text(encoding="utf-8").split())


def words_by_hand(page: Path) -> int:
    """Return the number of handwritten words of a page, without generated ones."""
    if page.relative_to(ROOT).as_posix() in GENERATED:
        return 0
    return len(_GENERATED_PARTS.sub("", page.read_text(encoding="utf-8")).split())


def modules_per_folder() -> Counter[str]:
    """Return how many Python modules stand in each folder of the four packages."""
    return Counter(room_of(module) for module in FILES)


def lines_per_file() -> dict[str, int]:
    """Return how many lines each module of the four packages has."""
    return {module: len(path.read_text(encoding="utf-8").splitlines()) for module, path in FILES.items()}


def table() -> list[tuple[str, str]]:
    """Return each count with what it counts."""
    folders, lines = modules_per_folder(), lines_per_file()
    all_words = sum(words_of(page) for page in pages())
    by_hand = {page.relative_to(ROOT).as_posix(): words_by_hand(page) for page in pages()}
    longest = max(lines, key=lambda module: lines[module])
    return [
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
            f"{all_words - sum(by_hand.values())}: {', '.join(GENERATED)}; tables of figures and keys",
        ),
        ("banned words found", str(len(list(banned.find_all())))),
    ]


def main() -> None:
    """Print the counts."""
    rows = table()
    width = max(len(name) for name, _ in rows)
    sys.stdout.write("".join(f"{name:<{width}}  {value}\n" for name, value in rows))


if __name__ == "__main__":
    main()
