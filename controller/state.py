"""Records of numbers and arrays that functions read and set as attributes: what a law remembers between two steps."""

# Each number has an array of its own, without axes. All arrays stay where they are: C is bound to them once, and a
# value that is set is copied into them.

from __future__ import annotations

import copy
import functools
import math
from typing import Any, ClassVar, Self, get_args, get_type_hints

import numpy as np

from controller.stack_array import Array, Shape

_NUMBERS: dict[Any, Any] = {float: np.float64, int: np.int64, bool: np.bool_, np.uint64: np.uint64}


class State(tuple[Any, ...]):
    """A record of the fields that a subclass annotates: numbers, arrays, and other records."""

    # Keyword arguments are values of fields, and lengths by the names that `Shape` has. Arrays and records are kept,
    # not copied. A field that is not given has the default of the class, else 0.

    _fields: ClassVar[tuple[str, ...]] = ()
    _defaults: ClassVar[dict[str, Any]] = {}
    block: Array  # of a record that was made by `over`

    def __init_subclass__(cls) -> None:
        names = [name for name in cls.__annotations__ if not name.startswith("_")]
        cls._defaults = cls._defaults | {name: vars(cls)[name] for name in names if name in vars(cls)}
        cls._fields = tuple(dict.fromkeys((*cls._fields, *names)))
        for name in names:
            setattr(cls, name, property(functools.partial(_get, cls._fields.index(name))))

    def __new__(cls, *items: Any, **given: Any) -> Self:
        """Make the record; `items` are those of another one, in order."""
        lengths = {name: value for name, value in given.items() if name not in cls._fields}
        for name, value in lengths.items():
            if name not in _length_names(cls) or not isinstance(value, int | np.integer):
                raise TypeError(f"{cls.__name__}: {name} (got {value!r}) is no field, and no length")
        if not items:
            items = tuple(cls._item(name, given.get(name), lengths) for name in cls._fields)
        if missing := [name for name, item in zip(cls._fields, items, strict=True) if item is None]:
            raise TypeError(f"{cls.__name__}: {', '.join(missing)} not given")
        return super().__new__(cls, items)

    def __setattr__(self, name: str, value: Any) -> None:
        """Copy a value into the array of a field."""
        if name not in self._fields:
            raise AttributeError(f"{type(self).__name__} has no field {name}")
        self.storage(name)[...] = value

    def __reduce__(self) -> tuple[Any, ...]:
        """Make a copy from its array, or from all items."""
        return (type(self).over, (self.block,)) if "block" in vars(self) else (type(self), tuple(self))

    def storage(self, name: str) -> Array:
        """Return the array in which the numbers of a field are."""
        array: Array = self[self._fields.index(name)]
        return array

    @classmethod
    def over(cls, block: Array) -> Self:
        """Make the record of the parts of an array, one behind the other."""
        kinds = _kinds(cls)
        if other := [name for name, (numbers, _) in kinds.items() if numbers != block.dtype]:
            raise TypeError(f"{cls.__name__}: {', '.join(other)} in an array of {block.dtype}")
        shapes = [shape for _, shape in kinds.values()]
        ends = np.cumsum([math.prod(shape) for shape in shapes])
        made = cls(*(part.reshape(shape) for part, shape in zip(np.split(block, ends[:-1]), shapes, strict=True)))
        vars(made)["block"] = block
        return made

    @classmethod
    def _item(cls, name: str, given: Any, lengths: dict[str, int]) -> Any:
        """Return the array or record of a field; None if it has to be given."""
        numbers, shape = _kinds(cls)[name]
        default = cls._defaults.get(name, 0)
        if shape is None:
            is_record = isinstance(numbers, type) and issubclass(numbers, State)
            if given is None and is_record:
                own = {length: n for length, n in lengths.items() if length in _length_names(numbers)}
                return copy.deepcopy(default) if default else numbers(**own)
            if is_record and not isinstance(given, numbers):
                raise TypeError(f"{cls.__name__}: {name} (got {given!r}), expected {numbers.__name__}")
            return given
        sizes = [lengths.get(n) if isinstance(n, str) else n for n in shape]
        if given is None:
            return None if None in sizes else np.full(sizes, default, numbers)
        array = given if isinstance(given, np.ndarray) else np.array(given, numbers)
        array = array if shape else array.reshape(())
        fits = len(sizes) == array.ndim and all(n in (None, m) for n, m in zip(sizes, array.shape, strict=True))
        if array.dtype != numbers or not fits:
            got, expected = f"{array.dtype} of shape {array.shape}", f"{numbers.__name__} of shape {shape}"
            raise TypeError(f"{cls.__name__}: {name} (got {got}), expected {expected}")
        return array


def _get(i: int, state: State) -> Any:
    item = state[i]
    return item[()] if isinstance(item, np.ndarray) and item.ndim == 0 else item


@functools.cache
def _kinds(state: type[State]) -> dict[str, tuple[Any, Any]]:
    """Return the type of each field's numbers and its shape, which is None where it is not known."""
    hints = get_type_hints(state, include_extras=True)
    return {name: _kind(hints[name]) for name in state._fields}


def _kind(hint: Any) -> tuple[Any, Any]:
    if isinstance(hint, type):
        return _NUMBERS.get(hint, hint), () if hint in _NUMBERS else None
    shape = next((extra.lengths for extra in getattr(hint, "__metadata__", ()) if isinstance(extra, Shape)), None)
    if shape is None:
        return None, None
    item = hint.__origin__
    while arguments := get_args(item):  # NDArray[item], which in older versions of NumPy is ndarray[..., dtype[item]]
        item = arguments[-1]
    return item, shape


@functools.cache
def _length_names(state: type[State]) -> set[str]:
    """Return the names of lengths of arrays in a state and its records."""
    kinds = _kinds(state).values()
    records = (numbers for numbers, _ in kinds if isinstance(numbers, type) and issubclass(numbers, State))
    own = {n for _, shape in kinds for n in shape or () if isinstance(n, str)}
    return own.union(*map(_length_names, records))
