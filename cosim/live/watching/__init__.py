"""A run in the terminal.

Sources: a live view, the folder of a run that is being recorded, or of a finished run.

Imports: replay, results, scenario, simulation, simulation.commands.
"""

from cosim.live.watching.picture import picture
from cosim.live.watching.sources import Look, looks

__all__ = ["Look", "looks", "picture"]
