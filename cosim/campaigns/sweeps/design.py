"""Designs of sweeps: values of the keys that vary. A row's values depend on its number alone."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, get_args

import msgspec
import numpy as np
from numpy.typing import NDArray

from cosim.campaigns.workers.work import Rows
from cosim.errors import RunError, ScenarioError
from cosim.scenario.toml_file import plain_key, split_change

Kind = Literal["grid", "random", "sobol", "lhs", "paired"]
KINDS: tuple[Kind, ...] = get_args(Kind)
MAX_ROWS = 10_000_000  # maximum number of rows
_MAX_SOBOL_KEYS = 21201  # maximum number of keys of a Sobol' sequence
_SEEDS = 2**31  # number of FMI integers from 0


@dataclass(frozen=True)
class Vary:
    """The values of a key: a range, or a list."""

    key: str  # key of the scenario
    low: float = math.nan  # lower end of a range
    high: float = math.nan  # upper end of a range
    points: int | None = None  # number of values of a range on a grid
    log: bool = False  # True if the range is logarithmic
    values: tuple[float, ...] = ()  # list of values, instead of a range

    def __post_init__(self) -> None:
        object.__setattr__(self, "key", plain_key(self.key))

    def at(self, fraction: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values at fractions of the range or list, from 0 to 1; the ends are exact."""
        if self.values:
            indices = np.minimum(np.floor(fraction * len(self.values)).astype(np.int64), len(self.values) - 1)
            return np.array(self.values)[indices]
        if self.log:
            between = np.exp(math.log(self.low) * (1.0 - fraction) + math.log(self.high) * fraction)
        else:
            between = self.low * (1.0 - fraction) + self.high * fraction
        inside = np.clip(between, self.low, self.high)
        return np.where(fraction == 0.0, self.low, np.where(fraction == 1.0, self.high, inside))

    @property
    def steps(self) -> int:
        """Number of values on a grid."""
        return len(self.values) or self.points or 0

    def on_grid(self, indices: Rows) -> NDArray[np.float64]:
        """Return the values at indices of a grid, from 0."""
        if self.values:
            return np.array(self.values)[indices]
        return self.at(indices / max(1, self.steps - 1))

    @property
    def whole(self) -> bool:
        """True if all values are whole numbers; False for a range without points."""
        return bool(self.steps) and bool(np.all(np.mod(self.on_grid(np.arange(self.steps)), 1.0) == 0.0))


@dataclass(frozen=True)
class Design:
    """Values of the keys in the rows of a sweep.

    Parameters
    ----------
    vary : sequence of Vary
        Keys with their ranges or lists, at least one.
    kind : str
        Kind of the design: ``"grid"``, all combinations, the last key fastest; ``"random"``, independent rows;
        ``"sobol"``, a scrambled Sobol' sequence; ``"lhs"``, a Latin hypercube; or ``"paired"``, the values of all lists
        with the same index.
    samples : int, optional
        Number of rows; None on a grid or in pairs, where the points or the lists' length determine it.
    seed : int
        Seed of the random values, and of the seeds of the rows.

    Raises
    ------
    RunError
        If the design is invalid.

    Examples
    --------
    >>> import cosim
    >>> design = cosim.Design(cosim.vary_from(["limit.force=100:500", "regions.SR1.gain=10,100"]), samples=6, seed=1)
    >>> design.rows
    6
    """

    vary: tuple[Vary, ...]
    kind: Kind = "random"
    samples: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise RunError(f"design is {self.kind!r}, expected one of {', '.join(KINDS)}")
        if not self.vary:
            raise RunError("nothing varies, expected at least one key")
        if not 0 <= self.seed < 2**63:
            raise RunError(f"seed is {self.seed}, expected a whole number from 0 to 2^63 - 1")
        if self.kind == "grid":
            self._check_grid()
        elif self.kind == "paired":
            self._check_lists()
        else:
            self._check_samples()
        if self.rows > MAX_ROWS:
            raise RunError(f"the design has {self.rows} rows, expected up to {MAX_ROWS}")

    def _check_grid(self) -> None:
        if self.samples is not None:
            raise RunError("samples: a grid has as many rows as its points make, expected none given")
        for vary in self.vary:
            if not vary.steps:
                low, high = f"{vary.low:g}", f"{vary.high:g}"
                raise RunError(f"{vary.key}: a grid needs to know how many points, expected {vary.key}={low}:{high}:N")

    def _check_lists(self) -> None:
        lengths = {len(vary.values) for vary in self.vary}
        if len(lengths) > 1 or 0 in lengths:
            raise RunError("the design paired takes one value of each list for a row, expected lists of one length")
        if self.samples is not None and not 1 <= self.samples <= max(lengths):
            raise RunError(f"samples is {self.samples}, expected 1 to {max(lengths)}, as the lists are long")

    def _check_samples(self) -> None:
        if self.samples is None:
            raise RunError(f"samples is missing: how many rows the design {self.kind} has")
        if self.samples < 1:
            raise RunError(f"samples is {self.samples}, expected 1 or more")
        for vary in self.vary:
            if vary.points is not None:
                raise RunError(f"{vary.key}: {vary.points} points are given, expected them with the design grid alone")
        if self.kind == "sobol" and len(self.vary) > _MAX_SOBOL_KEYS:
            raise RunError(f"{len(self.vary)} keys vary, expected up to {_MAX_SOBOL_KEYS} with the design sobol")

    @property
    def rows(self) -> int:
        """Number of rows."""
        if self.samples is not None:
            return self.samples
        return len(self.vary[0].values) if self.kind == "paired" else math.prod(vary.steps for vary in self.vary)

    def values(self, rows: Rows) -> NDArray[np.float64]:
        """Return the values of some rows.

        Parameters
        ----------
        rows : ndarray of int, shape (n,)
            Numbers of the rows, in rising order.

        Returns
        -------
        ndarray, shape (n, keys)
            Values of the keys in these rows. The values of a row do not depend on the other rows.
        """
        if self.kind == "grid":
            indices = np.unravel_index(rows, [vary.steps for vary in self.vary])
            columns = [vary.on_grid(i) for vary, i in zip(self.vary, indices, strict=True)]
        elif self.kind == "paired":
            columns = [np.array(vary.values)[rows] for vary in self.vary]
        else:
            fractions = self._fractions(rows)
            columns = [vary.at(fractions[:, i]) for i, vary in enumerate(self.vary)]
        return np.column_stack(columns)

    def seeds(self, rows: Rows) -> Rows:
        """Return the seeds of some rows, shape (n,), all different: a permutation of 0 to 2^31 - 1."""
        factor, offset = np.random.SeedSequence(self.seed, spawn_key=(1,)).generate_state(2, np.uint32)
        odd = int(factor) | 1
        return (rows * odd + int(offset)) % _SEEDS

    def _fractions(self, rows: Rows) -> NDArray[np.float64]:
        """Return the values of some rows as fractions of their ranges, from 0 to 1, shape (n, keys)."""
        if self.kind == "lhs":
            return self._hypercube[rows]
        keys = len(self.vary)
        if not len(rows):
            return np.empty((0, keys))
        first, n = int(rows[0]), int(rows[-1] - rows[0]) + 1
        if self.kind == "random":
            bits = np.random.PCG64(self.seed)
            bits.advance(first * keys)
            fractions = np.random.Generator(bits).random((n, keys))
        else:
            from scipy.stats import qmc  # imported here, since workers do not need it

            sobol = qmc.Sobol(keys, scramble=True, seed=np.random.default_rng(self.seed))
            with warnings.catch_warnings():  # for numbers of rows that are not powers of two
                warnings.simplefilter("ignore", UserWarning)
                if first:
                    sobol.fast_forward(first)
                fractions = sobol.random(n)
        return fractions[rows - first]

    @cached_property
    def _hypercube(self) -> NDArray[np.float64]:
        from scipy.stats import qmc

        hypercube = qmc.LatinHypercube(len(self.vary), seed=np.random.default_rng(self.seed))
        fractions: NDArray[np.float64] = hypercube.random(self.rows)
        return fractions

    def table(self) -> dict[str, Any]:
        """Return it as a table for JSON."""
        vary = {
            v.key: {"values": list(v.values)} if v.values
            else {"low": v.low, "high": v.high, "log": v.log} | ({} if v.points is None else {"points": v.points})
            for v in self.vary
        }  # fmt: skip
        return {"vary": vary, "design": self.kind, "samples": self.rows, "seed": self.seed}


def design_of(table: dict[str, Any]) -> Design:
    """Make a design from a table of `Design.table`."""
    try:
        vary = tuple(
            Vary(key, **(keys if "low" in keys else {"values": tuple(keys["values"])}))
            for key, keys in table["vary"].items()
        )
        samples = None if table["design"] == "grid" else table["samples"]
        return Design(vary, table["design"], samples, table["seed"])
    except (KeyError, TypeError, AttributeError) as error:
        raise RunError(f"the design of the campaign cannot be read: {error!r}") from error


def vary_from(texts: Sequence[str]) -> tuple[Vary, ...]:
    """Parse the keys that vary from texts.

    Parameters
    ----------
    texts : sequence of str
        Texts ``key=low:high`` or ``key=low:high:points``, each with ``:log`` at the end for a logarithmic range; or
        ``key=a,b,c``.

    Returns
    -------
    tuple of Vary
        Keys with their ranges or lists, in the order of the texts.

    Raises
    ------
    RunError
        If a text has another form, a value is not a finite number, a range has no width, or a key is given twice.

    Examples
    --------
    >>> import cosim
    >>> cosim.vary_from(["limit.force=100:500:5"])[0].points
    5
    """
    vary = tuple(map(_parse_vary, texts))
    keys = [one.key for one in vary]
    for key in keys:
        if keys.count(key) > 1:
            raise RunError(f"{key} varies twice, expected each key once")
    return vary


def vary_vehicles(path: Path) -> tuple[Vary, ...]:
    """Read the parameters that vary between vehicles from a file that ``cosim identify`` has written."""
    try:
        lines = [line for line in path.read_bytes().splitlines() if line.strip()]
        plants = [msgspec.json.decode(line, type=_Drawn).parameters for line in lines]
    except OSError as error:
        raise RunError(f"{path}: {error.strerror or error}") from error
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise RunError(f"{path}: holds no vehicles, expected lines with parameters: {error}") from error
    for number, plant in enumerate(plants, 1):
        if plant.keys() != plants[0].keys() or not plant:
            raise RunError(f"{path}: line {number} has other parameters than the first, expected the same")
    if not plants:
        raise RunError(f"{path}: is empty, expected a vehicle a line")
    return tuple(Vary(f"plant.parameters.{name}", values=tuple(p[name] for p in plants)) for name in plants[0])


class _Drawn(msgspec.Struct):
    parameters: dict[str, float]


def _parse_vary(text: str) -> Vary:
    try:
        key, rest = (part.strip() for part in split_change(text))
    except ScenarioError as error:
        raise RunError(str(error)) from error
    if not (key and rest):
        raise RunError(f"{text!r}: expected key=low:high, key=low:high:points or key=a,b,c")
    if ":" not in rest:
        return Vary(key, values=tuple(_number(key, item) for item in rest.split(",")))
    low_text, high_text, *more = (part.strip() for part in rest.split(":"))
    log = bool(more) and more[-1] == "log"
    points = more[:-1] if log else more
    if len(points) > 1:
        raise RunError(f"{text!r}: expected key=low:high, key=low:high:points or either with :log")
    low, high = _number(key, low_text), _number(key, high_text)
    if not low < high:
        raise RunError(f"{key} goes from {low:g} to {high:g}, expected the lower end first")
    if log and low <= 0.0:
        raise RunError(f"{key} goes from {low:g} on a logarithmic scale, expected above 0")
    return Vary(key, low, high, _points(key, points[0]) if points else None, log)


def _points(key: str, text: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) < 20 and 2 <= int(text) <= MAX_ROWS):
        raise RunError(f"{key}: {text!r} points, expected a whole number from 2 to {MAX_ROWS}")
    return int(text)


def _number(key: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise RunError(f"{key}: {text.strip()!r} is no finite number")
    return value
