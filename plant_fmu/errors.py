"""What can go wrong while an FMU is made."""


class PlantFmuError(Exception):
    """Base of all errors of this package; its text is one line meant for the user."""


class TableError(PlantFmuError):
    """A TOML file that cannot be read, or a key in it that is missing, unknown or of the wrong kind."""


class VehicleError(PlantFmuError):
    """A vehicle that cannot be: unknown name, or numbers that contradict physics."""


class BuildError(PlantFmuError):
    """No compiler, a compiler that fails, or a place that cannot be written."""


class PlantError(PlantFmuError):
    """An FMU that cannot be loaded, or refuses a value or a step; its own words are in the message."""


class FmuFileError(PlantFmuError):
    """A file that is no FMU, or one that no importer should extract."""


class TaskError(PlantFmuError):
    """A simulation that cannot be: times that do not fit, or variables that the FMU does not have."""


class ImporterError(PlantFmuError):
    """An importer that refuses an FMU, or fails with it."""
