"""Names of texture files: in lines of .mtl files, and from folder to folder."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from pathlib import Path, PureWindowsPath
from typing import NamedTuple

from anisomesh.io.carried import listed
from anisomesh.io.holding.losses import Losses

_TEXTURE = re.compile(r"\s*(?:map_\w+|bump|disp|decal|refl|norm)\s", re.IGNORECASE)
_OPTION = re.compile(r"-[a-zA-Z]+")
_DEFAULTS = {  # of options, by specification; any value of others changes something
    **{"-blendu": "on", "-blendv": "on", "-cc": "off", "-clamp": "off"},
    **{"-bm": "1", "-boost": "0", "-mm": "0 1", "-o": "0 0 0", "-s": "1 1 1", "-t": "0 0 0"},
}
_OF_THREE = ("-o", "-s", "-t")  # options with one to three numbers
_SCHEME = re.compile(r"[a-zA-Z][a-zA-Z+.-]+:")


class TextureLine(NamedTuple):
    """A line of a .mtl file that names a texture.

    Attributes
    ----------
    begin
        What is in front of the name.
    name
        The name, with slashes if it is found with these only.
    file
        The file with this name, None if there is none.
    """

    begin: str
    name: str
    file: Path | None

    @property
    def options(self) -> list[str]:
        """The options that change something."""
        values: dict[str, list[str]] = {}
        for word in self.begin.split()[1:]:
            if _OPTION.fullmatch(word):
                values[word.lower()] = []
            elif values:
                list(values.values())[-1].append(word)
        return [option for option, given in values.items() if not _is_default(option, given)]


def texture_line(line: str, folder: Path) -> TextureLine | None:
    """Return what a line says of a texture whose name is from a folder; None if it names none."""
    if not _TEXTURE.match(line):
        return None
    for spelling in (line, line.replace("\\", "/")):  # backslashes of Windows
        for match in re.finditer(r"\s+", spelling.rstrip()):
            name = spelling[match.end() :].strip()
            if name and is_file(folder / name):
                return TextureLine(spelling[: match.end()], name, folder / name)
    words = list(re.finditer(r"\S+", line))
    at, last = 1, len(words) - 1
    while at < last and _OPTION.fullmatch(option := words[at][0]):
        count = len(_DEFAULTS.get(option.lower(), "?").split())
        at += 1
        while at < last and count and (option.lower() not in _OF_THREE or _as_number(words[at][0]) is not None):
            at, count = at + 1, count - 1
    return TextureLine(line[: words[at].start()], line[words[at].start() :].strip(), None) if at <= last else None


def _is_default(option: str, given: list[str]) -> bool:
    """Return whether the values of an option change nothing."""
    usual = _DEFAULTS.get(option, "").split()
    same = [a.lower() == b or _as_number(a) in {_as_number(b)} - {None} for a, b in zip(given, usual, strict=False)]
    return 0 < len(given) <= len(usual) and all(same)


def _as_number(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None


def is_file(path: Path) -> bool:
    """Return whether there is a file; not if the path is too long or not one."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def is_in_text(name: str) -> bool:
    """Return whether a name is an address or the content itself, as ``http:`` and ``data:`` begin."""
    return _SCHEME.match(name) is not None


def absolute_name(name: str, folder: Path) -> str:
    """Return the absolute name of a file that a name refers to in a folder, whether it is there or not."""
    is_absolute = not name or PureWindowsPath(name).is_absolute() or Path(name).is_absolute() or is_in_text(name)
    try:
        return name if is_absolute and not is_file(folder / name) else str((folder / name).resolve())
    except (OSError, ValueError):  # too long, or not a name
        return name


def relative_name(name: str, folder: Path) -> str:
    """Return the name from a folder of a file with an absolute name; the same name for others."""
    try:
        return os.path.relpath(name, folder).replace(os.sep, "/") if Path(name).is_absolute() else name
    except ValueError:  # on another drive
        return name


def moved(text: str, old: Path, new: Path, losses: Losses) -> str:
    """Return materials whose textures have names from a new folder; files that are missing are added to the losses."""
    lines, missing = [], []
    for line in text.removesuffix("\n").split("\n"):
        given = texture_line(line, old)
        if given is None or Path(given.name).is_absolute():
            lines.append(line)
            continue
        name = given.name
        if given.file is None and not PureWindowsPath(name).is_absolute():
            name = name.replace("\\", "/")
        name = relative_name(absolute_name(name, old), new)
        missing += [name] if given.file is None else []
        lines.append(given.begin + name)
    say_missing(missing, losses)
    return "\n".join([*lines, ""])


def say_missing(names: Iterable[str], losses: Losses) -> None:
    """Add to the losses that files of textures are missing."""
    given = list(dict.fromkeys(names))
    if given:
        losses.say(f"the content of missing texture files: {listed(list(map(repr, given)))}")
