"""What a remesh returns."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

from anisomesh.cvt.optimise import Status
from anisomesh.embedding.base import Embedding
from anisomesh.io.rvd import PolygonMesh, save_polygons
from anisomesh.mesh.geometry import Frame
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import Validity
from anisomesh.repair.prepare import PrepareReport
from anisomesh.voronoi.cells import Cells
from anisomesh.voronoi.diagram import Diagram
from anisomesh.voronoi.polygons import polygon_mesh


@dataclass(frozen=True, kw_only=True, eq=False)
class RemeshResult:
    """A remeshed surface and what it was made from.

    Attributes
    ----------
    surface
        The result, in model units.
    prepared
        The input after repair, in model units.
    prepare_report
        What the repair did, as counts.
    working
        The prepared input with long edges split, at bounding-box diagonal 1: what was embedded.
    embedded
        ``"direct"``, ``"neural"`` or ``"hybrid"``: where the metric comes from.
    noise
        Noise that a network has found in the input and taken away before anything else: root mean square height over
        ``working``, in mean edge lengths; 0 where none was taken away.
    frame
        The similarity between model units and ``working``.
    embedding
        The embedding of ``working``.
    diagram
        The restricted Voronoi diagram whose dual the result is.
    cells
        Its cell components.
    vertices_asked
        The vertex count asked for.
    energy, iterations, status
        Of the optimisation: final energy at diagonal 1, iterations, why it stopped.
    inserted, removed
        Points that were added to make the mesh valid, and points taken away to keep to the number asked for.
    validity
        Checks of the result against the prepared input.
    distance
        The largest distance from the input found, both ways, in model units; None unless a largest one was asked for.
    seconds
        Wall-clock seconds per stage.
    warnings
        What a user should know, one sentence each.
    """

    surface: Surface
    prepared: Surface
    prepare_report: PrepareReport
    working: Surface
    embedded: str
    noise: float
    frame: Frame
    embedding: Embedding
    diagram: Diagram
    cells: Cells
    vertices_asked: int
    energy: float
    iterations: int
    status: Status
    inserted: int
    removed: int
    validity: Validity
    seconds: dict[str, float]
    warnings: tuple[str, ...]
    distance: float | None = None

    def report(self) -> dict[str, Any]:
        """Return the figures of the run as a dictionary that JSON can hold."""
        return {
            "vertices_asked": self.vertices_asked,
            "vertices": self.surface.n_points,
            "faces": self.surface.n_faces,
            "seconds": dict(self.seconds),
            "distance": self.distance,
            "embedding": self.embedded,
            "noise": self.noise,
            "energy": self.energy,
            "iterations": self.iterations,
            "status": self.status.value,
            "inserted": self.inserted,
            "removed": self.removed,
            "stretch": {"mean": self.embedding.stretch.achieved_mean, "max": self.embedding.stretch.achieved_max},
            "validity": self.validity.as_dict(),
            "warnings": list(self.warnings),
        }

    def polygons(self) -> PolygonMesh:
        """Return the restricted Voronoi diagram as polygons in model units."""
        return polygon_mesh(self.diagram, self.cells.of_polygon, self.frame.to_model(self.working.points))


def save_rvd(result: RemeshResult, path: str | os.PathLike[str]) -> None:
    """Write the restricted Voronoi diagram of a result as polygons, .vtu or .obj, coloured by cell.

    Raises
    ------
    MeshFileError
        If the suffix is another one, or the file cannot be written.
    """
    save_polygons(result.polygons(), path)
