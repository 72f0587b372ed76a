"""Evaluate a sample or a table of samples, and format the weights."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TextIO

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.definition import System, variable_names
from fuzzy_arbiter.errors import ArbiterError, InputError


def parse_sample(words: Sequence[str], system: System) -> list[float] | dict[str, float]:
    """Parse words of the command line as a sample."""
    if not words:
        raise InputError(f"got no values, expected {', '.join(variable_names(system.inputs))}")
    named = ["=" in word for word in words]
    if any(named) and not all(named):
        raise InputError("got some values with a name and some without, expected all or none")
    if not any(named):
        return [parse_number(word, word) for word in words]
    result: dict[str, float] = {}
    for word in words:
        name, _, value = word.rpartition("=")
        if name in result:
            raise InputError(f"{name} appears twice, expected once")
        result[name] = parse_number(value, word)
    return result


def parse_number(text: str, where: str) -> float:
    """Parse a text as a number."""
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{where}: {text.strip()!r} is not a number") from None


def evaluate(arbiter: Arbiter, inputs: Sequence[float] | Mapping[str, float], as_json: bool) -> str:
    """Return the weights for one sample."""
    weights = arbiter(inputs)._asdict()
    if as_json:
        return json.dumps(_json_ready(weights), ensure_ascii=False)
    return "\n".join(f"{name} = {weight!r}" for name, weight in weights.items())


def evaluate_table(arbiter: Arbiter, path: str, stdin: TextIO | None, as_json: bool) -> str:
    """Return the weights for the rows of a CSV table, of a file or, for ``-``, of standard input."""
    where = "standard input" if path == "-" else path
    rows = _rows(_text(path, where, stdin), where, variable_names(arbiter.system.inputs))
    names = arbiter.system.result_names
    try:
        weights = arbiter.batch(list(rows.values())).tolist() if rows else []
    except ArbiterError:
        for line, row in rows.items():
            try:
                arbiter(row)
            except ArbiterError as error:
                raise type(error)(f"{where}: line {line}: {error}") from None
        raise
    if as_json:
        table = [_json_ready(dict(zip(names, row, strict=True))) for row in weights]
        return json.dumps(table, ensure_ascii=False)
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([repr(weight) for weight in row] for row in weights)
    return out.getvalue().removesuffix("\n")


def _json_ready(weights: dict[str, float]) -> dict[str, float | None]:
    """Replace NaN, which JSON has not, by None."""
    return {name: weight if weight == weight else None for name, weight in weights.items()}


def _text(path: str, where: str, stdin: TextIO | None) -> str:
    try:
        if path != "-":
            return Path(path).read_bytes().decode()
        if stdin is None:
            raise InputError(f"{where}: is closed")
        return stdin.read()
    except UnicodeDecodeError:
        raise InputError(f"{where}: not UTF-8 text") from None
    except OSError as error:
        raise InputError(f"{where}: {error.strerror or error}") from None


def _rows(text: str, where: str, names: Sequence[str]) -> dict[int, list[float]]:
    """Return the values of a table in the order of the inputs, by the number of their line."""
    reader = csv.reader(io.StringIO(text.removeprefix("\ufeff"), newline=""), skipinitialspace=True)
    rows: dict[int, list[float]] = {}
    try:
        header = [name.strip() for name in next(reader, [])]
        for name in names:
            if header.count(name) != 1:
                fault = "stands twice" if name in header else "is missing"
                received = ", ".join(map(repr, header)) or "none"
                raise InputError(f"{where}: column {name!r} {fault} in the first line, which has {received}")
        for cells in reader:
            line = f"{where}: line {reader.line_num}"
            if any(cell.strip() for cell in cells):
                if len(cells) != len(header):
                    raise InputError(f"{line}: {len(cells)} cells, expected {len(header)}")
                row = dict(zip(header, cells, strict=True))
                rows[reader.line_num] = [parse_number(row[name], f"{line}: {name}") for name in names]
    except csv.Error as error:
        raise InputError(f"{where}: line {reader.line_num}: {error}") from None
    return rows
