"""The progress bar on a terminal, and the notice of a compilation."""

import io
import logging
import sys

import pytest

from cosim.command_line import cli
from cosim.run.progress import COMPILING_NOTICE, ProgressBar, announce_compilation


@pytest.fixture(autouse=True)
def compilation_notice():
    """Leave the notice of a compilation on, which other tests silence."""


def compiles():
    """Log the record that a library emits before it is compiled."""
    logging.getLogger("controller.compiling.first_use").info("compiling")


class Terminal(io.StringIO):
    """A standard error that is one."""

    def isatty(self):
        return True


def test_compilation_is_announced_once_if_it_happens():
    notices = []
    with announce_compilation(notices.append):
        assert notices == []
        compiles()
        compiles()
    assert notices == [COMPILING_NOTICE]
    compiles()
    assert notices == [COMPILING_NOTICE]


def test_cached_function_announces_no_compilation(monkeypatch, tmp_path):
    from controller.compiling import library

    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(tmp_path / name))
    text = "void entry(const void *words);\nvoid entry(const void *words) { (void)words; }\n"
    notices = []
    for expected in ([COMPILING_NOTICE], [COMPILING_NOTICE, COMPILING_NOTICE][:1]):
        library.load_library.cache_clear()
        with announce_compilation(notices.append):
            library.load_library(text)
        assert notices == expected


def test_compilation_notice_does_not_break_the_progress_bar(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with announce_compilation(lambda words: terminal.write(f"{words}\n")):
        with ProgressBar(True, "{desc} {n:.0f}/{total:.0f}", desc="paper", total=10.0, mininterval=0.0) as bar:
            bar.update_to(2.0)
            compiles()
            bar.update_to(12.0)
    lines = [line.split("\r")[-1].strip() for line in terminal.getvalue().split("\n")]
    assert lines == [COMPILING_NOTICE, "paper 10/10", ""]


def test_no_progress_bar_without_a_terminal(capsys):
    with ProgressBar(True, "{n}", total=3) as bar:
        bar.update(2)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(("flags", "said"), [([], f"cosim: {COMPILING_NOTICE}\n"), (["-q"], "")])
def test_every_verb_announces_compilation_unless_quiet(flags, said, capsys, monkeypatch):
    monkeypatch.setattr("cosim.command_line.show.show", lambda options: compiles() or 0)
    assert cli.main([*flags, "show", "paper"]) == 0
    assert capsys.readouterr() == ("", said)
