"""The metric of ``anisomesh remesh`` from a file: sizes or tensors at the points of the input."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from anisomesh.errors import MeshFileError

if TYPE_CHECKING:
    from anisomesh.io.fields.load import PointField
    from anisomesh.mesh.surface import Surface

_NEAR = 1e-4  # of the diagonal, for points of two files of one mesh: more than single precision loses


def check_beside_metric_file(context: typer.Context, edge_length: str | None) -> None:
    """Check that no option beside ``--metric-file`` says something else.

    Raises
    ------
    typer.BadParameter
        If a metric is named too, or the edge length is in per cent.
    """
    source = context.get_parameter_source("metric")
    if source is not None and source.name == "COMMANDLINE":
        raise typer.BadParameter("--metric and --metric-file both say what the metric is; leave one out")
    if edge_length is not None and edge_length.endswith("%"):
        raise typer.BadParameter(
            f"--edge-length {edge_length}: in the metric of a file it is a number, and 1 without this option"
        )


def path_of(spec: str | None) -> Path | None:
    """Return the file in ``FILE`` or ``FILE:NAME``, None for none."""
    from anisomesh.io.fields.load import split_spec

    return None if spec is None else split_spec(spec)[0]


@dataclass(frozen=True, eq=False)
class MetricFile:
    """Lengths of edges (V,) or tensors (V, 3, 3) of a file, in model units."""

    field: PointField

    @classmethod
    def read(cls, spec: str) -> MetricFile:
        """Return the field in ``FILE`` or ``FILE:NAME``; errors as of :func:`~anisomesh.io.fields.load.load_field`."""
        from anisomesh.io.fields.load import load_field

        return cls(load_field(spec))

    @property
    def description(self) -> str:
        """What was read, in a line."""
        field = self.field
        what = "sizes" if field.kind == "scalar" else f"tensors, read as {field.layout}"
        return f"metric of {field.path}, field {field.name!r}: {what}, at {len(field.values):,} points"

    def options_for(self, surface: Surface, name: str) -> dict[str, Any]:
        """Return the options of a remesh that prescribe the field at the points of an input.

        Parameters
        ----------
        surface
            The input as it was read.
        name
            Its name, for messages.

        Raises
        ------
        MeshFileError
            If the field belongs to other points.
        """
        field = self.field
        where = f"{field.path}: the field {field.name!r}"
        if len(field.values) != surface.n_points:
            raise MeshFileError(
                f"{where} has {len(field.values):,} values, and {name} has {surface.n_points:,} points; expected one "
                "for each point of the file, in its order"
            )
        if field.points is not None:
            far = abs(field.points - surface.points).max(axis=1) > _NEAR * surface.diagonal
            if far.any():
                raise MeshFileError(
                    f"{where} is at other points than {name} has, or in another order: point {far.argmax()} (counted "
                    "from 0) is the first that differs"
                )
        if field.kind == "scalar":
            return {"metric": "uniform", "size_field": field.values}
        return {"metric": field.values}
