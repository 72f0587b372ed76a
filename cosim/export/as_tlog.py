"""TLOG: the run as a vehicle's telemetry, as `cosim stream` sends it."""

from __future__ import annotations

import logging
from pathlib import Path

from cosim.export.excerpt import Excerpt
from cosim.mavlink.endpoint import Endpoint
from cosim.mavlink.options import MavlinkOptions
from cosim.mavlink.replay import replay

_log = logging.getLogger(__name__)


def write(excerpt: Excerpt, path: Path) -> list[Path]:
    """Write the file.

    Parameters
    ----------
    excerpt : Excerpt
        Of the whole run.
    path : Path
        The file.

    Returns
    -------
    list of Path
        It alone.
    """
    done = replay(excerpt.run.path, [Endpoint("tlog", path.name, path=str(path))], MavlinkOptions(), rate=None)
    for trouble in done.troubles:
        _log.warning("%s", trouble)
    return [path]
