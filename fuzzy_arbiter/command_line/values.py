"""Evaluate a sample or a table of samples, and format the weights."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence

import numpy as np

from fuzzy_arbiter.arbiter import Arbiter
from fuzzy_arbiter.definition import System, variable_names
from fuzzy_arbiter.errors import ArbiterError, InputError


def sample(words: Sequence[str], system: System) -> list[float] | dict[str, float]:
    """Parse words of the command line as a sample."""
    if not words:
        raise InputError(f"got no values, expected {', '.join(variable_names(system.inputs))}")
    named = ["=" in word for word in words]
    if any(named) and not all(named):
        raise InputError("got some values with a name and some without, expected all or none")
    if not any(named):
        return [number(word, word) for word in words]
    result: dict[str, float] = {}
    for word in words:
        name, _, value = word.rpartition("=")
        if name in result:
            raise InputError(f"{name} appears twice, expected once")
        result[name] = number(value, word)
    return result


def number(text: str, where: str) -> float:
    """Parse a text as a number."""
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{where}: {text.strip()!r} is not a number") from None


def evaluated(arbiter: Arbiter, inputs: Sequence[float] | Mapping[str, float], as_json: bool) -> str:
    """Return the weights for one sample."""
    weights = arbiter(inputs)._asdict()
    if as_json:
        return json.dumps({name: _or_null(weight) for name, weight in weights.items()}, ensure_ascii=False)
    return "\n".join(f"{name} = {weight!r}" for name, weight in weights.items())


def evaluated_table(arbiter: Arbiter, text: str, where: str, as_json: bool) -> str:
    """Return the weights for the rows of a CSV table."""
    lines, rows = _rows(text, where, variable_names(arbiter.system.inputs))
    names = arbiter.system.result_names
    weights: list[list[float]] = []
    if rows:
        try:
            weights = arbiter.batch(np.array(rows)).tolist()
        except ArbiterError:
            for line, row in zip(lines, rows, strict=True):
                try:
                    arbiter(row)
                except ArbiterError as error:
                    raise type(error)(f"{where}: line {line}: {error}") from None
            raise
    if as_json:
        table = [dict(zip(names, map(_or_null, row), strict=True)) for row in weights]
        return json.dumps(table, ensure_ascii=False)
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([repr(weight) for weight in row] for row in weights)
    return out.getvalue().removesuffix("\n")


def _or_null(weight: float) -> float | None:
    return weight if weight == weight else None


def _rows(text: str, where: str, names: Sequence[str]) -> tuple[list[int], list[list[float]]]:
    """Return line numbers and values of a table, in the order of the inputs."""
    reader = csv.reader(io.StringIO(text.removeprefix("\ufeff"), newline=""), skipinitialspace=True)
    try:
        header = [name.strip() for name in next(reader, [])]
        for name in names:
            if header.count(name) != 1:
                fault = "stands twice" if name in header else "is missing"
                received = ", ".join(map(repr, header))
                received = received if len(received) <= 200 else f"{received[:200]} ..."
                raise InputError(f"{where}: column {name!r} {fault} in the first line, which has {received or 'none'}")
        columns = [header.index(name) for name in names]
        lines, rows = [], []
        for cells in reader:
            if not any(cell.strip() for cell in cells):
                continue
            line = f"{where}: line {reader.line_num}"
            if len(cells) != len(header):
                raise InputError(f"{line}: {len(cells)} cells, expected {len(header)}")
            rows.append([number(cells[i], f"{line}: {name}") for i, name in zip(columns, names, strict=True)])
            lines.append(reader.line_num)
    except csv.Error as error:
        raise InputError(f"{where}: line {reader.line_num}: {error}") from None
    return lines, rows
