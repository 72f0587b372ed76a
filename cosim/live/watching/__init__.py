"""A run in the terminal.

Live, from its folder while it is written, or played back.

Imports: replay, results, scenario, simulation, simulation.commands.
"""

from cosim.live.watching.picture import picture
from cosim.live.watching.sources import Look, looks

__all__ = ["Look", "looks", "picture"]
