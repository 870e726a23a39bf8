"""The options of ``anisomesh remesh`` for a metric from fields at points: sizes, tensors, a solution to adapt to."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from anisomesh.errors import OptionError

if TYPE_CHECKING:
    from anisomesh.metric.prescribed import AdaptTo, MetricFile

_HOW_SMALL = "--adapt-to says where triangles are small, not how small; give -n, --ratio or --ratios with it"


def check_targets(given: Mapping[str, object], metric_file: str | None, adapt_to: str | None) -> None:
    """Check that one option, by its name, says how many vertices there are to be, unless a metric does.

    Raises
    ------
    typer.BadParameter
        If none or several are given.
    """
    names = [name for name, value in given.items() if value is not None]
    if not names and adapt_to is not None and metric_file is None:
        raise typer.BadParameter(_HOW_SMALL)
    if len(names) > 1 or not (names or metric_file):
        are_given = f"{' and '.join(names)} are given; " if names else ""
        raise typer.BadParameter(
            f"{are_given}give one of -n (number of vertices), --ratio, --ratios, --max-error and --edge-length, or "
            "--metric-file"
        )


def prescribed_metric(
    context: typer.Context,
    metric_file: str | None,
    adapt_to: str | None,
    norm: str | None,
    *,
    edge_length: str | None,
    max_error: str | None,
) -> MetricFile | AdaptTo | None:
    """Return what ``--metric-file``, ``--adapt-to`` and ``--norm`` ask for, None without these options.

    Raises
    ------
    typer.BadParameter
        If two options say what the metric is, or one does not fit the others.
    MeshFileError
        If the file of a metric cannot be read, or has no such field.
    """
    from anisomesh.metric.prescribed import DEFAULT_NORM, AdaptTo, MetricFile

    if norm is not None and adapt_to is None:
        raise typer.BadParameter("--norm goes with --adapt-to; give both or leave it out")
    source = context.get_parameter_source("metric")
    is_named = source is not None and source.name == "COMMANDLINE"
    given = {"--metric": is_named, "--metric-file": metric_file is not None, "--adapt-to": adapt_to is not None}
    names = [name for name, is_given in given.items() if is_given]
    if len(names) > 1:
        raise typer.BadParameter(f"{' and '.join(names)} say what the metric is; give one of them")
    if metric_file is not None:
        if edge_length is not None and edge_length.endswith("%"):
            raise typer.BadParameter(
                f"--edge-length {edge_length}: in the metric of a file it is a number, and 1 without this option"
            )
        return MetricFile.read(metric_file)
    if adapt_to is None:
        return None
    if edge_length is not None or max_error is not None:
        raise typer.BadParameter(_HOW_SMALL)
    try:
        return AdaptTo.parse(adapt_to, norm or DEFAULT_NORM, context.params["feature_angle"])
    except OptionError as error:
        raise typer.BadParameter(f"--{error}") from None


def check_limits(prescribed: MetricFile | AdaptTo | None, options: list[str]) -> None:
    """Check that options that limit sizes have sizes to limit.

    Raises
    ------
    typer.BadParameter
        If there are such options and no sizes of a file.
    """
    if options and (prescribed is None or not prescribed.has_sizes):
        names = " and ".join(options)
        raise typer.BadParameter(f"{names}: only sizes can be limited; give a --metric-file with lengths of edges")


def file_named(metric_file: str | None, adapt_to: str | None) -> Path | None:
    """Return the file that ``--metric-file`` or ``--adapt-to`` names, None for none."""
    from anisomesh.io.fields.load import split_spec

    if metric_file is not None:
        return split_spec(metric_file)[0]
    path, field = (None, None) if adapt_to is None else split_spec(adapt_to)
    return None if field is None else path


def file_of(prescribed: MetricFile | AdaptTo | None) -> Path | None:
    """Return the file that a metric is read from, None for none."""
    return None if prescribed is None else prescribed.file
