"""A surface together with its Euclidean embedding, the domain of all Voronoi diagrams."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EmbeddedPoints, Faces, FaceScalars, PointScalars
from anisomesh._kernels import clip
from anisomesh.errors import MeshError
from anisomesh.mesh import geometry
from anisomesh.mesh.surface import Surface

_MORTON_BITS = 10  # per axis: 1,024 cells along the longest side of the bounding box


@dataclass(frozen=True, eq=False)
class EmbeddedSurface:
    """A surface in space and the positions of its points in R^d, the faces of both in one spatial order.

    Parameters
    ----------
    surface
        The surface in space. Its faces are reordered along a Morton curve, once, so that neighbouring faces are near
        each other in memory; ``surface`` and everything derived from it has the new order.
    points
        Embedded points (V, d), d >= 3; the first three coordinates are ``scale`` times the position in space.
    scale
        Factor of the first three coordinates.
    density
        Positive weights of the energy at the points (V,), or None for 1 everywhere; on a face the mean of its corners
        counts. Sites gather where it is large: their number per area follows its square root.

    Attributes
    ----------
    face_order
        Index (F,) of each face among the faces of the surface that was passed.

    Raises
    ------
    MeshError
        If the points are not (V, d) with d >= 3, or the density is not (V,) and positive.
    """

    surface: Surface
    points: EmbeddedPoints
    scale: float = 1.0
    density: PointScalars | None = None
    face_order: npt.NDArray[np.int64] = field(init=False)

    def __post_init__(self) -> None:
        points = np.require(self.points, np.float64, ["C", "W"])  # kernels are compiled anew for read-only arrays
        if points.ndim != 2 or points.shape[1] < 3 or len(points) != self.surface.n_points:
            raise MeshError(f"points has shape {points.shape}; expected ({self.surface.n_points}, d) with d >= 3")
        if self.density is not None:
            density = np.asarray(self.density, dtype=np.float64)
            if density.shape != (self.surface.n_points,) or not (np.isfinite(density) & (density > 0.0)).all():
                raise MeshError(f"density has shape {density.shape}; expected {self.surface.n_points} positive numbers")
            object.__setattr__(self, "density", density)
        faces = self.surface.faces
        order = _morton_order(points[faces, :3].mean(axis=1))
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "surface", Surface(self.surface.points, faces[order]))
        object.__setattr__(self, "face_order", order)

    @classmethod
    def in_space(cls, surface: Surface) -> EmbeddedSurface:
        """Return a surface embedded by its own coordinates, d = 3: isotropic."""
        return cls(surface, surface.points)

    @property
    def dimension(self) -> int:
        """Number of coordinates d."""
        return int(self.points.shape[1])

    @property
    def faces(self) -> Faces:
        """The faces (F, 3)."""
        return self.surface.faces

    @property
    def face_areas(self) -> FaceScalars:
        """Areas of the faces in the embedding (F,)."""
        return self.facets.area

    @cached_property
    def facets(self) -> clip.Facets:
        """What the kernels need of the faces: corners, squared sides, areas and normals in space."""
        faces = np.array(self.faces)
        corners = self.points[faces]
        side2 = np.stack(
            [((corners[:, (c + 1) % 3] - corners[:, (c + 2) % 3]) ** 2).sum(axis=1) for c in range(3)], axis=1
        )
        u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        uu, uv = (u * u).sum(axis=1), (u * v).sum(axis=1)
        along = np.divide(uv, uu, out=np.zeros_like(uv), where=uu > 0.0)
        # not from uu vv - uv^2, which cancels on slivers
        area = 0.5 * np.sqrt(uu) * np.linalg.norm(v - along[:, None] * u, axis=1)
        normal = geometry.unit(np.cross(u[:, :3], v[:, :3]))
        return clip.Facets(faces=faces, points=self.points, side2=side2, area=area, normal=normal)

    @cached_property
    def weighted_facets(self) -> clip.Facets:
        """The same with areas multiplied by the density, over which energies are integrated."""
        if self.density is None:
            return self.facets
        return self.facets._replace(area=self.facets.area * self.density[self.faces].mean(axis=1))

    @property
    def sampling_weights(self) -> FaceScalars:
        """Expected number of sites on each face (F,), up to a factor: area times the square root of the density.

        The optimal density of sites in two dimensions is the square root of the density of the energy (Gersho 1979).
        """
        if self.density is None:
            return self.face_areas
        return np.asarray(self.face_areas * np.sqrt(self.density[self.faces].mean(axis=1)))

    @cached_property
    def area(self) -> float:
        """Area in the embedding."""
        return float(self.face_areas.sum())

    def site_spacing(self, n_sites: int) -> float:
        """Return the edge length of n sites in equilateral triangles that cover the embedded surface evenly."""
        return geometry.even_edge_length(self.area, n_sites)

    def at(self, faces: npt.NDArray[np.integer], barycentric: npt.NDArray[np.float64]) -> EmbeddedPoints:
        """Return the embedded positions (n, d) of points given by face (n,) and barycentric coordinates (n, 3)."""
        return np.asarray(np.einsum("nc,ncd->nd", barycentric, self.points[self.faces[faces]]))


def _morton_order(centres: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """Return the order of points (n, 3) along a Morton curve (Morton 1966)."""
    low = centres.min(axis=0)
    extent = float(np.ptp(centres, axis=0).max()) or 1.0
    n_cells = 1 << _MORTON_BITS
    cell = np.minimum((centres - low) / extent * n_cells, n_cells - 1).astype(np.int64)
    key = np.zeros(len(centres), dtype=np.int64)
    for bit in range(_MORTON_BITS):
        for axis in range(3):
            key |= (cell[:, axis] >> bit & 1) << (3 * bit + axis)
    return np.asarray(np.argsort(key, kind="stable"))
