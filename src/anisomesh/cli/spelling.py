"""Options in messages of the library, whose names are the ones of Python, as the command line spells them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import fields

from anisomesh.options import RemeshOptions

OTHER_SPELLINGS = {"n_vertices": "--vertices", "weld_tolerance": "--weld", "size_field": "size of --metric-file"}
"""Options that are not called on the command line as in Python."""

_PYTHON_ONLY = ("energy",)
_NOT_IN_THE_OPTIONS = ("n_vertices", "ratio", "ratios", "max_error", "metric_file", "adapt_to")
_SPELLINGS = {
    name: OTHER_SPELLINGS.get(name, f"--{name.replace('_', '-')}")
    for name in (*(field.name for field in fields(RemeshOptions)), *_NOT_IN_THE_OPTIONS)
    if name not in _PYTHON_ONLY
}
_UNMISTAKABLE = "|".join(name for name in _SPELLINGS if "_" in name or name in ("ratio", "ratios"))
_ENGLISH = "|".join(name for name in _SPELLINGS if not re.fullmatch(_UNMISTAKABLE, name))
_NAME = re.compile(
    rf"(?<![\w./\\'\"-])({_UNMISTAKABLE})(?!\w|[./\\'\"-]\w)"  # not in file names and quotations
    rf"|(?:(?<=^)|(?<=: ))({_ENGLISH})(?=\[| = | has \d| ['\d])"  # in front of a value: they are words of English
)
_LINE_BREAKS = re.compile(r"\s*[\x00-\x1f\x7f-\x9f\u2028\u2029]+\s*")
_LINE_OF_FILE = re.compile(r", line \d+: ")


def in_one_line(text: str) -> str:
    """Return a text with a blank for line breaks, tabs and other characters that move the cursor, in names too."""
    return _LINE_BREAKS.sub(" ", text).strip()


def spelled(name: str) -> str:
    """Return an option as a message on wrong words of the command line names it."""
    return "-n" if name == "n_vertices" else _SPELLINGS[name]


def as_options(message: str) -> str:
    """Return a message with options of a remesh as the command line spells them, such as ``--max-error``.

    In a message on a line of a file they stay as they are, since they are called so there.
    """
    if _LINE_OF_FILE.search(message):
        return message
    return _NAME.sub(lambda match: _SPELLINGS[match[1] or match[2]], message)


def warning_rows(warnings: Iterable[str]) -> list[tuple[str, str]]:
    """Return the rows of a table with the warnings of a remesh."""
    return [("warning", as_options(text)) for text in warnings]
