"""The number of the form in which runs and campaigns are kept, so that a folder of another version is named as such."""

from __future__ import annotations

from pathlib import Path

from cosim.errors import RunError

FORMAT = 2  # since 1, columns, commands and the paper's law have other names


def require_format(where: Path, found: object) -> None:
    """Refuse what was written in another form.

    Parameters
    ----------
    where : Path
        File that says its form.
    found : object
        What it says; None, as format 1 had it, for nothing.

    Raises
    ------
    RunError
        If it is not `FORMAT`.
    """
    if found == FORMAT:
        return
    if found is None:
        found = 1
    changed = "; columns helm.* are commands.* since, and law printed is ismail_dunnigan" if found == 1 else ""
    raise RunError(f"{where}: format is {str(found)[:20]}, expected {FORMAT}{changed}: fly it again with this version")
