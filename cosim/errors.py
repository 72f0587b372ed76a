"""Errors of this package."""

from plant_fmu.errors import one_line


class CosimError(Exception):
    """Base of all errors of this package; its text is one line meant for the user."""

    def __str__(self) -> str:
        """Return the text on one line."""
        return one_line(super().__str__())


class ScenarioError(CosimError):
    """A scenario that is unknown, or has an invalid key or value."""


class RunError(CosimError):
    """A run folder that cannot be written or read."""


class TelemetryError(CosimError):
    """A telemetry link that cannot be opened."""


class CommandError(CosimError):
    """A command to a running vehicle that is invalid."""


class ExportError(CosimError):
    """A run that cannot be written in another format."""


class ImportLogError(CosimError):
    """A vehicle's log that cannot be imported as a run; `draft` is a column map for one that lacks it."""

    draft = ""


class IdentificationError(CosimError):
    """Runs that vehicle parameters cannot be identified from."""
