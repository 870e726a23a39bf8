"""Random smooth implicit surfaces with exact curvature: level sets of sums of Gaussian blobs (metaballs)."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.errors import MeshError
from anisomesh.mesh import topology
from anisomesh.mesh.surface import Surface
from anisomesh.metric.curvature import PrincipalCurvatures

_GRID_CELLS = 80  # along the longest side of the bounding box; heuristic
_LEVEL_SET_RADIUS = 1.7  # radii of a blob within which the level set is; exp(-1.7^2) = 0.056, so for up to 17 blobs
_PROJECTION_STEPS = 8  # Newton steps from the grid to the level set; rounding is reached after four
_MIN_SQUARED_GRADIENT = 1e-12  # guards a division where the gradient vanishes
_MEDIAN_BLOB_RADIUS = 0.35  # model units; heuristic
_BLOB_RADIUS_DEVIATION = 0.45  # standard deviation of the logarithm of the radii; heuristic
_BLOB_DISTANCE = 0.45  # between consecutive centres, model units; heuristic, for a connected level set

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Blobs:
    """The function f(x) = 1 - sum of exp(-(x - c)^t A (x - c)), negative inside; value and derivatives are exact.

    Attributes
    ----------
    centres
        Centres c (B, 3).
    shapes
        Symmetric positive definite matrices A (B, 3, 3), in 1/length^2.
    """

    centres: Floats
    shapes: Floats

    @classmethod
    def random(cls, rng: np.random.Generator) -> Blobs:
        """Return two to seven blobs of random radii and orientations, each near the previous one."""
        count = int(rng.integers(2, 8))
        rotations = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
        radii = _MEDIAN_BLOB_RADIUS * np.exp(rng.normal(0.0, _BLOB_RADIUS_DEVIATION, size=(count, 3)))
        shapes = np.einsum("bij,bj,bkj->bik", rotations, radii**-2.0, rotations)
        steps = rng.normal(size=(count, 3))
        steps *= _BLOB_DISTANCE / np.linalg.norm(steps, axis=1, keepdims=True)
        return cls(centres=np.cumsum(steps, axis=0), shapes=shapes)

    def value(self, points: Points) -> Floats:
        """Return f (n,) at points (n, 3)."""
        return np.asarray(1.0 - self._terms(points)[0].sum(axis=1))

    def gradient(self, points: Points) -> Floats:
        """Return the gradient of f (n, 3) at points (n, 3)."""
        weight, pulled = self._terms(points)
        return np.asarray(2.0 * np.einsum("nb,nbx->nx", weight, pulled))

    def hessian(self, points: Points) -> Floats:
        """Return the Hessian of f (n, 3, 3) at points (n, 3)."""
        weight, pulled = self._terms(points)
        outer = np.einsum("nb,nbx,nby->nxy", weight, pulled, pulled)
        return np.asarray(2.0 * np.einsum("nb,bxy->nxy", weight, self.shapes) - 4.0 * outer)

    def project(self, points: Points) -> Points:
        """Return points (n, 3) moved to the level set by Newton steps along the gradient."""
        for _ in range(_PROJECTION_STEPS):
            gradient = self.gradient(points)
            square = np.maximum((gradient**2).sum(axis=1), _MIN_SQUARED_GRADIENT)
            points = points - (self.value(points) / square)[:, None] * gradient
        return points

    def curvature(self, points: Points) -> PrincipalCurvatures:
        """Return the exact principal curvatures, 1/length, of the level sets through points (n, 3).

        The shape operator is P H P / |g| with the gradient g, the Hessian H and the projector P across g (Goldman,
        "Curvature formulas for implicit curves and surfaces", 2005).
        """
        gradient = self.gradient(points)
        length = np.linalg.norm(gradient, axis=1)
        normal = gradient / length[:, None]
        across = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        operator = across @ self.hessian(points) @ across / length[:, None, None]
        values, vectors = np.linalg.eigh(operator)
        along = np.abs(np.einsum("nx,nxk->nk", normal, vectors))
        tangent = np.argsort(along, axis=1)[:, :2]  # the two eigenvectors across the normal
        rows = np.arange(len(points))[:, None]
        pair, directions = values[rows, tangent], vectors.transpose(0, 2, 1)[rows, tangent]
        order = np.argsort(np.abs(pair), axis=1)
        return PrincipalCurvatures(
            values=pair[rows, order], directions=directions[rows, order], trusted=np.ones(len(points), dtype=bool)
        )

    def mesh(self) -> Surface:
        """Return the largest component of the level set by marching cubes, with all vertices on the level set.

        Raises
        ------
        MeshError
            If the level set is empty.
        """
        radius = _LEVEL_SET_RADIUS / np.sqrt(np.linalg.eigvalsh(self.shapes).min(axis=1))[:, None]
        low, high = (self.centres - radius).min(axis=0), (self.centres + radius).max(axis=0)
        cell = float((high - low).max()) / _GRID_CELLS
        counts = np.ceil((high - low) / cell).astype(int) + 1
        axes = [low[axis] + cell * np.arange(counts[axis]) for axis in range(3)]
        z, y, x = (table.ravel() for table in np.meshgrid(axes[2], axes[1], axes[0], indexing="ij"))
        grid = np.ascontiguousarray(np.stack([x, y, z], axis=1))
        points, faces, _ = igl.marching_cubes(self.value(grid), grid, *map(int, counts), 0.0)
        if len(faces) == 0:
            raise MeshError("the level set is empty")
        component = topology.connected_components(faces.astype(np.int32), len(points))[1][faces[:, 0]]
        faces = faces[component == np.argmax(np.bincount(component))]
        used, faces = np.unique(faces, return_inverse=True)
        surface = Surface(self.project(points[used]), faces.reshape(-1, 3))
        outward = np.einsum("fx,fx->f", surface.face_normals, self.gradient(surface.points[surface.faces].mean(axis=1)))
        return (
            surface if (outward * surface.face_areas).sum() > 0.0 else Surface(surface.points, surface.faces[:, ::-1])
        )

    def _terms(self, points: Points) -> tuple[Floats, Floats]:
        """Return exp(-(x - c)^t A (x - c)) (n, B) and A (x - c) (n, B, 3) of each blob."""
        away = points[:, None] - self.centres
        pulled = np.einsum("bxy,nby->nbx", self.shapes, away)
        return np.exp(-np.einsum("nbx,nbx->nb", away, pulled)), pulled
