"""Interface of a plant that the master steps: an FMU, or a vehicle behind a link."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from plant_fmu.running.channels import Channels


class SteppedPlant(Protocol):
    """Plant with named variables that advances in steps.

    Attributes
    ----------
    inputs, outputs, flags : Channels
        Buffers that change in place: `step` sends the inputs and updates the outputs.
    """

    inputs: Channels
    outputs: Channels
    flags: Channels

    def set(self, values: Mapping[str, Any]) -> None:
        """Set parameters and start values by name."""
        ...

    def initialise(self) -> None:
        """Initialise the plant before the first step."""
        ...

    def step(self, step: float) -> None:
        """Advance the plant by `step` seconds."""
        ...

    def read_flags(self) -> Any:
        """Return the present Boolean outputs, shape (n,)."""
        ...

    def close(self) -> None:
        """Release the plant. May be called twice."""
        ...
