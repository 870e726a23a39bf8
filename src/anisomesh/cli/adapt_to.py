"""The option ``--adapt-to``: the field of a file to which a mesh is adapted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from anisomesh.attributes.model import Mesh
    from anisomesh.metric.solution import SolutionMetric

DEFAULT_NORM = "2"


@dataclass(frozen=True)
class AdaptTo:
    """A field at the vertices of a mesh file, None for the input, and the norm of the error to be small."""

    file: Path | None
    field: str
    norm: float

    @classmethod
    def parse(cls, text: str, norm: str) -> AdaptTo:
        """Return what is meant by ``FIELD`` or ``FILE:FIELD``, and a norm such as ``2`` or ``inf``.

        Raises
        ------
        typer.BadParameter
            If there is no field, or the norm is not a number of at least 1.
        """
        file, _, field = text.rpartition(":")
        if not field or (not file and Path(text).is_file()):
            raise typer.BadParameter(f"--adapt-to {text}: expected FIELD of IN, or FILE:FIELD")
        try:
            p = float(norm)
        except ValueError:
            p = 0.0
        if not p >= 1.0:
            raise typer.BadParameter(f"--norm {norm}: expected a number of at least 1, such as 2, or inf")
        return cls(Path(file) if file else None, field, p)

    def metric(self, mesh: Mesh, crease_angle: float) -> SolutionMetric:
        """Return the metric of the field, ``mesh`` being the input.

        Raises
        ------
        MeshFileError
            If the file cannot be read.
        MetricError
            If the mesh has no such field with one finite number at each vertex.
        """
        from anisomesh.errors import MetricError
        from anisomesh.io.meshes import load_mesh
        from anisomesh.metric.solution import SolutionMetric

        given = mesh if self.file is None else load_mesh(self.file)
        where = "the input" if self.file is None else str(self.file)
        if self.field not in given.point_data:
            names = ", ".join(sorted(given.point_data)) or "none"
            raise MetricError(f"{where} has no field {self.field!r} at its vertices; it has {names}")
        values = given.point_data[self.field]
        if values.ndim > 1 and values[0].size > 1:
            raise MetricError(
                f"{self.field!r} of {where} has {values[0].size} numbers at each vertex; expected a field of one, such "
                "as the length of a vector"
            )
        surface = None if self.file is None else given.surface
        return SolutionMetric(values.reshape(-1), surface=surface, norm=self.norm, crease_angle=crease_angle)
