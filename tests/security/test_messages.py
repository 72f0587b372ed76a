"""D11: every message is one printable line that names its file or key and quotes little of the input."""

import inspect
import logging
import os

import pytest

import controller.errors
import cosim.errors
import fuzzy_arbiter.errors
import plant_fmu.errors
from cosim.command_line.cli import _Lines
from cosim.command_line.cli import main as cosim_main
from cosim.command_line.process import run_guarded
from fuzzy_arbiter.__main__ import main as fuzzy_main
from plant_fmu.__main__ import main as plant_main

BASES = [
    controller.errors.ControllerError, cosim.errors.CosimError, fuzzy_arbiter.errors.ArbiterError,
    plant_fmu.errors.PlantFmuError,
]  # fmt: skip
COMMANDS_LOG = "\x1b[31m\x9b2J\u202e\n\r\x07"  # to a terminal
SHOWN = r"\x1b[31m\x9b2J\u202e"


def test_d11_message_sanitizers_of_all_packages_are_identical():
    def sanitizer_source(module):
        functions = [inspect.getsource(getattr(module, name)) for name in ("one_line", "printable", "_cut")]
        patterns = [module._QUOTED.pattern, module._FILE.pattern]
        return functions + patterns + [module.MAX_QUOTED, module.MAX_WORDS, module.MAX_WHERE]

    one, *others = map(sanitizer_source, (controller.errors, fuzzy_arbiter.errors, plant_fmu.errors))
    assert others == [one, one]


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize(
    "came", ["a" * 900, repr("a" * 900), repr('"' * 900), repr([1.5] * 900), repr((1, [2] * 900)), "a b " * 900]
)
def test_d11_long_quotes_are_truncated_in_the_middle(base, came):
    said = str(base(f"runs/a/it.toml: law.gains is {came}, expected a number"))
    assert said.startswith("runs/a/it.toml: law.gains is ") and said.endswith(", expected a number")
    assert len(said) < 300 and said.count("a") < 300


@pytest.mark.parametrize("base", BASES)
def test_d11_messages_contain_no_terminal_codes(base):
    said = str(base(f"{COMMANDS_LOG}.toml: {COMMANDS_LOG}"))
    assert said.isprintable() and said.count(SHOWN) == 2


@pytest.mark.parametrize("base", BASES)
def test_d11_the_name_of_a_file_is_whole(base):
    place = "/".join(["some-folder"] * 16) + "/" + "n" * 30 + ".toml"
    assert str(base(f"{place}: is none")) == f"{place}: is none"
    assert f"{place}: is none" in str(base(f"base.toml: {place}: is none"))


COMMANDS = {
    "run": lambda file: cosim_main(["run", f"{file}.toml"]),
    "report": lambda file: cosim_main(["report", file]),
    "replay": lambda file: cosim_main(["report", "--replay", file]),
    "watch": lambda file: cosim_main(["watch", file]),
    "export": lambda file: cosim_main(["export", file, "--to", "csv"]),
    "rerun": lambda file: cosim_main(["rerun", file, "1"]),
    "stream": lambda file: cosim_main(["mavlink", "stream", file, "--mavlink", "udpout:127.0.0.1:9"]),
    "commands": lambda file: cosim_main(["run", "paper", "--replay-commands", file]),
    "campaign": lambda file: cosim_main(["campaign", file, "--law", "pd", "--out", "x"]),
    "key": lambda file: cosim_main(["mavlink", "listen", "udpin:127.0.0.1:14999", "--signing-key", file]),
    "endpoint": lambda file: cosim_main(["listen", file]),
    "log": lambda file: cosim_main(["mavlink", "stream", "x", "--mavlink", f"none/{file}.tlog"]),
    "a word": lambda file: cosim_main(["watch", "x", "--rate", file]),
    "set": lambda file: cosim_main(["show", "paper", "--set", f"{file}=1"]),
    "value": lambda file: cosim_main(["show", "paper", "--set", f"title='{file}'"]),
    "vehicle": lambda file: plant_main(["docs", "--vehicle", f"{file}.toml"]),
    "fmu": lambda file: plant_main(["check", file]),
    "plant's word": lambda file: plant_main(["plot", "layout", "--out", file]),
    "arbiter": lambda file: fuzzy_main(["show", f"{file}.toml"]),
    "table": lambda file: fuzzy_main(["eval", "section-vi", "--csv", file]),
    "arbiter's word": lambda file: fuzzy_main(["show", "section-vi", f"--{file}"]),
}


@pytest.mark.medium(fast=35)
@pytest.mark.parametrize("command", COMMANDS.values(), ids=COMMANDS)
@pytest.mark.parametrize(
    "name", [f"it{COMMANDS_LOG}", "it" + "a" * 900, os.fsdecode(b"it\xff\xfe")], ids=["commands", "long", "bytes"]
)
def test_d11_command_errors_are_printable_for_any_name(command, name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    try:
        code = command(name)
    except SystemExit as ended:
        code = ended.code
    said = capsys.readouterr().err.rstrip("\n").splitlines()[-1]  # argparse says first how it is used
    assert code == 2 and said.isprintable()
    assert "it" in said and len(said) < 400
    assert list(tmp_path.iterdir()) == []


def test_d11_an_error_of_the_system_names_its_file(tmp_path, capsys):
    def failing():
        raise OSError(28, "No space left on device", str(tmp_path / "it.html"))

    assert run_guarded(failing) == 2
    assert capsys.readouterr().err == f"cosim: {tmp_path / 'it.html'}: No space left on device\n"


def test_d11_warnings_contain_no_terminal_codes():
    record = logging.LogRecord("cosim", logging.WARNING, "", 0, "%s: is odd", (COMMANDS_LOG,), None)
    assert _Lines("%(name)s: %(message)s").format(record).startswith(f"cosim: {SHOWN}")
