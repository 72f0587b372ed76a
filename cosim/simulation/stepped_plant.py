"""What the master needs of a plant: an FMU, or a vehicle behind a link."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from plant_fmu.running.channels import Channels


class SteppedPlant(Protocol):
    """Has named numbers, and goes on in steps.

    Attributes
    ----------
    inputs, outputs, flags : Channels
        Its buffers change in place: inputs are sent with a step, outputs are as they are after it.
    """

    inputs: Channels
    outputs: Channels
    flags: Channels

    def set(self, values: Mapping[str, Any]) -> None:
        """Set parameters and start values by name."""
        ...

    def initialise(self) -> None:
        """Make it ready to step."""
        ...

    def step(self, step: float) -> None:
        """Go on by so many seconds."""
        ...

    def read_flags(self) -> Any:
        """Return the Boolean outputs, shape (n,), as they are now."""
        ...

    def close(self) -> None:
        """Give it back. May be called twice."""
        ...
