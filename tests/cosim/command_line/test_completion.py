"""Shells complete verbs, flags, shipped scenarios and files."""

import shutil
import subprocess

import pytest

from cosim.command_line.cli import _parser, all_verbs, main


@pytest.fixture
def script(capsys, tmp_path):
    def written(shell):
        assert main(["help", "--completion", shell]) == 0
        path = tmp_path / f"cosim.{shell}"
        path.write_text(capsys.readouterr().out)
        return path

    return written


def shell(name):
    return pytest.param(name, marks=pytest.mark.skipif(shutil.which(name) is None, reason=f"there is no {name}"))


_COMPLETE = {
    "bash": 'source {script}; COMP_WORDS=({words} "{last}"); COMP_CWORD={n}; _shtab_cosim; echo "${{COMPREPLY[@]}}"',
    "fish": 'source {script}; complete -C "{words} {last}" | string split -f1 \\t; true',
}


@pytest.mark.parametrize("name", [shell("bash"), shell("fish")])
@pytest.mark.parametrize(
    ("words", "last", "expected"),
    [
        ("cosim", "ca", {"campaign"}), ("cosim run", "paper-l", {"paper-limited"}), ("cosim run", "mi", {"mine.toml"}),
        ("cosim run", "sce", {"scenes"}), ("cosim run --set x", "dock", {"docking"}),
        ("cosim run --profile", "a", {"ardusub"}), ("cosim export --to ssp", "paper-l", {"paper-limited"}),
        ("cosim sweep paper", "--sche", {"--scheduler"}), ("cosim mavlink", "li", {"listen"}),
        ("cosim mavlink stream", "--allow-s", {"--allow-system"}), ("cosim help", "sw", {"sweep"}),
        ("cosim help --completion", "f", {"fish"}),
    ],
)  # fmt: skip
def test_shells_complete_verbs_flags_scenarios_and_files(name, words, last, expected, script, tmp_path):
    (tmp_path / "mine.toml").touch()
    (tmp_path / "mine.txt").touch()
    (tmp_path / "scenes").mkdir()
    code = _COMPLETE[name].format(script=script(name), words=words, last=last, n=len(words.split()))
    done = subprocess.run([name, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert {word.rstrip("/") for word in done.stdout.split()} == expected


@pytest.mark.parametrize("name", ["bash", "zsh", "fish"])
def test_completion_script_covers_every_verb_and_is_valid_shell_code(name, script):
    text = script(name).read_text()
    assert "paper-calibrated" in text
    assert [verb for verb, _ in all_verbs(_parser()) if verb.split()[-1] not in text] == []
    if shutil.which(name):
        done = subprocess.run([name, "-n", str(script(name))], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")
