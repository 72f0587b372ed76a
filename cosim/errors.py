"""What can go wrong between a scenario and its run."""


class CosimError(Exception):
    """Base of all errors of this package; its text is one line meant for the user."""

    def __str__(self) -> str:
        """Return the line."""
        from plant_fmu.errors import one_line  # with it comes the plant, which takes time to load

        return one_line(super().__str__())


class ScenarioError(CosimError):
    """A scenario that is unknown, or a key in it that cannot be."""


class RunError(CosimError):
    """A run folder that cannot be written or read."""


class TelemetryError(CosimError):
    """A telemetry link that cannot be opened."""


class CommandError(CosimError):
    """A command to a running vehicle that cannot be followed."""


class ExportError(CosimError):
    """A run that cannot be written in another format."""


class ImportLogError(CosimError):
    """A log of a vehicle that cannot be read as a run."""


class IdentificationError(CosimError):
    """Runs that vehicle parameters cannot be identified from."""
