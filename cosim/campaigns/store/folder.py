"""The folder of a campaign: locked by one process, filled table by table, joined at the end."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cosim.campaigns.store.plan import difference
from cosim.campaigns.store.results import Results
from cosim.campaigns.store.row_log import RowLog
from cosim.campaigns.workers.work import Work
from cosim.errors import RunError
from cosim.io.atomic_file import write_atomic
from cosim.io.format_number import FORMAT, require_format
from cosim.io.strict_json import json_text, read_json
from plant_fmu.archive import is_temporary

PLAN = "campaign.json"
RESULTS = "results.parquet"
SUMMARY = "summary.json"
PARTS = "results.parts"  # folder of the rows of an unfinished campaign
LOCK = ".lock"


class CampaignFolder:
    """The folder of one campaign, claimed by its process."""

    def __init__(self, path: Path, work: Work) -> None:
        self.path, self._schema = path, work.schema
        plan = {"format": FORMAT, **work.plan}
        if not (path / PLAN).exists():
            write_atomic(path / PLAN, json.dumps(plan, indent=2, allow_nan=False) + "\n")
        elif differences := difference(read_plan(path), json.loads(json.dumps(plan))):
            raise RunError(f"{path}: holds another campaign ({differences}), expected a folder of its own")
        for name, content in work.files.items():
            if not (path / name).exists():
                write_atomic(path / name, content)
        self.log = RowLog(path / PARTS, work.schema)

    @property
    def complete(self) -> bool:
        """True if all rows are joined in one file."""
        return (self.path / RESULTS).exists()

    def rows(self) -> Any:
        """Return all existing rows in order of key, a pyarrow.Table."""
        return Results(self.path / RESULTS, self._schema).table if self.complete else self.log.table()

    def join(self) -> Results:
        """Join the rows to one file in order of key, unless this has been done, and return it."""
        if not self.complete:
            self.log.join(self.path / RESULTS)
        self.log.remove()
        return Results(self.path / RESULTS, self._schema)

    def conclude(self, summary: dict[str, Any]) -> dict[str, Any]:
        """Write the summary, and return it."""
        write_atomic(self.path / SUMMARY, json_text(summary))
        return summary


@contextlib.contextmanager
def campaign_folder(path: Path, work: Work) -> Iterator[CampaignFolder]:
    """Claim a folder for a campaign during a block; convert the system's errors to a RunError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        if not (path / PLAN).exists() and any(p.name != LOCK and not is_temporary(p.name) for p in path.iterdir()):
            raise RunError(f"{path}: exists and holds no campaign, expected a new folder or that of a campaign")
    except OSError as error:
        raise RunError(f"{path}: {error.strerror or error}") from error
    with lock_folder(path):
        folder = CampaignFolder(path, work)
        with contextlib.closing(folder.log):
            try:
                yield folder
            except OSError as error:
                reason = f"{error.strerror or error}; what is flown is kept, and the same command goes on"
                raise RunError(f"{path}: {reason}") from error


@contextlib.contextmanager
def lock_folder(path: Path) -> Iterator[None]:
    """Lock the folder of a campaign during a block that writes into it; convert the system's errors to a RunError."""
    try:
        lock = _lock(path / LOCK)
        try:
            yield
        finally:
            os.close(lock)
    except OSError as error:
        raise RunError(f"{path}: {error.strerror or error}") from error


def read_plan(path: Path) -> dict[str, Any]:
    """Read the plan of the campaign in a folder."""
    if not (path / PLAN).exists():
        raise RunError(f"{path}: holds no campaign ({PLAN} is missing)")
    plan = read_json(path / PLAN)
    require_format(path / PLAN, plan.get("format"))
    return plan


def _lock(path: Path) -> int:
    """Lock a file until its descriptor is closed or the process ends; return the descriptor."""
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
