"""The result of an arbiter: the value of each output, by position and by name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, TypeVar

from fuzzy_arbiter.errors import DefinitionError

T = TypeVar("T")


class Result(tuple[T, ...]):
    """A named tuple of the outputs' values, one number each or one column each.

    ``result["tip"]`` and ``result.tip`` are the value of an output, ``result[0]`` that of the first. It equals the
    plain tuple of its values.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> result = Arbiter()(obstacle=0.25, shape=0.0, depth=0.0)
    >>> result["obstacle"], result[0], result == (0.15625, 0.0, 0.0)
    (0.15625, 0.15625, True)
    """

    __slots__ = ()
    _fields: ClassVar[tuple[str, ...]] = ()
    _indices: ClassVar[dict[str, int]] = {}

    def __getitem__(self, key: Any) -> Any:
        """Return the value of an output."""
        if isinstance(key, str):
            if key not in self._indices:
                raise DefinitionError(f"no output {key!r}, expected one of {', '.join(self._fields)}")
            key = self._indices[key]
        return super().__getitem__(key)

    def __getattr__(self, name: str) -> T:
        if name not in self._indices:
            raise AttributeError(f"no output {name!r}, expected one of {', '.join(self._fields)}")
        return super().__getitem__(self._indices[name])

    def __float__(self) -> float:
        """Return the value of the only output."""
        if len(self) != 1:
            raise DefinitionError(f"float: got the outputs {', '.join(self._fields)}, expected one, such as result[0]")
        return float(super().__getitem__(0))  # type: ignore[arg-type]  # of one sample

    def _asdict(self) -> dict[str, T]:
        """Return the values by name, as named tuples do."""
        return dict(zip(self._fields, self, strict=True))

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, (self._fields, tuple(self))

    def __repr__(self) -> str:
        return f"Result({', '.join(f'{name}={value!r}' for name, value in self._asdict().items())})"


def result_class(names: Sequence[str]) -> type[Result[Any]]:
    """Return the class of results with these names, so that a result stores only its values."""
    indices = {name: k for k, name in enumerate(names)}
    return type("Result", (Result,), {"__slots__": (), "_fields": tuple(names), "_indices": indices})


def _rebuilt(names: Sequence[str], values: tuple[T, ...]) -> Result[T]:
    return tuple.__new__(result_class(names), values)
