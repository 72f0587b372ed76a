"""Readers: valid content of each, how it is read, and the product's functions that read it."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import pytest

from controller import ControllerError
from cosim.campaigns.comparison import compare
from cosim.campaigns.parameter_sweep import run_sweep
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.sweeps.design import Design, vary_from
from cosim.errors import CosimError
from cosim.scenario.scenario import load_scenario
from fuzzy_arbiter import ArbiterError
from plant_fmu import PlantFmuError

KINDS = (CosimError, PlantFmuError, ArbiterError, ControllerError)
ROOT = Path(__file__).parents[3]
SCENES = (ROOT / "tests" / "data" / "scenes" / "hard.jsonl").read_bytes().splitlines(keepends=True)[:2]


@dataclass(frozen=True)
class Case:
    """What a reader is tried with."""

    contents: tuple[bytes, ...]  # sound ones
    read: Callable[[bytes], object]  # raises one of `KINDS` where it refuses them
    named: str = ""  # what each refusal names


@dataclass(frozen=True)
class Reader:
    """A reader of the product."""

    name: str
    kind: str  # of content, as `mutated` has it
    opens: tuple[str, ...]  # functions of the product that a sound content goes through
    case: Callable[[Seeds], Case]


READERS: dict[str, Reader] = {}


def reader(name: str, kind: str, *opens: str) -> Callable[[Callable[[Seeds], Case]], Callable[[Seeds], Case]]:
    """Register what makes the case of a reader."""

    def registered(case: Callable[[Seeds], Case]) -> Callable[[Seeds], Case]:
        assert name not in READERS
        READERS[name] = Reader(name, kind, opens, case)
        return case

    return registered


class Seeds:
    """Folders that are sound, each made when it is first asked for."""

    patch: pytest.MonkeyPatch  # of the present test

    def __init__(self, factory: pytest.TempPathFactory, run: Path) -> None:
        self._factory, self.run = factory, run

    def folder(self, of: Path | None = None) -> Path:
        """Return an empty folder, or the copy of one."""
        made = self._factory.mktemp("seed") / "it"
        shutil.copytree(of, made) if of else made.mkdir()
        return made

    def file(
        self, name: str, read: Callable[[Path], object], *contents: bytes, of: Path | None = None, folder: bool = False
    ) -> Case:
        """Return the case of a reader of a file that stands alone, or in the copy of a folder, which is then named."""
        path = self.folder(of) / name
        path.parent.mkdir(parents=True, exist_ok=True)

        def written(content: bytes) -> object:
            path.write_bytes(content)
            return read(path)

        return Case(contents or (path.read_bytes(),), written, str(path.parent if folder else path))

    @cached_property
    def scenes(self) -> Path:
        """A file of two scenes."""
        path = self.folder() / "scenes.jsonl"
        path.write_bytes(b"".join(SCENES))
        return path

    @cached_property
    def comparison(self) -> Path:
        """A comparison of two laws, with a campaign of each in it."""
        folder = self.folder() / "comparison"
        compare(self.scenes, ["ismail_dunnigan", "pd"], folder, Conditions(duration=0.4))
        return folder

    @cached_property
    def sweep(self) -> Path:
        """A sweep, whose vehicle has a file of its own."""
        here = self.folder()
        shutil.copy(ROOT / "plant_fmu" / "vehicles" / "odin.toml", here / "boat.toml")
        (here / "it.toml").write_text(
            'base = "paper"\nvehicle = "boat.toml"\ntime.duration = 0.1\narbiter.engine = "closed"\n'
        )
        design = Design(vary_from(["initial.position.1=-1:1"]), samples=4)
        run_sweep(load_scenario(here / "it.toml"), design, here / "sweep")
        return here / "sweep"
