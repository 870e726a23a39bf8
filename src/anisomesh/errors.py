"""The exceptions anisomesh raises on purpose: all derive from :class:`AnisomeshError`.

A message says what is wrong, where, the offending value, what was expected and what to do about it. The
command line prints it as one line and exits with status 1.
"""


class AnisomeshError(Exception):
    """Base of every error that anisomesh raises on purpose."""


class MeshFileError(AnisomeshError):
    """A mesh file cannot be read or written (missing, unknown format, truncated, malformed)."""


class MeshError(AnisomeshError, ValueError):
    """Arrays do not describe a mesh (index out of range, coordinates not finite, no face)."""


class MetricError(AnisomeshError, ValueError):
    """A metric field has the wrong shape or is not symmetric positive definite."""


class OptionError(AnisomeshError, ValueError):
    """An option has a value outside its range."""


class TimeLimitError(AnisomeshError):
    """The time limit was over before there was anything to return."""
