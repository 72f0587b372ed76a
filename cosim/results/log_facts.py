"""Where the signals of an imported run are from: its file ``import.json``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from cosim.errors import RunError
from cosim.io.strict_json import read_json
from plant_fmu.errors import TableError
from plant_fmu.toml_tables import decode

IMPORT = "import.json"


@dataclass(frozen=True)
class TopicFacts:
    """A quantity of a log: where it stands, how often it comes, and what had to be mended."""

    quantity: str
    source: str  # message, topic or columns
    samples: int
    rate: float  # Hz, by the median time between samples
    longest: float  # s, between samples: a longer pause is a gap
    gaps: int
    longest_gaps: tuple[tuple[float, float], ...]  # s of the run, begin and end of some
    held: int  # repeats of a held value that were left out
    bursts: int  # samples that came in bursts, and whose times were spread
    late: int  # samples that were left out because a later one had come
    broken: int  # samples with a number that is none


@dataclass(frozen=True)
class LogFacts:
    """What a reader must know of an imported run."""

    log: str  # name of the file
    bytes: int
    start: float  # s, of the first row on the log's clock
    rate: float  # Hz, of the rows
    commands: str  # how they became forces, in words; empty where there are none
    topics: tuple[TopicFacts, ...]
    unread: dict[str, int]  # messages, topics or columns of which nothing was made, and how often each comes
    remarks: tuple[str, ...]


def load_log_facts(folder: Path) -> LogFacts:
    """Read where the signals of an imported run are from.

    Parameters
    ----------
    folder : Path
        The run folder.

    Returns
    -------
    LogFacts
        As `cosim.import_log` found them.

    Raises
    ------
    RunError
        If the file is missing, or cannot be read.
    """
    file = folder / IMPORT
    try:
        return decode(read_json(file), LogFacts)
    except TableError as error:
        raise RunError(f"{file}: {error}") from error
