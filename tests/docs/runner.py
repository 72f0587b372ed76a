"""Run the blocks of a page in order, in one folder and one Python namespace."""

import shutil
from collections.abc import Sequence
from contextlib import ExitStack, chdir
from pathlib import Path
from typing import Any

from tests.docs.commands import check_commands, run_commands
from tests.docs.comparing import same_output
from tests.docs.data_blocks import check_data, whole
from tests.docs.directives import Directives, PageError
from tests.docs.pages import ROOT, Block
from tests.docs.ports import Ports
from tests.docs.python_blocks import run_alone, run_python


def run_blocks(page: Sequence[Block], folder: Path) -> None:
    """Run or check the blocks of a page in a folder; the first that is not as the page says is a PageError."""
    ports = Ports()
    with chdir(folder), ExitStack() as stack:
        run = _PageRun(stack)
        for block in page:
            if block.directives.skipped:
                check_unrun(block)
                continue
            printed = run.done(ports.block(block))
            if block.language == "text":
                _compare(block, ports.shown(run.printed))
            elif printed is not None:
                run.printed = printed


def check_unrun(block: Block) -> None:
    """Check what can be checked of a block without running it."""
    if block.language == "sh":
        check_commands(block)


class _PageRun:
    """What the blocks of a page share; `printed` is what the last one gave."""

    def __init__(self, stack: ExitStack) -> None:
        self.names: dict[str, Any] = {}
        self.printed = ""
        self._stack = stack

    def done(self, block: Block) -> str | None:
        """Run or check a block and return what it printed; None for a block of text, which another one gives."""
        for source, name in block.directives.given:
            Path(name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / source, name)
        setups = list(block.directives.setups)
        self._set_up(block, setups, [])
        if block.language == "text":
            return None
        if block.directives.file:
            path = Path(block.directives.file)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(whole(block), encoding="utf-8")
        if block.language == "sh":
            printed = run_commands(block, lambda words: self._set_up(block, setups, words))
            if setups:
                raise PageError(f"{block.where}: no command begins with {setups[0][0]!r}, which a setup waits for")
            return printed
        if block.language != "python":
            check_data(block)
            return ""
        if block.directives.file:
            compile(block.text, block.where, "exec")
            return ""
        return self._python(block)

    def _python(self, block: Block) -> str:
        if block.directives.alone:
            return run_alone(block.where, block.text)
        try:
            return run_python(block.where, block.text, self.names)
        except PageError:
            raise
        except Exception as error:
            raise PageError(f"{block.where}: {type(error).__name__}: {error}") from error

    def _set_up(self, block: Block, setups: list[tuple[str, str, str]], words: list[str]) -> None:
        """Run and remove the setups of a command, or without words those of the block."""
        for setup in [one for one in setups if one[0].split() == words[: len(one[0].split())]]:
            setups.remove(setup)
            hidden = Block(block.page, block.line, setup[1], setup[2], Directives())
            if hidden.language == "sh":
                self.printed = run_commands(hidden)
                continue
            given = {"ROOT": ROOT, "STACK": self._stack}
            self.names |= given
            self.printed = self._python(hidden)
            for name in given:
                self.names.pop(name, None)


def _compare(block: Block, printed: str) -> None:
    if not printed:
        raise PageError(
            f"{block.where}: the output of no block; say why: <!-- not run: formula --> or drawing, template"
        )
    if not same_output(block.text, printed):
        raise PageError(f"{block.where}: shows\n{block.text}\nprinted was\n{printed}")
