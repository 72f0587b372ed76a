"""A run in the terminal: live, from its folder while it is written, or played back."""

from cosim.live.watching.picture import picture
from cosim.live.watching.sources import Look, looks

__all__ = ["Look", "looks", "picture"]
