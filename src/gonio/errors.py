"""What gonio raises: every error says the rule, the value got, the value expected and the next step."""


class Error(Exception):
    """Base class of everything gonio raises on bad input."""


class ParameterError(Error, ValueError):
    """A parameter, an option or an argument has a value that it may not have."""


class ShapeError(Error, ValueError):
    """Array shapes do not fit together."""


class ArrayTypeError(Error, TypeError):
    """An array has the wrong library, dtype or kind, or libraries are mixed in one call."""


class FormatError(Error, ValueError):
    """A file is not what it claims to be, or is damaged."""


class NotFoundError(Error, LookupError):
    """A name (material, model, parameter, file) is not known."""


class ExpressionError(Error, ValueError):
    """A material expression cannot be read."""


class DependencyError(Error, ImportError):
    """An optional library is needed for this and is not installed."""


class TraceError(Error, TypeError):
    """A formula does what cannot be traced, and so not be compiled; it still runs on arrays."""


class TooLargeError(Error, MemoryError):
    """A result would not fit into this machine's memory."""


class MissingDataWarning(UserWarning):
    """Part of an integral or a picture needed directions that a measurement does not hold."""


class ToleranceWarning(UserWarning):
    """An integral is less exact than was asked for."""
