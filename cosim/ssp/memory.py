"""Memory of translated functions in an FMU: arrays in the model, which FMU states copy, or constants."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from controller.translator.program import Program
from controller.translator.static_data import array_data, initializer
from controller.translator.types import BOOL, DOUBLE, INT, UINT, Array, type_of
from cosim.simulation.signals import Array as Numbers

POOLS = {DOUBLE: "numbers", INT: "integers", UINT: "words", BOOL: "flags"}  # members of the model, by item type
_TYPES = {"numbers": np.float64, "integers": np.int64, "words": np.uint64, "flags": np.bool_}


class Memory:
    """Layout of arrays: variable ones in members of the C struct ``Model``, fixed ones in constants."""

    # Arrays that share memory have the same index. Parameters come first: the importer sets them, and a reset does not
    # change them.

    def __init__(self) -> None:
        self._pools: dict[str, list[np.ndarray]] = {member: [] for member in POOLS.values()}
        self._sizes = dict.fromkeys(POOLS.values(), 0)
        self._indices: dict[int, int] = {}  # of base arrays, by id, which is unique while they are kept
        self._constants: dict[int, str] = {}
        self._constant_arrays: list[np.ndarray] = []
        self.definitions: list[str] = []  # C definitions of the constants

    def keep(self, array: np.ndarray) -> int:
        """Store an array in the member for its type; return the index of its first item there."""
        base = _base(array)
        if id(base) not in self._indices:
            member = self._member(base)
            self._indices[id(base)] = self._sizes[member]
            self._sizes[member] += base.size
            self._pools[member].append(base)
        offset = array.ctypes.data - base.ctypes.data if array.size else 0
        return self._indices[id(base)] + offset // array.itemsize

    def fix(self, *values: Any) -> None:
        """Define all arrays of arguments as constants, except those that are stored already."""
        for array in (array for value in values for array in arrays_of(value)):
            if array.size and id(_base(array)) not in self._indices and id(array) not in self._constants:
                name = f"CONSTANT_{len(self._constants)}"
                self._constants[id(array)] = name
                self._constant_arrays.append(array)
                self.definitions.append(array_data(array, name, "static const"))

    def name(self, array: np.ndarray, expression: str) -> None:
        """Let a C expression stand for the address of an array."""
        self._constants[id(array)] = expression
        self._constant_arrays.append(array)

    def call(self, program: Program, name: str, arguments: tuple[Any, ...]) -> str:
        """Return the C code of ``void control_name(Model *m)``, which calls a function of the program."""

        def pointer(array: np.ndarray, _: str) -> str:
            kind = type_of(array)
            program.name(kind)
            assert isinstance(kind, Array)
            if not array.size:
                return "NULL"
            if id(array) in self._constants:
                return f"({kind.item.c} *){self._constants[id(array)]}"
            return f"m->{POOLS[kind.item]} + {self.keep(array)}"

        values = [a.text if isinstance(a, Named) else initializer(a, pointer) for a in arguments]
        return (
            f"void control_{name}(Model *m)\n{{\n    const translated_{name}_arguments arguments = {{\n"
            + "".join(f"        {value},\n" for value in values)
            + f"    }};\n\n    translated_{name}(&arguments);\n}}\n"
        )

    def sizes(self) -> dict[str, int]:
        """Return the number of items of each member, at least one, by constants such as ``N_NUMBERS``."""
        return {f"N_{member.upper()}": max(size, 1) for member, size in self._sizes.items()}

    def starts(self) -> Iterator[str]:
        """Yield the C definitions of the initial values of each member."""
        for member, arrays in self._pools.items():
            parts = [array.ravel() for array in arrays] or [np.zeros(1)]
            numbers: np.ndarray = np.concatenate(parts).astype(_TYPES[member])
            yield array_data(numbers if numbers.size else np.zeros(1, _TYPES[member]), f"FIRST_{member.upper()}",
                             "static const")  # fmt: skip

    @property
    def size(self) -> int:
        """Number of real numbers stored."""
        return self._sizes["numbers"]

    def _member(self, array: np.ndarray) -> str:
        kind = type_of(array)
        assert isinstance(kind, Array)
        return POOLS[kind.item]


class Named:
    """An argument that is its own member of the model, such as gains."""

    def __init__(self, value: tuple[float, ...], member: str) -> None:
        self.value = value
        self.text = f"{{{', '.join(f'm->{member}[{i}]' for i in range(len(value)))}}}"


def _base(array: np.ndarray) -> np.ndarray:
    """Return the array that owns the memory of an array."""
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array


def arrays_of(value: Any) -> Iterator[Numbers]:
    """Yield all arrays in an argument."""
    if isinstance(value, tuple):
        for item in value:
            yield from arrays_of(item)
    elif isinstance(value, np.ndarray):
        yield value
