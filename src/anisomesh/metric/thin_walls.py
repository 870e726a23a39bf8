"""Thin walls: a metric in which their two faces are as far apart as vertices are."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy import sparse

from anisomesh._arrays import CornerTensors, FaceLabels, FaceMask, FaceVectors
from anisomesh.mesh.geometry import even_edge_length, unit
from anisomesh.mesh.surface import Surface
from anisomesh.metric.field import MetricField, mean_at_points
from anisomesh.metric.patches import smooth_patches

# in distances of vertices in the metric; heuristics, chosen on thin-walled training parts
_MAX_WIDTH = 0.5  # mean width of a narrow patch
_MIN_LENGTH = 2.0  # its length; shorter ones are specks
_SEPARATION = 1.0  # width that a narrow patch is given

_MAX_ALIGNMENT = 0.7  # length of the mean normal beyond its rim; 0 between parallel faces, 1 at a step; heuristic
_SMOOTHING_ROUNDS = 2  # that outvote the ends of a narrow patch, where its rim runs across; heuristic

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.integer]


def separate_thin_walls(field: MetricField, surface: Surface, n_vertices: int, crease_angle: float) -> MetricField:
    """Return a metric that keeps the two faces of thin walls apart, for the embedding of the surface.

    Parameters
    ----------
    field
        The metric of the surface. It is returned as it is without thin walls, or if it has extra coordinates already.
    surface
        The surface.
    n_vertices
        Number of vertices asked for.
    crease_angle
        Edges whose dihedral angle deviates from flat by more degrees than this separate patches, if the field does not
        say which patches there are.

    Notes
    -----
    A cell of the tessellation is what is nearest to its site, so on a plate much thinner than the distance of vertices
    one cell covers both faces, and one site cannot follow both creases of the rim: the outline is cut to a zigzag
    between them. Here the rim, a patch of small width w beyond whose two long sides the surface faces about opposite
    ways, is made one distance h of vertices wide: in its direction e across, the metric becomes (h / w)^2 e e^t. Its
    embedding moves the two faces apart by as much and leaves them as they are, so that the metric changes nowhere else.
    """
    if field.extra is not None:
        return field
    patch = smooth_patches(surface, crease_angle, 1).labels if field.patch is None else field.patch
    given = field.tensors[surface.faces] if field.corner_tensors is None else field.corner_tensors
    rim = _Rim.of(surface, patch)
    width = rim.widths(surface, patch)
    spacing, smallest = _spacing(surface, given, n_vertices)
    candidates = rim.alignments(surface, patch) < _MAX_ALIGNMENT
    open_width = np.where(candidates, width, 0.0)  # a closed patch is infinitely wide
    candidates &= np.sqrt(_means(surface, patch, smallest)) * open_width < _MAX_WIDTH * spacing
    faces = np.flatnonzero(candidates[patch])
    if len(faces) == 0:
        return field
    across = _directions_across(surface, patch, rim, candidates[patch])[faces]
    along = np.cross(surface.face_normals[faces], across)
    tensors = given[faces].mean(axis=1)
    squared_across, squared_along = np.zeros((2, surface.n_faces))
    squared_across[faces] = np.einsum("fx,fxy,fy->f", across, tensors, across)
    squared_along[faces] = np.einsum("fx,fxy,fy->f", along, tensors, along)
    length = np.sqrt(_means(surface, patch, squared_along)) * rim.perimeters(surface, patch) / 2.0
    candidates &= np.sqrt(_means(surface, patch, squared_across)) * open_width < _MAX_WIDTH * spacing
    thin = (candidates & (length > _MIN_LENGTH * spacing))[patch[faces]]
    if not thin.any():
        return field
    faces, across = faces[thin], across[thin]
    corners = np.array(given)
    more = np.maximum((_SEPARATION * spacing / width[patch[faces]]) ** 2 - squared_across[faces], 0.0)
    corners[faces] += (more[:, None, None] * across[:, :, None] * across[:, None, :])[:, None]
    return replace(field, tensors=mean_at_points(surface, corners), corner_tensors=corners, patch=patch)


@dataclass(frozen=True, eq=False)
class _Rim:
    """The n sides of faces at the rims of patches: the face inside, the face beyond (-1 for none), and the edge."""

    face: Ints
    beyond: Ints
    edge: Ints

    @classmethod
    def of(cls, surface: Surface, patch: FaceLabels) -> _Rim:
        first, second = surface.edge_faces.T
        edge = np.flatnonzero((second < 0) | (patch[first] != patch[second]))
        inner = edge[second[edge] >= 0]
        return cls(
            np.concatenate([first[edge], second[inner]]),
            np.concatenate([second[edge], first[inner]]),
            np.concatenate([edge, inner]),
        )

    def perimeters(self, surface: Surface, patch: FaceLabels) -> Floats:
        """Return the length of the rim of each patch (P,)."""
        return self._sums(patch, surface.edge_lengths[self.edge])

    def widths(self, surface: Surface, patch: FaceLabels) -> Floats:
        """Return twice the area over the perimeter of each patch (P,), the width of a strip; infinite if closed."""
        perimeter = self.perimeters(surface, patch)
        double = 2.0 * np.bincount(patch, surface.face_areas, minlength=len(perimeter))
        return np.asarray(np.divide(double, perimeter, out=np.full(len(perimeter), np.inf), where=perimeter > 0.0))

    def alignments(self, surface: Surface, patch: FaceLabels) -> Floats:
        """Return the length of the mean normal beyond the rim of each patch (P,); open boundaries count as aligned."""
        length = surface.edge_lengths[self.edge]
        closed = self.beyond >= 0
        normals = (length * closed)[:, None] * surface.face_normals[self.beyond]
        total = np.linalg.norm([self._sums(patch, x) for x in normals.T], axis=0) + self._sums(patch, length * ~closed)
        perimeter = self.perimeters(surface, patch)
        return np.asarray(np.divide(total, perimeter, out=np.ones(len(perimeter)), where=perimeter > 0.0))

    def _sums(self, patch: FaceLabels, values: Floats) -> Floats:
        return np.bincount(patch[self.face], values, minlength=int(patch.max()) + 1).astype(np.float64)


def _spacing(surface: Surface, corner_tensors: CornerTensors, n_vertices: int) -> tuple[float, Floats]:
    """Return the distance of vertices in the metric, and its smaller eigenvalue in the planes of the faces (F,)."""
    values = np.linalg.eigvalsh(corner_tensors.mean(axis=1))[:, 1:]
    area = float((surface.face_areas * np.sqrt(values.prod(axis=1))).sum())
    return even_edge_length(area, n_vertices), values[:, 0]


def _means(surface: Surface, patch: FaceLabels, values: Floats) -> Floats:
    """Return the area-weighted means (P,) of values on the faces (F,); 0 on patches without area."""
    area = np.bincount(patch, surface.face_areas)
    total = np.bincount(patch, surface.face_areas * values)
    return np.divide(total, area, out=np.zeros(len(area)), where=area > 0.0)


def _directions_across(surface: Surface, patch: FaceLabels, rim: _Rim, chosen: FaceMask) -> FaceVectors:
    """Return unit vectors (F, 3) across the patches of the chosen faces (F,), 0 on other faces.

    On faces at the rim they are the principal axes of the outer products of its conormals, which spread to the others.
    """
    ends = surface.points[surface.edges[rim.edge]]
    conormal = np.cross(ends[:, 1] - ends[:, 0], surface.face_normals[rim.face])
    length = np.linalg.norm(conormal, axis=1)
    products = conormal[:, :, None] * unit(conormal)[:, None, :] * (length > 0.0)[:, None, None]
    tensors = np.zeros((surface.n_faces, 3, 3))
    np.add.at(tensors, rim.face, np.where(chosen[rim.face, None, None], products, 0.0))
    first, second = surface.edge_faces[surface.edge_faces[:, 1] >= 0].T
    inner = chosen[first] & (patch[first] == patch[second])
    ones = np.ones(np.count_nonzero(inner))
    adjacent = sparse.coo_matrix((ones, (first[inner], second[inner])), shape=(surface.n_faces,) * 2)
    adjacent = (adjacent + adjacent.T).tocsr()
    flat = tensors.reshape(-1, 9)
    for _ in range(_SMOOTHING_ROUNDS):
        flat = flat + adjacent @ flat
    unset = chosen & ~flat.any(axis=1)
    while unset.any():
        flat[unset] = adjacent[unset] @ flat
        left = chosen & ~flat.any(axis=1)
        if left.sum() == unset.sum():
            break
        unset = left
    axes = np.linalg.eigh(flat.reshape(-1, 3, 3))[1][:, :, 2]
    axes -= np.einsum("fx,fx->f", axes, surface.face_normals)[:, None] * surface.face_normals
    return np.asarray(unit(axes) * chosen[:, None])
