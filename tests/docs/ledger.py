"""The list of unrun parts of the documents: ``python -m tests.docs.ledger`` writes it anew."""

from pathlib import Path

from tests.docs.commands import not_run
from tests.docs.pages import all_pages, blocks, page_name

LEDGER = Path(__file__).parent / "not_run.txt"


def entries(page: Path) -> list[str]:
    """Return a line for each command, and each block that is none of commands, that is not run."""
    found = []
    for block in blocks(page):
        if block.language == "sh":
            found += not_run(block)
        elif block.directives.skipped:
            found.append((block.directives.skipped, f"{block.language}: {block.text.strip().splitlines()[0].strip()}"))
    return [f"{page_name(page)} | {reason} | {what}" for reason, what in found]


if __name__ == "__main__":
    LEDGER.write_text("".join(f"{entry}\n" for page in all_pages() for entry in entries(page)), encoding="utf-8")
