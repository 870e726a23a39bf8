"""Strict reading of TOML files: an unknown key is an error with a suggestion."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from anisomesh.errors import OptionError, why_unreadable


def parse_toml(name: str, text: str) -> dict[str, Any]:
    """Return the table in a TOML text.

    Parameters
    ----------
    name
        Name of the text in messages.
    text
        The text.

    Raises
    ------
    OptionError
        If the text is not TOML.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise OptionError(f"{name} is not valid TOML: {error}") from error


def read_toml(path: Path) -> dict[str, Any]:
    """Return the table in a TOML file.

    Raises
    ------
    OptionError
        If the file cannot be read or is not TOML.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise OptionError(f"{path}: {why_unreadable(path, error)}; expected a TOML file") from error
    except UnicodeDecodeError as error:
        raise OptionError(f"{path} cannot be read as text: {error}") from error
    return parse_toml(str(path), text)


def check_keys(where: str, table: dict[str, Any], known: Iterable[str]) -> None:
    """Raise OptionError for the first unknown key of a table, at the place ``where`` of a file."""
    names = sorted(known)
    for key in table:
        if key not in names:
            raise OptionError(f"{where}: unknown key {key!r}{hint(key, names)}")


def hint(word: str, known: Iterable[str]) -> str:
    """Return a suggestion of the most similar known word, or of one that begins with the word; empty if none does."""
    names = list(known)
    close = difflib.get_close_matches(word, names, 1) or [name for name in names if name.startswith(word)]
    return f" (did you mean {close[0]!r}?)" if close else ""
