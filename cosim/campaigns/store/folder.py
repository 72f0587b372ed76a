"""The folder of a campaign: locked by one process, filled part by part, joined at the end."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

from cosim.campaigns.store.parts import Parts
from cosim.campaigns.store.plan import difference
from cosim.campaigns.store.results import Results
from cosim.campaigns.workers.work import Rows, Work
from cosim.errors import RunError
from cosim.io.atomic_file import write_atomic
from cosim.io.format_number import FORMAT, require_format
from cosim.io.strict_json import read_json
from plant_fmu.archive import is_temporary

PLAN = "campaign.json"
RESULTS = "results.parquet"
SUMMARY = "summary.json"
PARTS = "results.parts"  # folder of the parts of an unfinished campaign
LOCK = ".lock"


class CampaignFolder:
    """The folder of one campaign, locked by one process at a time."""

    # Rows are written in parts, each an atomic file. The rows of an unreadable part are flown again.

    def __init__(self, path: Path, work: Work) -> None:
        self.path, self._schema = path, work.schema
        try:
            path.mkdir(parents=True, exist_ok=True)
            self._refuse_other_files()
            self._lock = _lock(path / LOCK)
        except OSError as error:
            raise RunError(f"{path}: {error.strerror or error}") from error
        try:
            self._claim(work)
            self._parts = Parts(path / PARTS, work.schema)
        except OSError as error:
            self.close()
            raise RunError(f"{path}: {error.strerror or error}") from error
        except BaseException:
            self.close()
            raise

    def _refuse_other_files(self) -> None:
        if not (self.path / PLAN).exists() and any(
            p.name != LOCK and not is_temporary(p.name) for p in self.path.iterdir()
        ):
            raise RunError(f"{self.path}: exists and holds no campaign, expected a new folder or that of a campaign")

    def _claim(self, work: Work) -> None:
        file, plan = self.path / PLAN, {"format": FORMAT, **work.plan}
        if file.exists():
            if differing := difference(read_plan(self.path), json.loads(json.dumps(plan))):
                raise RunError(f"{self.path}: holds another campaign ({differing}), expected a folder of its own")
        else:
            write_atomic(file, json.dumps(plan, indent=2, allow_nan=False) + "\n")
        for name, content in work.files.items():
            if not (self.path / name).exists():
                write_atomic(self.path / name, content)

    @property
    def complete(self) -> bool:
        """True if all rows are joined in one file."""
        return (self.path / RESULTS).exists()

    def results(self) -> Results:
        """Return the joined rows."""
        return Results(self.path / RESULTS, self._schema)

    def remove_parts(self) -> None:
        """Remove the parts."""
        self._parts.remove()

    def keys(self) -> Rows:
        """Return the keys of the rows in the parts, shape (n,)."""
        return self._parts.keys()

    def rows(self) -> Any:
        """Return all existing rows in order of key, a pyarrow.Table."""
        return self.results().table if self.complete else self._parts.table()

    def add(self, table: Any) -> None:
        """Write the rows of a batch, which are in order of key."""
        self._parts.add(table)

    def join(self) -> Results:
        """Join the parts to one file in order of key, and return it."""
        self._parts.join(self.path / RESULTS)
        return self.results()

    def close(self) -> None:
        """Unlock the folder. May be called twice."""
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def __enter__(self) -> CampaignFolder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


@contextlib.contextmanager
def held(path: Path) -> Iterator[None]:
    """Lock the folder of a campaign during a block that writes into it."""
    try:
        lock = _lock(path / LOCK)
    except OSError as error:
        raise RunError(f"{path}: {error.strerror or error}") from error
    try:
        yield
    except OSError as error:
        raise RunError(f"{path}: {error.strerror or error}") from error
    finally:
        if lock is not None:
            os.close(lock)


def read_plan(path: Path) -> dict[str, Any]:
    """Read the plan of the campaign in a folder."""
    if not (path / PLAN).exists():
        raise RunError(f"{path}: holds no campaign ({PLAN} is missing)")
    plan = read_json(path / PLAN)
    require_format(path / PLAN, plan.get("format"))
    return plan


def _lock(path: Path) -> int | None:
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
