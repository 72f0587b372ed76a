"""Format number of the folders of runs and campaigns, by which a folder of another version is refused."""

from __future__ import annotations

from pathlib import Path

from cosim.errors import RunError

FORMAT = 2  # in format 1, columns, commands and the paper's law had other names


def require_format(where: Path, found: object) -> None:
    """Raise a RunError if a file has another format number than `FORMAT`."""
    if found == FORMAT:
        return
    if found is None:
        found = 1
    changed = "; columns helm.* are commands.* since, and law printed is ismail_dunnigan" if found == 1 else ""
    raise RunError(f"{where}: format is {str(found)[:20]}, expected {FORMAT}{changed}: fly it again with this version")
