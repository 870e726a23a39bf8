"""The metric of ``anisomesh remesh`` from fields at points: sizes or tensors of a file, or a solution to adapt to."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from anisomesh.errors import MeshFileError, MetricError, OptionError

if TYPE_CHECKING:
    from anisomesh.attributes.model import Mesh
    from anisomesh.io.fields.load import PointField

_DEFAULT_NORM = "2"
_NEAR = 1e-4  # of the diagonal, for points of two files of one mesh: more than single precision loses


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
        raise typer.BadParameter("--adapt-to says where triangles are small, not how small; give -n or --ratio with it")
    return AdaptTo.parse(adapt_to, norm or _DEFAULT_NORM, context.params["feature_angle"])


def check_limits(prescribed: MetricFile | AdaptTo | None, options: list[str]) -> None:
    """Check that options that limit sizes have sizes to limit.

    Raises
    ------
    typer.BadParameter
        If there are such options and no sizes of a file.
    """
    if options and not (isinstance(prescribed, MetricFile) and prescribed.field.kind == "scalar"):
        names = " and ".join(options)
        raise typer.BadParameter(f"{names}: only sizes can be limited; give a --metric-file with lengths of edges")


def file_of(prescribed: MetricFile | AdaptTo | None) -> Path | None:
    """Return the file that a metric is read from, None for none."""
    return None if prescribed is None else prescribed.file


@dataclass(frozen=True, eq=False)
class MetricFile:
    """Lengths of edges (V,) or tensors (V, 3, 3) of a file, in model units, and the option that names it."""

    field: PointField
    spec: str

    @classmethod
    def read(cls, spec: str) -> MetricFile:
        """Return the field in ``FILE`` or ``FILE:NAME``; errors as of :func:`~anisomesh.io.fields.load.load_field`."""
        from anisomesh.io.fields.load import load_field

        return cls(load_field(spec), spec)

    @property
    def file(self) -> Path:
        """The file."""
        return self.field.path

    @property
    def description(self) -> str:
        """What was read, in a line."""
        field = self.field
        what = "sizes" if field.kind == "scalar" else f"tensors, read as {field.layout}"
        return f"metric of {field.path}, field {field.name!r}: {what}, at {len(field.values):,} points"

    @property
    def facts(self) -> dict[str, Any]:
        """What the report says in place of the values."""
        return {"metric": None, "size_field": None, "metric_file": self.spec}

    def options_for(self, mesh: Mesh, name: str) -> dict[str, Any]:
        """Return the options of a remesh that prescribe the field at the points of an input.

        Parameters
        ----------
        mesh
            The input as it was read.
        name
            Its name, for messages.

        Raises
        ------
        MeshFileError
            If the field belongs to other points.
        """
        field, surface = self.field, mesh.surface
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

    @contextmanager
    def named_in_errors(self) -> Iterator[None]:
        """Put the file before messages about values of the options that it gives."""
        try:
            yield
        except (MetricError, OptionError) as error:
            if not str(error).startswith(("metric", "size_field")):
                raise
            row = re.sub(r"^(metric|size_field)\[(\d+)\]", r"row \2", str(error))
            raise type(error)(f"{self.field.path}, field {self.field.name!r}: {row}") from error


@dataclass(frozen=True)
class AdaptTo:
    """A field at the points of a mesh file, None for the input, and the option that names it.

    The error is to be small in the L^p norm, p being ``norm``. Edges that bend by more degrees than ``crease_angle``
    are not looked across.
    """

    file: Path | None
    field: str
    norm: float
    crease_angle: float
    spec: str

    @classmethod
    def parse(cls, spec: str, norm: str, crease_angle: float) -> AdaptTo:
        """Return what is meant by ``FIELD`` or ``FILE:FIELD``, and a norm such as ``2`` or ``inf``.

        Raises
        ------
        typer.BadParameter
            If a file has no field behind it, or the norm is not a number of at least 1.
        """
        from anisomesh.io.fields.load import split_spec

        path, field = split_spec(spec)
        if field is None and path.is_file():
            raise typer.BadParameter(f"--adapt-to {spec}: expected FIELD of IN, or FILE:FIELD")
        try:
            p = float(norm)
        except ValueError:
            p = 0.0
        if not p >= 1.0:
            raise typer.BadParameter(f"--norm {norm}: expected a number of at least 1, such as 2, or inf")
        return cls(None if field is None else path, spec if field is None else field, p, crease_angle, spec)

    @property
    def description(self) -> str:
        """What the mesh is adapted to, in a line."""
        return f"metric of the field {self.field!r} of {self.file or 'the input'}, for the L^{self.norm:g} norm"

    @property
    def facts(self) -> dict[str, Any]:
        """What the report says in place of the values."""
        return {"metric": None, "adapt_to": self.spec, "norm": f"{self.norm:g}"}

    def options_for(self, mesh: Mesh, name: str) -> dict[str, Any]:
        """Return the options of a remesh that adapt an input to the field.

        Parameters
        ----------
        mesh
            The input as it was read.
        name
            Its name, for messages.

        Raises
        ------
        MeshFileError
            If the file cannot be read, or the mesh has no such field with one number at each point.
        """
        from anisomesh.io.meshes import load_mesh
        from anisomesh.metric.solution import SolutionMetric

        given, where = (mesh, name) if self.file is None else (load_mesh(self.file), str(self.file))
        if self.field not in given.point_data:
            names = ", ".join(sorted(given.point_data)) or "none"
            raise MeshFileError(f"{where} has no field {self.field!r} at its points; it has {names}")
        values = given.point_data[self.field]
        if values.ndim > 1 and values[0].size > 1:
            raise MeshFileError(
                f"{self.field!r} of {where} has {values[0].size} numbers at each point; expected a field of one, such "
                "as the length of a vector"
            )
        surface = None if self.file is None else given.surface
        return {
            "metric": SolutionMetric(
                values.reshape(-1), surface=surface, norm=self.norm, crease_angle=self.crease_angle
            )
        }
