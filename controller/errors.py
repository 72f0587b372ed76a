"""What can go wrong when a controller is set up."""


class ControllerError(Exception):
    """Base of all errors of this package; its text is one line meant for the user."""


class RegionError(ControllerError):
    """A region that cannot be: a radius below zero, a polygon with two corners."""


class LawError(ControllerError):
    """Gains or limits that cannot be."""
