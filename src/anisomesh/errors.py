"""Exceptions, all derived from :class:`AnisomeshError`.

A message says what is wrong, where, the value, what was expected and the remedy. The command line prints it as one
line and exits with status 1.
"""


class AnisomeshError(Exception):
    """Base class of all errors that anisomesh raises."""


class MeshFileError(AnisomeshError):
    """A mesh file cannot be read or written (missing, unknown format, truncated, malformed)."""


class MeshError(AnisomeshError, ValueError):
    """Arrays or objects are not a mesh (index out of range, coordinates not finite, no face)."""


class MetricError(AnisomeshError, ValueError):
    """A metric field has the wrong shape, or its tensors are not symmetric positive definite."""


class OptionError(AnisomeshError, ValueError):
    """The value of an option is out of range."""


class TimeLimitError(AnisomeshError):
    """The time limit expired before there was a result."""
