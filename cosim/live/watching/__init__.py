"""A run in the terminal.

Sources: a live view, the folder of a run that is being recorded, or of a finished run.

Imports: replay, results, scenario, simulation, simulation.commands.
"""

from cosim.live.watching.run_views import Snapshot, snapshots
from cosim.live.watching.terminal_view import snapshot_table

__all__ = ["Snapshot", "snapshot_table", "snapshots"]
