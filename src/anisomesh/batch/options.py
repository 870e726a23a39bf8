"""The options of a job: plain values, and files that belong to its mesh."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import fields
from typing import Any

from anisomesh._values import Length
from anisomesh.counts.target import read_target
from anisomesh.errors import OptionError
from anisomesh.options import RemeshOptions, with_overrides
from anisomesh.toml import check_keys

TARGETS = ("n_vertices", "ratio", "max_error", "edge_length")
"""Options that say how many vertices a result has; a job has one of them."""
TABLES = ("features", "keep_points", "density")
"""Options whose value is the name of a text file with numbers for a mesh."""
_LENGTHS = ("max_error", "edge_length", "weld_tolerance")
_OBJECTS = ("energy", "size_field", "min_size", "max_size", "gradation")  # without a form in a file of jobs
_WITHOUT_EFFECT = ("threads",)  # on the result
OPTION_NAMES = tuple(
    name for name in (*TARGETS[:3], *(field.name for field in fields(RemeshOptions))) if name not in _OBJECTS
)
"""Names that the options of a job can have: the keywords of a remesh that files can hold."""

Options = dict[str, Any]


def plain_options(options: Options, where: str) -> Options:
    """Return the options of a job in one form, without the ones that are as by default, after checking them.

    Parameters
    ----------
    options
        Values by the keywords of :func:`anisomesh.pipeline.remesh`. Lengths may be texts such as ``"0.1%"`` of the
        diagonal, and a ratio ``"20%"``; features, keep_points and density are names of text files.
    where
        The job, for messages.

    Raises
    ------
    OptionError
        If a name is unknown, a value is out of range, or not one option says how many vertices there are to be.
    """
    check_keys(where, options, OPTION_NAMES)
    try:
        read = {name: _read(name, value) for name, value in options.items() if value is not None}
        _check(read)
    except OptionError as error:
        raise OptionError(f"{where}: {error}") from error
    default = RemeshOptions()
    return {name: value for name, value in read.items() if name in TARGETS or value != getattr(default, name)}


def _check(options: Options) -> None:
    """Raise OptionError if options cannot be the ones of a remesh of any mesh."""
    keywords = {name: value for name, value in in_model_units(options, diagonal=1.0).items() if name not in TABLES}
    target = {name: keywords.pop(name, None) for name in TARGETS[:3]}
    known = with_overrides(RemeshOptions(), keywords)
    read_target(target["n_vertices"], target["ratio"], target["max_error"], known)
    if known.has_tensors:
        raise OptionError(f"metric = {known.metric!r}; expected the name of a metric")


def in_model_units(options: Options, diagonal: float) -> Options:
    """Return options whose lengths are numbers, for a mesh with this bounding-box diagonal in model units."""
    lengths = {name: options[name] for name in _LENGTHS if isinstance(options.get(name), str)}
    return options | {
        name: text if (name, text) == ("weld_tolerance", "auto") else Length.parse(text, name).on(diagonal)
        for name, text in lengths.items()
    }


def for_mesh(options: Options, diagonal: float) -> Options:
    """Return options as keywords of a remesh: lengths in model units, the numbers in the files of tables."""
    from anisomesh.io.text_tables import load_numbers, load_pairs, load_points

    readers: dict[str, Callable[[str], Any]] = {
        "features": load_pairs,
        "keep_points": load_points,
        "density": load_numbers,
    }
    tables = {name: readers[name](options[name]) for name in TABLES if name in options}
    return in_model_units(options, diagonal) | tables


def that_matter(options: Options) -> Options:
    """Return the options on which the result depends."""
    return {name: value for name, value in options.items() if name not in _WITHOUT_EFFECT}


def _read(name: str, value: Any) -> Any:
    """Return the value of an option if it is plain; a text that is a number as the number."""
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    items = value if isinstance(value, list | tuple) else [value]
    if not all(isinstance(item, str if name in TABLES else str | int | float) for item in items):
        expected = "the name of a text file" if name in TABLES else "a number, a text, true or false"
        raise OptionError(f"{name} is of type {type(value).__name__}; expected {expected}")
    if not isinstance(value, str) or name in TABLES:
        return value
    if name == "ratio" and value.endswith("%"):
        return float(Length.parse(value, name).value) / 100.0
    if name in _LENGTHS and value != "auto" and not value.endswith("%"):
        return Length.parse(value, name).value
    return value
