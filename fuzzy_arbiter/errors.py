"""What can go wrong when an arbiter is defined or asked."""


class ArbiterError(Exception):
    """Base of all errors of this package; its text is one line meant for the user."""


class DefinitionError(ArbiterError):
    """An arbiter that cannot be: no criteria, two of one name, an unknown engine."""


class MembershipError(ArbiterError):
    """A membership that is missing, unknown, not a number, or outside [0, 1]."""
