"""The options of a job: plain values, and files that belong to its mesh."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from anisomesh._values import Length
from anisomesh.counts.target import read_levels, read_target
from anisomesh.errors import OptionError
from anisomesh.options import RemeshOptions, with_overrides
from anisomesh.toml import check_keys

if TYPE_CHECKING:
    from anisomesh.metric.prescribed import AdaptTo, MetricFile

TARGETS = ("n_vertices", "ratio", "max_error", "ratios", "edge_length")
"""Options that say how many vertices a result has; a job has one of them, ``ratios`` for levels of detail."""
TABLES = ("features", "keep_points", "density")
"""Options whose value is the name of a text file with numbers for a mesh."""
METRICS = ("metric", "metric_file", "adapt_to")
"""Options that say what the metric is; a job has one of them at most."""
FIELDS = METRICS[1:]
"""Options whose value is a field at points: ``FILE``, ``FILE:NAME``, or for ``adapt_to`` also the name of one of the
input."""
_LIMITS = ("min_size", "max_size", "gradation")  # of the sizes in a metric_file
_LENGTHS = ("max_error", "edge_length", "weld_tolerance", "min_size", "max_size")
_WHOLE = ("n_vertices", *(field.name for field in fields(RemeshOptions) if field.type in ("int", "int | None")))
_OBJECTS = ("energy", "size_field")  # without a form in a file of jobs
_WITHOUT_EFFECT = ("threads",)  # on the result
OPTION_NAMES = tuple(
    name
    for name in (*TARGETS[:4], *FIELDS, "norm", *(field.name for field in fields(RemeshOptions)))
    if name not in _OBJECTS
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
        The job, for messages; empty for options of many.

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
        raise OptionError(f"{where}: {error}" if where else str(error)) from error
    default = RemeshOptions()
    return {name: value for name, value in read.items() if name in TARGETS or value != getattr(default, name, None)}


def _check(options: Options) -> None:
    """Raise OptionError if options cannot be the ones of a remesh of any mesh."""
    _check_metric(options)
    apart = (*TABLES, *FIELDS, "norm", *_LIMITS)
    keywords = {name: value for name, value in in_model_units(options, diagonal=1.0).items() if name not in apart}
    target = {name: keywords.pop(name) for name in TARGETS[:4] if name in keywords}
    known = with_overrides(RemeshOptions(), keywords)
    if len(target) > 1:
        raise OptionError(f"{' and '.join(target)} are given; give one of {', '.join(TARGETS)}")
    if "ratios" in target:
        read_levels(None, target["ratios"], known)
    elif target or "metric_file" not in options:
        read_target(target.get("n_vertices"), target.get("ratio"), target.get("max_error"), known)
    if known.has_tensors:
        raise OptionError(f"metric = {known.metric!r}; expected the name of a metric")


def _check_metric(options: Options) -> None:
    """Raise OptionError if options that say what the metric is do not fit each other."""
    named = [name for name in METRICS if name in options]
    if len(named) > 1:
        raise OptionError(f"{' and '.join(named)} say what the metric is; give one of them")
    if "norm" in options and "adapt_to" not in options:
        raise OptionError("norm goes with adapt_to; give both or leave it out")
    limits = {name: value for name, value in in_model_units(options, diagonal=1.0).items() if name in _LIMITS}
    if limits and "metric_file" not in options:
        raise OptionError(
            f"{' and '.join(limits)}: only sizes can be limited; give a metric_file with lengths of edges"
        )
    if limits:
        with_overrides(RemeshOptions(), {"metric": "uniform", "size_field": [1.0], **limits})
    if "metric_file" in options and str(options.get("edge_length", "")).endswith("%"):
        raise OptionError(
            f"edge_length = {options['edge_length']}: in the metric of a file it is a number, and 1 without this option"
        )
    counted = [name for name in ("n_vertices", "ratio", "ratios") if name in options]
    if "adapt_to" in options and not (counted and "edge_length" not in options and "max_error" not in options):
        raise OptionError(
            "adapt_to says where triangles are small, not how small; give n_vertices, ratio or ratios with it"
        )


def file_and_field(name: str, spec: str) -> tuple[str | None, str]:
    """Return the file and the rest of the value of an option of :data:`FIELDS`, such as ``a.vtu`` and ``:size``.

    The file is None for the name of a field of the input.
    """
    from anisomesh.io.fields.load import split_spec

    field = split_spec(spec)[1]
    if field is None:
        return (spec, "") if name == "metric_file" else (None, spec)
    return spec[: -len(field) - 1], f":{field}"


def prescribed_by(options: Options) -> MetricFile | AdaptTo | None:
    """Return the metric that a field prescribes, None if none does.

    Raises
    ------
    MeshFileError
        If the file of a metric cannot be read, or has no such field.
    OptionError
        If the norm is not a number of at least 1.
    """
    from anisomesh.metric.prescribed import DEFAULT_NORM, AdaptTo, MetricFile

    if "metric_file" in options:
        return MetricFile.read(options["metric_file"])
    if "adapt_to" in options:
        angle = options.get("feature_angle", RemeshOptions.feature_angle)
        return AdaptTo.parse(options["adapt_to"], str(options.get("norm", DEFAULT_NORM)), angle)
    return None


def in_model_units(options: Options, diagonal: float) -> Options:
    """Return options whose lengths are numbers, for a mesh with this bounding-box diagonal in model units."""
    lengths = {name: options[name] for name in _LENGTHS if isinstance(options.get(name), str)}
    return options | {
        name: text if (name, text) == ("weld_tolerance", "auto") else _length(name, text).on(diagonal)
        for name, text in lengths.items()
    }


def for_mesh(options: Options, diagonal: float) -> Options:
    """Return options as keywords of a remesh: lengths in model units, the numbers in the files of tables.

    Fields that prescribe a metric are left out, see :func:`prescribed_by`.
    """
    from anisomesh.io.text_tables import load_numbers, load_pairs, load_points

    readers: dict[str, Callable[[str], Any]] = {
        "features": load_pairs,
        "keep_points": load_points,
        "density": load_numbers,
    }
    tables = {name: readers[name](options[name]) for name in TABLES if name in options}
    plain = {name: value for name, value in options.items() if name not in (*FIELDS, "norm")}
    return in_model_units(plain, diagonal) | tables


def that_matter(options: Options) -> Options:
    """Return the options on which the result depends."""
    return {name: value for name, value in options.items() if name not in _WITHOUT_EFFECT}


def _read(name: str, value: Any) -> Any:
    """Return the value of an option if it is plain; a text that is a number as the number."""
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    items = value if isinstance(value, list | tuple) else [value]
    is_name = name in (*TABLES, *FIELDS)
    if not (isinstance(value, str) if is_name else all(isinstance(item, str | int | float) for item in items)):
        kind = "text file" if name in TABLES else "file or field"
        expected = f"the name of a {kind}" if is_name else "a number, a text, true or false"
        raise OptionError(f"{name} is of type {type(value).__name__}; expected {expected}")
    if name == "ratios":
        words = value.replace(",", " ").split() if isinstance(value, str) else items
        return [_share(name, word) for word in words]
    if name in (*_WHOLE, "lock"):  # a label of a region is whole too
        return [_as_whole(item) for item in value] if isinstance(value, list | tuple) else _as_whole(value)
    if not isinstance(value, str) or is_name:
        return value
    if name == "ratio":
        return _share(name, value)
    if name in _LENGTHS and value != "auto" and not value.endswith("%"):
        return _length(name, value).value
    return value


def _length(name: str, text: str) -> Length:
    return Length.tolerance(text, name) if name == "weld_tolerance" else Length.parse(text, name)


def _as_whole(value: Any) -> Any:
    """Return a number such as 60.0, as programs write whole numbers of a column with gaps, as an int."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _share(name: str, value: Any) -> Any:
    """Return a share, such as 0.2 or ``"20%"``, as a number."""
    if not isinstance(value, str):
        return value
    try:
        number = float(value.removesuffix("%"))
    except ValueError:
        raise OptionError(f"{name} {value}: expected a share such as 0.2, or 20%") from None
    return number / 100.0 if value.endswith("%") else number
