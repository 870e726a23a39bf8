"""Metrics from fields at the points of files: sizes, tensors, and solutions to adapt to, by the names of the files."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from anisomesh.attributes.model import Mesh
from anisomesh.errors import MeshFileError, MetricError, OptionError
from anisomesh.io.fields.load import PointField, load_field, split_spec
from anisomesh.io.meshes import load_mesh
from anisomesh.metric.solution import SolutionMetric

DEFAULT_NORM = "2"
"""Norm in which the error of a solution is to be small, if none is named."""

_NEAR = 1e-4  # of the diagonal, for points of two files of one mesh: more than single precision loses


@dataclass(frozen=True, eq=False)
class MetricFile:
    """Lengths of edges (V,) or tensors (V, 3, 3) of a file, in model units, and the option that names it."""

    field: PointField
    spec: str

    @classmethod
    def read(cls, spec: str) -> MetricFile:
        """Return the field in ``FILE`` or ``FILE:NAME``; errors as of :func:`~anisomesh.io.fields.load.load_field`."""
        return cls(load_field(spec), spec)

    @property
    def file(self) -> Path:
        """The file."""
        return self.field.path

    @property
    def has_sizes(self) -> bool:
        """Whether the field is lengths of edges."""
        return self.field.kind == "scalar"

    @property
    def description(self) -> str:
        """What was read, in a line."""
        field = self.field
        way = field.layout if field.layout == "row by row" else f"as {field.layout}"
        what = "sizes" if field.kind == "scalar" else f"tensors, read {way}"
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
        OptionError
            If a file has no field behind it, or the norm is not a number of at least 1.
        """
        path, field = split_spec(spec)
        if field is None and path.is_file():
            raise OptionError(f"adapt-to {spec}: expected FIELD of IN, or FILE:FIELD")
        try:
            p = float(norm)
        except ValueError:
            p = 0.0
        if not p >= 1.0:
            raise OptionError(f"norm {norm}: expected a number of at least 1, such as 2, or inf")
        return cls(None if field is None else path, spec if field is None else field, p, crease_angle, spec)

    @property
    def has_sizes(self) -> bool:
        """Whether the field is lengths of edges; it never is."""
        return False

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

    @contextmanager
    def named_in_errors(self) -> Iterator[None]:
        """Leave messages as they are: a metric that is computed is in order."""
        yield
