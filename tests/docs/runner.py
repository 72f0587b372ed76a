"""Pages, run: their blocks in order, in one folder and one namespace of Python."""

import shutil
from collections.abc import Sequence
from contextlib import chdir
from pathlib import Path
from typing import Any

from tests.docs.commands import check_commands, run_commands
from tests.docs.comparing import same_output
from tests.docs.data_blocks import check_data, whole
from tests.docs.directives import Directives, PageError
from tests.docs.pages import ROOT, Block
from tests.docs.python_blocks import run_python


def run_blocks(page: Sequence[Block], folder: Path) -> None:
    """Run or check the blocks of a page in a folder; the first that is not as the page says is a PageError."""
    names: dict[str, Any] = {}
    printed: str | None = None
    with chdir(folder):
        for block in page:
            _give(block)
            printed = _prepare(block, names) if block.directives.setups else printed
            if block.language != "text":
                printed = _run(block, names)
            elif not block.directives.skipped:
                _compare(block, printed)
                printed = None


def check_unrun(block: Block) -> None:
    """Check what can be checked of a block without running it."""
    if block.language == "sh":
        check_commands(block)


def _give(block: Block) -> None:
    for source, name in block.directives.given:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / source, name)


def _prepare(block: Block, names: dict[str, Any]) -> str:
    """Do what is to be done before a block, and return what that printed."""
    printed = ""
    for language, text in block.directives.setups:
        hidden = Block(block.page, block.line, language, text, Directives())
        if language == "sh":
            printed += run_commands(hidden)
        else:
            names["ROOT"] = ROOT
            printed += run_python(hidden.where, text, names)
            names.pop("ROOT", None)
    return printed


def _run(block: Block, names: dict[str, Any]) -> str | None:
    """Run a block and return what it printed; None for one that is not run."""
    if block.directives.skipped:
        check_unrun(block)
        return None
    if block.directives.file:
        path = Path(block.directives.file)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(whole(block), encoding="utf-8")
    if block.language == "sh":
        return run_commands(block)
    if block.language != "python":
        check_data(block)
        return ""
    if block.directives.file:
        compile(block.text, block.where, "exec")
        return ""
    try:
        return run_python(block.where, block.text, names)
    except PageError:
        raise
    except Exception as error:
        raise PageError(f"{block.where}: {type(error).__name__}: {error}") from error


def _compare(block: Block, printed: str | None) -> None:
    if printed is None:
        raise PageError(f"{block.where}: the output of no block; say why: <!-- not run: formula --> or drawing, template")
    if not same_output(block.text, printed):
        raise PageError(f"{block.where}: shows\n{block.text}\nprinted was\n{printed}")
