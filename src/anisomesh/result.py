"""What a remesh returns."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import Any

from anisomesh._arrays import CornerTensors, PointTensors, Sites
from anisomesh.attributes.model import Mesh
from anisomesh.cvt.lbfgs import Status
from anisomesh.embedding.base import Embedding
from anisomesh.io.describe import soundness
from anisomesh.io.fields.save import save_tensors
from anisomesh.io.rvd import PolygonMesh, save_polygons
from anisomesh.mesh.geometry import Frame
from anisomesh.mesh.html import html_table
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.validity import Validity
from anisomesh.metric.conformity import Conformity
from anisomesh.metric.unit_edges import UnitMetric, tangent_sizes
from anisomesh.repair.prepare import PrepareReport
from anisomesh.voronoi.cells import CellComplex
from anisomesh.voronoi.diagram import Diagram
from anisomesh.voronoi.polygons import cell_polygons


@dataclass(frozen=True, kw_only=True, eq=False)
class RemeshResult:
    """A remeshed surface and what it was made from.

    Attributes
    ----------
    surface
        The result, in model units.
    mesh
        The same with everything that the input carries, see :func:`~anisomesh.io.transfer.transfer_attributes`.
    prepared
        The input after repair, in model units.
    prepare_report
        What the repair did, as counts.
    working
        The surface that was embedded: the prepared input at bounding-box diagonal 1, without locked faces, slivers and
        long edges triangulated anew, noise removed. Its triangles may differ from the triangles of ``prepared``.
    metric
        The metric in model units, in which edges have the length 1; see :attr:`unit_tensors`.
    tensors
        The metric at the points of ``working`` (V, 3, 3), at bounding-box diagonal 1; only ratios of lengths matter.
    corner_tensors
        The metric at the corners of the faces of ``working`` (F, 3, 3, 3) where it jumps across creases, else None.
    embedding_name
        ``"direct"``, ``"filtered"``, ``"neural"`` or ``"hybrid"``, or the name of a metric source of the user.
    noise
        Root mean square height of the noise that was removed from the input, in mean edge lengths of ``working``.
    frame
        The similarity between model units and ``working``.
    embedding
        The embedding of ``working``.
    cells
        The cell components of the restricted Voronoi diagram, to which the mesh before the fit is dual.
    vertices_asked
        The vertex count asked for.
    energy, iterations, status
        Final energy of the optimisation at bounding-box diagonal 1, its iterations, and why it stopped.
    inserted, removed
        Points added to make the mesh valid, and points removed to reach the number of vertices asked for.
    seed
        Seed of the start positions: the next ones are tried if the mesh of the requested seed has faults.
    validity
        Checks of the result against the prepared input.
    distance
        Largest distance between result and input, both ways, in model units; None unless ``max_error`` was given.
    feature_distance
        Largest distance from the edges in ``features``, and the borders of regions and seams that are followed, to
        edges of the result that follow them, in model units; 0 without such edges, infinite if they are lost.
    conformity
        How well the edges have the lengths asked for; None unless ``edge_length``, ``size_field`` or a metric of the
        user prescribes them.
    seconds
        Wall-clock seconds per stage.
    warnings
        What a user should know, one sentence each.
    """

    surface: Surface
    mesh: Mesh
    prepared: Surface
    prepare_report: PrepareReport
    working: Surface
    metric: UnitMetric
    tensors: PointTensors
    corner_tensors: CornerTensors | None
    embedding_name: str
    noise: float
    frame: Frame
    embedding: Embedding
    cells: CellComplex
    vertices_asked: int
    energy: float
    iterations: int
    status: Status
    inserted: int
    removed: int
    seed: int
    validity: Validity
    seconds: dict[str, float]
    warnings: tuple[str, ...]
    distance: float | None = None
    feature_distance: float = 0.0
    conformity: Conformity | None = None

    def __repr__(self) -> str:
        return (
            f"RemeshResult({self.surface.n_points:,} vertices, {self.surface.n_faces:,} triangles, "
            f"{soundness(self.validity)}, {self.seconds['total']:.1f} s)"
        )

    def _repr_html_(self) -> str:
        rows = [
            ("vertices", f"{self.surface.n_points:,} (asked for {self.vertices_asked:,})"),
            ("triangles", f"{self.surface.n_faces:,}"),
            ("validity", soundness(self.validity)),
            ("time", f"{self.seconds['total']:.1f} s"),
            *(("warning", text) for text in self.warnings),
        ]
        return html_table("RemeshResult", rows)

    @property
    def diagram(self) -> Diagram:
        """The restricted Voronoi diagram, to which the mesh before the fit is dual."""
        return self.cells.diagram

    @property
    def sites(self) -> Sites:
        """The sites of the diagram in the embedding (S, d), sites added for the topology last."""
        return self.cells.diagram.sites

    @cached_property
    def unit_tensors(self) -> PointTensors:
        """The metric at the points of ``surface`` (V, 3, 3), in model units: the edges asked for have the length 1.

        If a number of vertices was asked for, it is the one that such edges take.
        """
        return self.metric.at_points_of(self.surface)

    @property
    def residual(self) -> float:
        """Relative residual of the embedding against the metric; 0 when exact."""
        return self.embedding.residual

    def report(self) -> dict[str, Any]:
        """Return the figures of the run as a dictionary that JSON can hold."""
        of_faces, embedded = self.surface.face_stretch, self.embedding.stretch
        return {
            "vertices_asked": self.vertices_asked,
            "vertices": self.surface.n_points,
            "faces": self.surface.n_faces,
            "seconds": dict(self.seconds),
            "distance": self.distance,
            "feature_distance": self.feature_distance if isfinite(self.feature_distance) else None,
            "conformity": None if self.conformity is None else self.conformity.as_dict(),
            "embedding": self.embedding_name,
            "noise": self.noise,
            "energy": self.energy,
            "iterations": self.iterations,
            "status": self.status.value,
            "inserted": self.inserted,
            "removed": self.removed,
            "seed": self.seed,
            "stretch": {"mean": float(of_faces.mean()), "max": float(of_faces.max())},
            "stretch_of_embedding": {"mean": embedded.achieved_mean, "max": embedded.achieved_max},
            "validity": self.validity.as_dict(),
            "warnings": list(self.warnings),
        }

    def polygons(self) -> PolygonMesh:
        """Return the restricted Voronoi diagram as polygons in model units."""
        return cell_polygons(self.cells, self.frame.to_model(self.working.points))


def save_rvd(result: RemeshResult, path: str | os.PathLike[str]) -> None:
    """Write the restricted Voronoi diagram of a result as polygons, .vtu or .obj, coloured by cell.

    Raises
    ------
    MeshFileError
        If the suffix is another one, or the file cannot be written.
    """
    save_polygons(result.polygons(), path)


def save_metric(result: RemeshResult, path: str | os.PathLike[str]) -> None:
    """Write the metric at the points of a result in model units, in which the edges asked for have the length 1.

    Parameters
    ----------
    result
        The result.
    path
        A .sol or .solb file for Mmg and MEDIT, whose rows belong to the vertices of the result, or a .npy file with an
        array (V, 3, 3); or a .vtu, .vtp, .ply or .msh file with the result, its tensors ``metric`` (9 components, row
        by row) and ``sizes`` (V, 2), the smallest and largest length of edges along the surface.

    Raises
    ------
    MeshFileError
        If the suffix is another one, or the file cannot be written.
    """
    surface, tensors = result.surface, result.unit_tensors
    save_tensors(surface, tensors, path, {"sizes": tangent_sizes(surface, tensors)})
