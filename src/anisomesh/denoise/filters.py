"""Filters that move the points of a surface: Taubin smoothing and bilateral filtering of normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array, diags_array, eye_array

from anisomesh._arrays import FaceVectors, Points
from anisomesh.mesh.geometry import unit
from anisomesh.mesh.surface import Surface

_SHRINK, _GROW = 0.5, -0.53  # shares of the way to the mean of the neighbours: a pass band of about .1
_MAX_FACES_AT_POINT = 64  # points with more, as in the middle of a fan, make no neighbours: all pairs would be too many
POINT_STEPS = 10
"""Steps in which points follow filtered normals; heuristic."""

_CENTRE_WIDTH = 0.9  # deviation of the weights by distance, in roots of the mean area of faces: about their distance


def taubin_smoothed(surface: Surface, steps: int) -> Surface:
    """Return a surface smoothed by steps that shrink and grow it in turn; its boundary stays.

    References
    ----------
    Taubin, "A signal processing approach to fair surface design", 1995.
    """
    averages, free = neighbour_averages(surface), ~surface.on_boundary[:, None]
    points = surface.points
    for _ in range(steps):
        for share in (_SHRINK, _GROW):
            points = points + share * free * (averages @ points - points)
    return surface.with_points(points)


@dataclass(frozen=True, eq=False)
class FaceNeighbours:
    """Faces around each face, and what the weights of a filter of normals start from.

    Attributes
    ----------
    at_points
        Matrix (V, F) that is 1 where a face is at a point.
    first, neighbour
        Neighbours of each face in compressed rows (F + 1,), (E,): the faces that share a point with it, and itself.
        Points of very many faces count only for their own faces.
    weight
        Area of each neighbour (E,) times a Gaussian of the distance of the barycentres.
    spacing
        Root of the mean area of the faces.
    """

    at_points: csr_array
    first: npt.NDArray[np.int32]
    neighbour: npt.NDArray[np.int32]
    weight: npt.NDArray[np.float64]
    spacing: float

    @classmethod
    def of(cls, surface: Surface) -> FaceNeighbours:
        """Return the neighbours of the faces of a surface."""
        at_points = _faces_at_points(surface)
        few = at_points.sum(axis=1) <= _MAX_FACES_AT_POINT
        near = csr_array(at_points[few].T @ at_points[few] + eye_array(surface.n_faces))
        spacing = float(np.sqrt(surface.area / surface.n_faces))
        centres = surface.points[surface.faces].mean(axis=1)
        distance = ((centres[_rows(near.indptr)] - centres[near.indices]) ** 2).sum(axis=1)
        weight = surface.face_areas[near.indices] * np.exp(-distance / (2.0 * (_CENTRE_WIDTH * spacing) ** 2))
        return cls(at_points=at_points, first=near.indptr, neighbour=near.indices, weight=weight, spacing=spacing)

    @property
    def face(self) -> npt.NDArray[np.int32]:
        """Face that each neighbour is of (E,)."""
        return _rows(self.first)

    def averaged(self, weight: npt.NDArray[np.float64], normals: FaceVectors) -> FaceVectors:
        """Return the unit means (F, 3) of the normals (F, 3) of the neighbours with weights (E,)."""
        shape = (len(normals), len(normals))
        return unit(csr_array((weight, self.neighbour, self.first), shape=shape) @ normals)


def bilateral_normals(neighbours: FaceNeighbours, normals: FaceVectors, *, rounds: int, width: float) -> FaceVectors:
    """Return normals (F, 3) after rounds of filtering by the normals near each that are like it.

    Parameters
    ----------
    neighbours
        The neighbours of each face.
    normals
        Unit normals (F, 3).
    rounds
        Number of times that they are filtered.
    width
        Standard deviation of the weights by the difference of unit normals.
    """
    face, neighbour = neighbours.face, neighbours.neighbour
    for _ in range(rounds):
        difference = ((normals[face] - normals[neighbour]) ** 2).sum(axis=1)
        weight = neighbours.weight * np.exp(-difference / (2.0 * width**2))
        normals = neighbours.averaged(weight, normals)
    return normals


def bilateral_filtered(
    surface: Surface, *, rounds: int = 5, normal_width: float = 0.35, point_steps: int = POINT_STEPS
) -> Surface:
    """Return a surface whose normals were filtered, each by the normals near it that are like it; its boundary stays.

    Parameters
    ----------
    surface
        An oriented surface.
    rounds, normal_width
        See :func:`bilateral_normals`.
    point_steps
        Steps in which the points follow the filtered normals.

    Notes
    -----
    A normal becomes the mean of the normals of the faces that share a point with its face, weighted by area, by the
    distance of barycentres and by the difference of normals; so creases stay. Then the points follow.

    References
    ----------
    Zheng, Fu, Au, Tai, "Bilateral normal filtering for mesh denoising", 2011.
    """
    neighbours = FaceNeighbours.of(surface)
    normals = bilateral_normals(neighbours, surface.face_normals, rounds=rounds, width=normal_width)
    return following_normals(surface, neighbours, normals, point_steps)


def following_normals(
    surface: Surface, neighbours: FaceNeighbours, normals: FaceVectors, steps: int = POINT_STEPS
) -> Surface:
    """Return a surface whose points took steps towards the planes of their faces with other normals (F, 3).

    In a step each point moves by the mean of the ways to the planes through the barycentres of its faces; the boundary
    stays.

    References
    ----------
    Sun, Rosin, Martin, Langbein, "Fast and effective feature-preserving mesh denoising", 2007.
    """
    at_points = neighbours.at_points
    share = np.where(surface.on_boundary, 0.0, 1.0) / np.maximum(at_points.sum(axis=1), 1.0)
    points: Points = surface.points
    outer = (normals[:, :, None] * normals[:, None, :]).reshape(-1, 9)
    matrices = (at_points @ outer).reshape(-1, 3, 3)
    for _ in range(steps):
        centres = points[surface.faces].mean(axis=1)
        towards = at_points @ (normals * np.einsum("fx,fx->f", normals, centres)[:, None])
        points = points + share[:, None] * (towards - np.einsum("vij,vj->vi", matrices, points))
    return surface.with_points(points)


def neighbour_averages(surface: Surface) -> csr_array:
    """Return the matrix (V, V) that takes the mean over the neighbours of each point, or its own value without any."""
    n = surface.n_points
    ends = np.concatenate([surface.edges, surface.edges[:, ::-1]])
    alone = np.setdiff1d(np.arange(n), ends)
    rows, columns = np.concatenate([ends, np.stack([alone, alone], axis=1)]).T
    matrix = csr_array((np.ones(len(rows)), (rows, columns)), shape=(n, n))
    return csr_array(diags_array(1.0 / matrix.sum(axis=1)) @ matrix)


def _faces_at_points(surface: Surface) -> csr_array:
    """Return the matrix (V, F) that is 1 where a face is at a point."""
    face = np.repeat(np.arange(surface.n_faces), 3)
    shape = (surface.n_points, surface.n_faces)
    return csr_array((np.ones(len(face)), (surface.faces.ravel(), face)), shape=shape)


def _rows(first: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Return the row (E,) of each entry of compressed rows (F + 1,)."""
    return np.repeat(np.arange(len(first) - 1, dtype=np.int32), np.diff(first))
