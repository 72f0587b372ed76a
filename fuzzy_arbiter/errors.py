"""What can go wrong when an arbiter is defined, read, or asked."""


class ArbiterError(Exception):
    """Base of all errors of this package; its text is one line meant for the user."""


class DefinitionError(ArbiterError):
    """A definition that cannot be: an unknown term in a rule, two variables of one name, a shape that turns back."""


class EngineError(DefinitionError):
    """An engine that does not exist, or that cannot evaluate this system."""


class FormatError(ArbiterError):
    """A text that is not of its format, or says what this package does not know."""


class UnsupportedError(ArbiterError):
    """A definition that the wished format cannot say."""


class InputError(ArbiterError):
    """An input that is missing, unknown, not a number, or outside its universe."""


class UndefinedOutputError(ArbiterError):
    """An output for which no rule fires and which has no default."""
