"""Better triangles for a surface with slivers: Delaunay flips within a tolerance, and splits of longest edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._kernels import refinement as kernels
from anisomesh.errors import OptionError
from anisomesh.mesh.geometry import thickness
from anisomesh.mesh.surface import Surface
from anisomesh.working.marked_surface import MarkedSurface

_SHRINK = 0.5**0.5  # of the lengths of the sides split, from pass to pass: long ones first, so that sizes are graded


@dataclass(frozen=True, kw_only=True, eq=False)
class Refinement:
    """A refined surface and how its points were made.

    Attributes
    ----------
    marked
        The surface; parts of an edge have its label, new edges 0. Its first V points are the parent's, unchanged.
    parents
        For every point (V', 2) the two earlier points of which it is the middle; for the first V the point itself.
    """

    marked: MarkedSurface
    parents: npt.NDArray[np.int32]

    @property
    def surface(self) -> Surface:
        """The surface itself."""
        return self.marked.surface

    def interpolate(self, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Interpolate values (V, ...) at the points of the parent to all (V', ...), halfway along each split edge."""
        n = len(values)
        result = np.zeros((len(self.parents), *np.shape(values)[1:]))
        result[:n] = values
        known = np.arange(len(result)) < n
        while not known.all():
            ready = ~known & known[self.parents].all(axis=1)
            result[ready] = 0.5 * result[self.parents[ready]].sum(axis=1)
            known |= ready
        return result


def refine_slivers(
    start: MarkedSurface,
    *,
    max_aspect: float,
    min_length: float,
    tolerance: float,
    max_faces: int,
) -> Refinement:
    """Refine the parts of a surface that have slivers; the others stay as they are.

    Parameters
    ----------
    start
        An oriented manifold surface. Marked edges are split but not flipped.
    max_aspect
        Longest side of a triangle over the height on it, above which it is refined; above 1.2.
    min_length
        Triangles with no longer side are not refined, in model units.
    tolerance
        Bound on the deviation of faces, including their present one, in model units; 0 flips edges in planes only,
        and hardly any, as planes are not exact in floating point.
    max_faces
        Bound on the number of faces; where it is reached, shorter sides are not split.

    Returns
    -------
    Refinement
        With the surface itself if none of its triangles is one.

    Raises
    ------
    OptionError
        If ``max_faces`` is less than the number of faces.

    Notes
    -----
    First the edges of slivers and of their neighbours are flipped to Delaunay edges where the surface moves by
    no more than the tolerance; then the longest side of a sliver, or a longer one nearby, is split at its middle
    until it is none or small, keeping edges Delaunay. New points lie on edges, so in planes the surface does
    not change, and elsewhere each flip moves it by at most the distance of the two diagonals, of which a sum is kept
    for every face.

    References
    ----------
    Rivara, "New longest-edge algorithms for the refinement and/or improvement of unstructured triangulations", 1997.
    Lawson, "Software for C1 surface interpolation", 1977.
    """
    surface = start.surface
    if max_faces < surface.n_faces:
        raise OptionError(f"max_faces is {max_faces:,}; expected at least the surface's {surface.n_faces:,} faces")
    min_thickness = 0.5 / max_aspect
    bad = np.flatnonzero(thickness(surface.points[surface.faces]) < min_thickness)
    own = np.repeat(np.arange(surface.n_points, dtype=np.int32)[:, None], 2, axis=1)
    if len(bad) == 0:
        return Refinement(marked=start, parents=own)
    mesh = start.triangulation(max_faces)
    mesh.stack[: len(bad)] = bad
    kernels.flip_to_delaunay(mesh, len(bad), tolerance)
    n_points, n_faces = surface.n_points, surface.n_faces
    length = float(surface.edge_lengths.max())
    while length > min_length:
        length = max(_SHRINK * length, min_length)
        n_points, n_faces = kernels.refine(mesh, n_points, n_faces, min_thickness, length**2, tolerance)
    refined = Surface(mesh.points[:n_points].copy(), mesh.faces[:n_faces].copy())
    mesh.parents[: surface.n_points] = own
    kept = np.arange(max_faces) < n_faces
    return Refinement(marked=MarkedSurface.of(refined, mesh, kept), parents=mesh.parents[:n_points].copy())
