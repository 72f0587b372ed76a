"""Sources of the signals of an imported run: its file ``import.json``."""

from __future__ import annotations

from pathlib import Path

from cosim.errors import RunError
from cosim.io.strict_json import read_json
from plant_fmu.errors import TableError
from plant_fmu.toml_tables import Table, decode

IMPORT = "import.json"
COMMAND_TIME = "measured.time.commands"  # column of an imported run: when its commands were sampled [s]
# columns of an imported run: the last sample of the attitude, and its time [s]
ATTITUDE, ATTITUDE_TIME = tuple(f"measured.attitude.e{i}" for i in range(4)), "measured.time.attitude"


class TopicFacts(Table, frozen=True):
    """A quantity of a log: its source, its sample rate, and repairs of its samples."""

    quantity: str
    source: str  # message, topic or columns
    samples: int
    rate: float  # Hz, from the median time between samples
    longest: float  # s, longest time between samples that is no gap
    gaps: int
    longest_gaps: tuple[tuple[float, float], ...]  # s, begin and end of some gaps, in time of the run
    held: int  # repeats of a held value that were dropped
    bursts: int  # samples that arrived in bursts, and whose times were spread
    late: int  # samples that were dropped because they have the time of another one
    broken: int  # samples that are invalid: texts, NaN, infinity, or as the column map says
    duplicates: int = 0  # samples that were dropped because they repeat time and value
    sorted: int = 0  # samples that came after a later one
    outliers: int = 0  # samples that were left out because they are far from their neighbors

    @property
    def repairs(self) -> str:
        """Repairs of the samples with their counts; empty without any."""
        words = (
            (self.duplicates, "duplicates dropped"), (self.held, "repeats of held values dropped"),
            (self.sorted, "samples sorted by time"), (self.bursts, "samples of bursts put on even times"),
            (self.late, "samples at the time of another dropped"), (self.broken, "invalid samples left out"),
            (self.outliers, "outliers left out"),
        )  # fmt: skip
        return ", ".join(f"{count} {text}" for count, text in words if count)


class LogFacts(Table, frozen=True):
    """Facts about the log of an imported run."""

    log: str  # name of the file
    bytes: int
    start: float  # s, time of the first row on the log's clock
    rate: float  # Hz, rate of the rows
    commands: str  # how commands were converted to forces, as a sentence; empty without commands
    topics: tuple[TopicFacts, ...]
    unread: dict[str, int]  # number of samples by message, topic or column that was not used
    remarks: tuple[str, ...]


def load_log_facts(folder: Path) -> LogFacts:
    """Load the facts about the log of an imported run."""
    file = folder / IMPORT
    try:
        facts: LogFacts = decode(read_json(file), LogFacts)
        return facts
    except TableError as error:
        raise RunError(f"{file}: {error}") from error
