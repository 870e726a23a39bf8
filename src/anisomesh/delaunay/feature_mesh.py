"""A mesh with edges along creases, and what is left of them when it changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeEnds, Faces, PointMask, Points
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys, half_edges


@dataclass(frozen=True, eq=False)
class FeatureMesh:
    """A mesh with edges along creases.

    Attributes
    ----------
    points, faces
        The mesh in space (V, 3), (F, 3).
    crease_edges
        Ends of its edges along creases (n, 2).
    locked
        Points that collapses keep (V,).
    """

    points: Points
    faces: Faces
    crease_edges: EdgeEnds
    locked: PointMask

    @classmethod
    def of(cls, surface: Surface) -> FeatureMesh:
        """Return a surface without creases or locked points."""
        none = np.zeros((0, 2), dtype=np.int64)
        return cls(surface.points, surface.faces, none, np.zeros(surface.n_points, dtype=bool))


def renumbered(before: Points, after: Points) -> npt.NDArray[np.int64]:
    """Return the number that each point (V,) has afterwards, -1 if there is none at its place."""
    places = {point.tobytes(): number for number, point in enumerate(after)}
    return np.array([places.get(point.tobytes(), -1) for point in before], dtype=np.int64)


def edges_left(faces: Faces, ends: EdgeEnds) -> EdgeEnds:
    """Return which pairs of points (n, 2) are edges of the faces; the points may be -1."""
    ends = ends[(ends >= 0).all(axis=1)]
    return ends[np.isin(edge_keys(ends), edge_keys(half_edges(faces)))]
