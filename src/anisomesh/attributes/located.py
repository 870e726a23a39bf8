"""Where the faces, points and corners of a target are on a source."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from anisomesh.attributes.charts import Joints
from anisomesh.attributes.model import Ints, Mesh
from anisomesh.attributes.places import Divided, Floats, walk
from anisomesh.mesh.surface import Surface

_REACH = 0.5  # roots of the area of a face: how far off a sheet that faces its way may be; heuristic
_DETOUR = 0.1  # roots of the area of a face, by which a walk may end farther off than the surface is; heuristic
_A, _B, _C, _D = 0.059715871789770, 0.470142064105115, 0.797426985353087, 0.101286507323456
_PLACES = np.array([[1 / 3] * 3, [_A, _B, _B], [_B, _A, _B], [_B, _B, _A], [_C, _D, _D], [_D, _C, _D], [_D, _D, _C]])
_AREA_SHARES = np.array([0.225, *[0.132394152788506] * 3, *[0.125939180544827] * 3])  # with these, exact up to degree 5


@dataclass(frozen=True, eq=False)
class Located:
    """Where the faces, points and corners of a target are on a source.

    Attributes
    ----------
    source
        The source, on which everything is found.
    target
        A surface near it.

    References
    ----------
    Dunavant, "High degree efficient symmetrical Gaussian quadrature rules for the triangle", 1985 (degree 5).
    """

    source: Mesh
    target: Surface

    @cached_property
    def joints(self) -> Joints:
        """How the faces of the source are joined."""
        return Joints(self.source.surface)

    @cached_property
    def parts(self) -> Ints:
        """The part of the source that most of each face of the target (F',) is on."""
        return majority(self.source.parts[self._closest_samples])

    @cached_property
    def samples(self) -> Ints:
        """The face of the source at seven places in each face of the target (F', 7), the first one in the middle.

        All are on the part of the face.
        """
        facet = self._closest_samples.copy()
        face, place = np.nonzero(self.source.parts[facet] != self.parts[:, None])
        points = np.einsum("nc,ncx->nx", _PLACES[place], self.target.points[self.target.faces[face]])
        normals, reach = self.target.face_normals[face], _REACH * self._sizes[face]
        facet[face, place] = self._divided.locate(self.parts[face], points, normals, reach)[0]
        return facet

    @cached_property
    def points(self) -> tuple[Ints, Floats]:
        """Face (V',) and barycentric coordinates (V', 3) of the points of the target, on the parts around them."""
        target, many = self.target, int(self.source.parts.max()) + 1
        pair = np.unique(target.faces.ravel().astype(np.int64) * many + np.repeat(self.parts, 3))
        lonely = np.setdiff1d(np.arange(target.n_points), target.faces)
        point = np.concatenate([pair // many, lonely])
        part = np.concatenate([pair % many, self.source.parts[self._divided.whole.nearest(target.points[lonely])]])
        size = np.zeros(target.n_points)
        np.maximum.at(size, target.faces, self._sizes[:, None])
        at, normals = target.points[point], target.point_normals[point]
        facet, weights = self._divided.locate(part, at, normals, _REACH * size[point])
        squares = ((self._places(facet, weights) - at) ** 2).sum(axis=1)
        order = np.lexsort([part, squares, point])
        chosen = order[np.unique(point[order], return_index=True)[1]]
        return facet[chosen], weights[chosen]

    def corners(self, continuous: npt.NDArray[np.bool_]) -> tuple[Ints, Floats]:
        """Return face (3F',) and barycentric coordinates (3F', 3) of the corners of the target, on one chart per face.

        Parameters
        ----------
        continuous
            At which pairs of sides (n,) of the source the values agree.
        """
        source, target = self.source.surface, self.target
        charts = self.joints.charts(continuous)
        of_sample = charts[self.samples]
        chart = majority(of_sample)
        first = np.argmax(of_sample == chart[:, None], axis=1)
        start = np.repeat(self.samples[np.arange(target.n_faces), first], 3)
        point = target.faces.ravel()
        at = target.points[point]
        facet, weights, at_seam = walk(source, self.joints.neighbours(continuous), start, at)
        distance = np.linalg.norm(self._places(facet, weights) - at, axis=1)
        nearest = np.linalg.norm(self._places(*self.points) - target.points, axis=1)
        size = np.repeat(self._sizes, 3)
        lost = np.flatnonzero((distance > nearest[point] + _DETOUR * size) & ~at_seam)
        if len(lost):
            normals = target.face_normals[lost // 3]
            found = Divided(source, charts).locate(np.repeat(chart, 3)[lost], at[lost], normals, _REACH * size[lost])
            facet[lost], weights[lost] = found
        return facet, weights

    @cached_property
    def _divided(self) -> Divided:
        return Divided(self.source.surface, self.source.parts)

    @cached_property
    def _sizes(self) -> Floats:
        """Square roots of the areas of the faces of the target (F',)."""
        return np.asarray(np.sqrt(self.target.face_areas))

    @cached_property
    def _closest_samples(self) -> Ints:
        """The face of the source at seven places in each face of the target (F', 7), on any part."""
        target, k = self.target, len(_PLACES)
        places = np.einsum("kc,fcx->fkx", _PLACES, target.points[target.faces]).reshape(-1, 3)
        normals, reach = np.repeat(target.face_normals, k, axis=0), np.repeat(_REACH * self._sizes, k)
        return self._divided.whole.locate(places, normals, reach)[0].reshape(-1, k)

    def _places(self, facet: Ints, weights: Floats) -> Floats:
        corners = self.source.surface.points[self.source.surface.faces[facet]]
        return np.asarray(np.einsum("nc,ncx->nx", weights, corners))


def majority(codes: Ints) -> Ints:
    """Return the number from 0 (n,) with the largest share of the seven places in each face (n, 7)."""
    if len(codes) == 0 or codes.max() == codes.min():
        return codes[:, 0].copy()
    same = codes[:, :, None] == codes[:, None, :]
    shares = np.round(same @ _AREA_SHARES, 12)
    tied = shares == shares.max(axis=1, keepdims=True)
    return np.asarray(np.where(tied, codes, codes.max()).min(axis=1))
