"""Tables that name an FMU of the user's: its file, and the map between its variables and the signals of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, NamedTuple

import msgspec

from plant_fmu.toml_tables import Positive, Table, key, require

_RESERVED = ("plant", "law")  # other FMUs


class UserFmu(NamedTuple):
    """A co-simulation FMU of the user's, with the map between its variables and the signals of a run."""

    key: str  # key of the scenario that names it, such as "law" or "components.tether"
    file: Path
    inputs: dict[str, str]  # signal of each of its inputs; inputs that are not named have that of their own name
    outputs: dict[str, str]  # likewise what each of its outputs sets
    parameters: dict[str, float | bool | str]
    timeout: float  # s of the wall clock
    initial: dict[str, str]  # likewise the part of a vehicle's state that each parameter or start value sets

    @property
    def name(self) -> str:
        """Name of a component."""
        return self.key.rpartition(".")[2]

    @property
    def label(self) -> str:
        """Name in messages: that of the file, with that of a component."""
        return f"{self.name} ({self.file.name})" if "." in self.key else self.file.name


class FmuTable(Table, frozen=True, kw_only=True):
    """File and map of an FMU."""

    file: Annotated[str, key("FMU [of one's own](howto/your-fmu.md), beside the file that names it")] = ""
    inputs: Annotated[dict[str, str], key("signal for each of its inputs", default="those of equal names")] = (
        msgspec.field(default_factory=dict)
    )
    outputs: Annotated[dict[str, str], key("what each of its outputs sets", default="those of equal names")] = (
        msgspec.field(default_factory=dict)
    )
    timeout: Annotated[Positive, key("a step of it that takes longer ends the process", "s of the wall clock")] = 10.0
    digest: Annotated[str, key("its SHA-256", more="; runs write it into their folder", default="not checked")] = ""

    def __post_init__(self) -> None:
        if self.file:
            name = Path(self.file).name
            require(name.endswith(".fmu"), "file", repr(name), "a name that ends in .fmu")

    def fmu(
        self, path: str, parameters: dict[str, float | bool | str], initial: dict[str, str] | None = None
    ) -> UserFmu:
        """Return the FMU, whose table has a path such as "law"."""
        return UserFmu(path, Path(self.file), self.inputs, self.outputs, parameters, self.timeout, initial or {})


class ComponentEntry(FmuTable, frozen=True):
    """An FMU beside the plant, such as a current or a tether."""

    name: Annotated[
        str,
        key(
            "unique name: a letter, then at most 23 letters, digits and _",
            pattern=r"^[A-Za-z]\w{0,23}\Z",
            expected="a letter, then at most 23 letters, digits and _",
        ),
    ]
    parameters: Annotated[dict[str, float | bool | str], key("values of its parameters", default="its own")] = (
        msgspec.field(default_factory=dict)
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        require(bool(self.file), "file", "missing", "an FMU")
        require(self.name not in _RESERVED, "name", repr(self.name), "another one: it is of the plant or the law")
