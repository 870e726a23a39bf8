"""The log of the package on standard error: warnings always, more with ``-v`` and ``-vv``."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import wraps
from inspect import Parameter, Signature, signature
from typing import Annotated, Any

import typer

from anisomesh.cli.spelling import in_one_line

logger = logging.getLogger(__name__)

_LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)  # by the number of -v
_Verbose = Annotated[
    int,
    typer.Option(
        "--verbose", "-v", count=True, show_default=False, help="Show what the package logs; -vv for more of it."
    ),
]


class _Lines(logging.Handler):
    """Prints a record as a line, above a progress bar if there is one, and equal warnings once."""

    def __init__(self) -> None:
        super().__init__()
        self._warned: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        """Print a record."""
        line = f"anisomesh: {record.levelname.lower()}: {in_one_line(record.getMessage())}"
        if record.levelno >= logging.WARNING:
            if line in self._warned:
                return
            self._warned.add(line)
        print(line, file=sys.stderr, flush=True)


def log_warnings(rows: Iterable[tuple[str, str]]) -> None:
    """Log the warnings among the rows of a table that is not printed."""
    for name, text in rows:
        if name == "warning":
            logger.warning("%s", text)


@contextmanager
def log_on_stderr(verbosity: int) -> Iterator[None]:
    """Print what the package logs, and nobody else does, on standard error.

    Parameters
    ----------
    verbosity
        0 for warnings, 1 for information too, 2 for everything.
    """
    package, lines = logging.getLogger("anisomesh"), _Lines()
    level, propagate = package.level, package.propagate
    package.setLevel(_LEVELS[min(verbosity, len(_LEVELS) - 1)])
    package.propagate = False  # a library may have set up another handler, and lines would appear twice
    package.addHandler(lines)
    try:
        yield
    finally:
        package.removeHandler(lines)
        package.setLevel(level)
        package.propagate = propagate


def logs(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command that prints the log while it runs, with an option ``--verbose``.

    Notes
    -----
    typer reads the parameters of a command from its signature, so the signature is extended.
    """

    @wraps(command)
    def logging_command(*args: Any, verbose: int, **options: Any) -> None:
        with log_on_stderr(verbose):
            command(*args, **options)

    own = signature(command, eval_str=True)
    added = Parameter("verbose", Parameter.KEYWORD_ONLY, default=0, annotation=_Verbose)
    logging_command.__signature__ = Signature([*own.parameters.values(), added])  # type: ignore[attr-defined]
    return logging_command
