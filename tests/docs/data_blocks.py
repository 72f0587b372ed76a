"""Blocks of data and of other languages: parsed, loaded by the real loaders, compiled."""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

from cosim.campaigns.scenes.scene_file import decode_scene
from cosim.live.command_desk import CommandDesk
from cosim.logs.column_map import read_map
from cosim.scenario.scenario import load_scenario
from cosim.simulation.commands.sources import CommandQueue
from fuzzy_arbiter.formats import load
from plant_fmu import load_vehicle
from plant_fmu.compiling.compiler import find_compiler
from tests.docs.directives import PageError
from tests.docs.pages import Block

_LOADERS: dict[str, Callable[[str], object]] = {
    "scenario": load_scenario,
    "vehicle": load_vehicle,
    "arbiter": load,
    "column map": lambda name: read_map(Path(name)),
}


def whole(block: Block) -> str:
    """Return the text that a block stands for: a fragment has the shipped scenario that it belongs to as its base."""
    return f'base = "{block.directives.onto}"\n{block.text}' if block.directives.onto else block.text


def check_data(block: Block) -> None:
    """Check a block that is no program; a PageError names the error."""
    check = _CHECKS.get(block.language)
    if check is None:
        raise PageError(
            f"{block.where}: nobody checks blocks of {block.language!r}; say why not: <!-- not run: ... -->"
        )
    try:
        check(block)
    except PageError:
        raise
    except Exception as error:
        raise PageError(f"{block.where}: {error}") from error


def _check_toml(block: Block) -> None:
    if block.directives.kind not in _LOADERS:
        raise PageError(f"{block.where}: expected one of <!-- {' -->, <!-- '.join(_LOADERS)} --> above a block of TOML")
    file = Path(block.directives.file or "block.toml")
    before = file.read_bytes() if file.exists() else None
    file.write_text(whole(block), encoding="utf-8")
    _LOADERS[block.directives.kind](str(file))
    if before is not None:
        file.write_bytes(before)
    elif not block.directives.file:
        file.unlink()


def _check_json(block: Block) -> None:
    lines = list(filter(None, block.text.splitlines()))
    try:
        json.loads(block.text)
    except json.JSONDecodeError:
        for line in lines:
            json.loads(line)
    if block.directives.kind == "scenes":
        for line in lines:
            decode_scene(line.encode())
    if block.directives.commands_of:
        scenario = load_scenario(block.directives.commands_of, ["commands.enabled=true"])
        desk = CommandDesk(scenario, CommandQueue(), lambda name: True)
        for line in lines:
            if why := desk.submit(line):
                raise PageError(f"{block.where}: {line} is refused: {why}")


def _check_c(block: Block) -> None:
    command = [*find_compiler(), "-std=c11", "-Wall", "-Werror", "-fsyntax-only", "-x", "c", "-"]
    done = subprocess.run(command, input=block.text, capture_output=True, text=True, timeout=240, check=False)
    if done.returncode:
        raise PageError(f"{block.where}: {done.stderr}")


_CHECKS: dict[str, Callable[[Block], object]] = {"toml": _check_toml, "json": _check_json, "c": _check_c}
