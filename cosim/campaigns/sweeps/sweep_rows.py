"""The rows of a sweep: flown in batches by the fused loop, and converted to a table."""

from __future__ import annotations

import json
import secrets
from dataclasses import dataclass, field
from hashlib import sha256
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from cosim.batch.fused import FusedFlyer
from cosim.batch.outcome import FIELDS, BatchResult, arrivals_text, empty_outcomes
from cosim.batch.variation import Variation
from cosim.campaigns.store.plan import SWEEP, code_digest, versions
from cosim.campaigns.store.results import ARRIVALS, make_schema, make_table
from cosim.campaigns.sweeps.design import Design
from cosim.campaigns.workers.work import Rows, Work
from cosim.errors import RunError
from cosim.results.file_copies import VEHICLE_COPY, files_of, table_of_files
from cosim.scenario.law_factory import OwnLaw
from cosim.scenario.scenario import Scenario

_TYPES = {np.bool_: pa.bool_(), np.float64: pa.float64()}


class SweepBatch(NamedTuple):
    """Some rows of a sweep."""

    rows: Rows  # (n,) numbers of the rows
    values: NDArray[np.float64]  # (n, keys) values of the keys
    seeds: Rows  # (n,) seeds of the rows


def schema_of(keys: tuple[str, ...]) -> Any:
    """Make the schema of the rows of a sweep."""
    if reserved := {"row", "seed", "refused", ARRIVALS[0], *FIELDS} & set(keys):
        raise ValueError(f"{min(reserved)!r} varies, expected keys of a scenario")
    return make_schema(
        [
            ("row", pa.int64(), "", "Number of the row, from 0", False),
            *((key, pa.float64(), "", "Key of the scenario, in its own unit", False) for key in keys),
            ("seed", pa.int64(), "", "Of what is random in the row", False),
            *((name, _TYPES[kind], unit, text, True) for name, (kind, unit, text) in FIELDS.items()),
            ("refused", pa.string(), "", "Why the row was not flown; null if it was", True),
            ARRIVALS,
        ]
    )


def table_of(keys: tuple[str, ...], batch: SweepBatch, flown: BatchResult) -> Any:
    """Convert flights to a table."""
    reasons = [flown.refused.get(i) for i in range(len(batch.rows))]
    arrivals = [arrivals_text(flown.arrivals.get(i, ())) for i in range(len(batch.rows))]
    outcomes: list[NDArray[Any]] = [
        flown.outcomes[name].astype(object if kind is np.bool_ else kind) for name, (kind, _, _) in FIELDS.items()
    ]
    for column in outcomes:
        column[list(flown.refused)] = None  # NaN among floats
    return make_table(schema_of(keys), [batch.rows, *batch.values.T, batch.seeds, *outcomes, reasons, arrivals])


@dataclass(frozen=True)
class SweepTask:
    """The data that all rows of a sweep share."""

    variation: Variation = field(compare=False)
    engine: type[FusedFlyer]
    law: OwnLaw | None = None  # Python code, instead of the scenario's law
    mark: str = field(default_factory=lambda: secrets.token_hex(16))  # random identity of the task across processes

    def flyer(self) -> SweepFlyer:
        """Create a flyer."""
        return SweepFlyer(self)


class SweepFlyer:
    """Flies batches of a sweep by the fused loop."""

    def __init__(self, task: SweepTask) -> None:
        self._keys, self._engine = task.variation.keys, task.engine(task.variation, task.law)
        self.close = self._engine.close

    def fly(self, batch: SweepBatch) -> Any:
        """Fly a batch; return a table with its rows."""
        return table_of(self._keys, batch, self._engine.fly(batch.values, batch.seeds))


class SweepWork(Work):
    """The rows of a design."""

    unit = "row"

    def __init__(self, scenario: Scenario, design: Design, law: OwnLaw | None = None) -> None:
        scenario = law.in_scenario(scenario) if law else scenario
        keys = tuple(vary.key for vary in design.vary)
        self.variation = Variation(scenario, keys)
        for vary in design.vary:
            if isinstance(self.variation.number(vary.key), int) and not vary.whole:
                raise RunError(
                    f"{vary.key} is a whole number, expected {vary.key}=A,B,C, or a grid that meets no others"
                )
        self.name, self.design = scenario.name, design
        self.task = SweepTask(self.variation, FusedFlyer, law)
        self.schema = schema_of(keys)
        self.files = files_of(scenario)
        table = table_of_files(scenario)
        self.plan = {
            "kind": SWEEP,
            "name": scenario.name,
            **design.table(),
            # NaN and infinity as text
            "scenario": json.loads(json.dumps(table), parse_constant=lambda text: repr(float(text))),
            "vehicle_sha256": sha256(self.files.get(VEHICLE_COPY, b"")).hexdigest(),
            **({"law_sha256": law.digest} if law else {}),
            "code_sha256": code_digest(),
            "versions": versions(),
        }

    def __len__(self) -> int:
        return self.design.rows

    def batch(self, rows: Rows) -> SweepBatch:
        """Return values and seeds of some rows."""
        return SweepBatch(rows, self.design.values(rows), self.design.seeds(rows))

    def refused_table(self, row: int, reason: str) -> Any:
        """Return the table of one row that could not be flown."""
        return table_of(self.variation.keys, self.batch(np.array([row])), BatchResult(empty_outcomes(1), {0: reason}))
