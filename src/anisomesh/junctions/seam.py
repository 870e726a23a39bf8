"""Where sheets are joined: the vertices and edges that they have in common."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, PointLabels, Points
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys

Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Seam:
    """Where the sheets of a mesh are joined.

    Attributes
    ----------
    places
        The places of the common vertices (J, 3); sheets have boundary points at exactly these.
    edges
        The common edges, as pairs of places (m, 2).
    counts
        Number of faces at each of these (m,).
    """

    places: Points
    edges: Ints
    counts: Ints

    def labels(self, sheets: Surface) -> PointLabels:
        """Return which common vertex each point of the sheets (V,) is, -1 for none."""
        number = {place.tobytes(): k for k, place in enumerate(self.places)}
        label = np.full(sheets.n_points, -1, dtype=np.int32)
        for point in np.flatnonzero(sheets.on_boundary).tolist():
            label[point] = number.get(sheets.points[point].tobytes(), -1)
        return label

    def joined(self, sheets: Surface) -> PointLabels:
        """Return the number of each point of the sheets (V,) when they are joined."""
        label = self.labels(sheets)
        first = np.arange(sheets.n_points)
        common = np.flatnonzero(label >= 0)
        lowest = np.full(len(self.places), sheets.n_points)
        np.minimum.at(lowest, label[common], common)
        first[common] = lowest[label[common]]
        return np.unique(first, return_inverse=True)[1].reshape(-1).astype(np.int32)

    def on_seam(self, sheets: Surface) -> EdgeMask:
        """Return which edges (E,) of the sheets are on the boundary and common."""
        label = self.labels(sheets)[sheets.edges]
        common = (label >= 0).all(axis=1) & (sheets.edge_face_count == 1)
        return np.asarray(common & np.isin(edge_keys(label), edge_keys(self.edges)))

    def join(self, sheets: Surface) -> Surface | None:
        """Return the joined sheets, None unless exactly the common edges have become common, with all their faces."""
        joined = self.joined(sheets)
        faces = joined[sheets.faces]
        first = np.unique(joined, return_index=True)[1]
        result = Surface(sheets.points[first], faces)
        if (faces == faces[:, [1, 2, 0]]).any() or len(np.unique(np.sort(faces, axis=1), axis=0)) < len(faces):
            return None
        number = np.full(len(self.places), -1, dtype=np.int64)
        label = self.labels(sheets)
        number[label[label >= 0]] = joined[label >= 0]
        expected = np.zeros(len(result.edges), dtype=np.int64)
        keys, wanted = edge_keys(result.edges), edge_keys(number[self.edges])
        if (number < 0).any() or not np.isin(wanted, keys).all():
            return None
        expected[np.searchsorted(keys, wanted)] = self.counts
        own = np.zeros(len(keys), dtype=np.int64)
        own[np.searchsorted(keys, edge_keys(joined[sheets.edges]))] = sheets.edge_face_count
        return result if (result.edge_face_count == np.where(expected > 0, expected, own)).all() else None


def seam_along(points: Points, chains: tuple[Ints, ...]) -> Seam:
    """Return the seam along chains of points: one table (k, n) for each curve."""
    first = [points[table[0]] for table in chains]
    places, number = np.unique(np.concatenate(first), axis=0, return_inverse=True)
    parts = np.split(number.reshape(-1), np.cumsum([len(each) for each in first])[:-1])
    edges = [np.stack([part[:-1], part[1:]], axis=1) for part in parts]
    counts = [np.full(len(edge), len(table)) for edge, table in zip(edges, chains, strict=True)]
    return Seam(places=places, edges=np.concatenate(edges).astype(np.int64), counts=np.concatenate(counts))
