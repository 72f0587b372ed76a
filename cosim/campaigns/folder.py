"""The folder of a campaign: claimed by one, filled part by part, joined at the end."""

from __future__ import annotations

import json
import logging
import os
import shutil
import sys
from pathlib import Path
from types import TracebackType

import pyarrow as pa

from cosim.campaigns.plan import Plan, difference
from cosim.campaigns.results import Results, Row, read_results, table_of, write_whole
from cosim.errors import RunError

log = logging.getLogger(__name__)

PLAN = "campaign.json"
RESULTS = "results.parquet"
SUMMARY = "summary.json"
PARTS = "results.parts"  # what a killed campaign leaves
LOCK = ".lock"


class CampaignFolder:
    """A folder that belongs to one campaign, and to one process at a time.

    Rows come in parts, each a file that is there whole or not at all. A part that a damaged disk has left unreadable
    is flown again.

    Parameters
    ----------
    path : Path
        A folder that does not exist, is empty, or holds the same campaign.
    plan : Plan
        What the campaign is.

    Raises
    ------
    RunError
        If the folder holds something else, is in use by another process, or cannot be written.
    """

    def __init__(self, path: Path, plan: Plan) -> None:
        self.path = path
        try:
            path.mkdir(parents=True, exist_ok=True)
            self._refuse_strangers()
            self._lock = _lock(path / LOCK)
        except OSError as error:
            raise RunError(f"{path}: {error.strerror or error}") from error
        try:
            self._claim(plan)
        except OSError as error:
            self.close()
            raise RunError(f"{path}: {error.strerror or error}") from error
        except BaseException:
            self.close()
            raise

    def _refuse_strangers(self) -> None:
        if not (self.path / PLAN).exists() and any(p.name not in (LOCK, f".{PLAN}") for p in self.path.iterdir()):
            raise RunError(f"{self.path}: exists and holds no campaign, expected a new folder or that of a campaign")

    def _claim(self, plan: Plan) -> None:
        file, table = self.path / PLAN, plan.table()
        if file.exists():
            try:
                found = json.loads(file.read_text(encoding="utf-8"))
            except ValueError as error:
                raise RunError(f"{file}: cannot be read: {error}") from error
            if not isinstance(found, dict):
                raise RunError(f"{file}: holds no campaign")
            if differing := difference(found, json.loads(json.dumps(table))):
                raise RunError(f"{self.path}: holds another campaign ({differing}), expected a folder of its own")
        else:
            write_text(file, json.dumps(table, indent=2) + "\n")
        (self.path / PARTS).mkdir(exist_ok=True)
        for scratch in (self.path / PARTS).glob(".*"):  # of a part that was being written
            scratch.unlink()

    @property
    def complete(self) -> bool:
        """Whether all rows are joined."""
        return (self.path / RESULTS).exists()

    def results(self) -> Results:
        """Return the joined rows.

        Raises
        ------
        RunError
            If they cannot be read.
        """
        return read_results(self.path / RESULTS)

    def load_parts(self) -> set[int]:
        """Take stock of the parts, and return the seeds whose rows they hold."""
        seeds: set[int] = set()
        self._next = 0
        for file in self._parts():
            self._next = int(file.stem) + 1
            try:
                seeds.update(read_results(file).table["seed"].to_pylist())
            except RunError as error:
                log.warning("%s; its scenes are flown again", error)
                file.unlink()
        return seeds

    def add(self, rows: list[Row]) -> None:
        """Write a part, once `load_parts` has found which are there."""
        write_whole(self.path / PARTS / f"{self._next:08}.parquet", table_of(rows))
        self._next += 1

    def join(self) -> Results:
        """Join the parts to one file in order of seed, and return the rows."""
        results = Results(pa.concat_tables(read_results(file).table for file in self._parts()))
        results.write(self.path / RESULTS)
        self.remove_parts()
        return results

    def _parts(self) -> list[Path]:
        return sorted((self.path / PARTS).glob("*.parquet"))

    def remove_parts(self) -> None:
        """Remove what is joined."""
        shutil.rmtree(self.path / PARTS, ignore_errors=True)

    def close(self) -> None:
        """Let others have the folder. May be called twice."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def __enter__(self) -> CampaignFolder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all.

    Parameters
    ----------
    path : Path
        The file; what was there is replaced.
    text : str
        Its content.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    scratch = path.with_name(f".{path.name}")
    scratch.write_text(text, encoding="utf-8")
    scratch.replace(path)


def _lock(path: Path) -> int | None:
    """Lock a file for as long as this process lives, and return its descriptor."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(descriptor)
        if isinstance(error, (BlockingIOError, PermissionError)):
            raise RunError(f"{path.parent}: another process is at work in it") from error
        raise
    return descriptor
