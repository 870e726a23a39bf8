"""Edge flips: which ones there are, doing them, and those that give triangles a better shape in the metric."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Faces, Points, PointTensors
from anisomesh.mesh import geometry
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.meshops.change import Change, Ints, apply_changes
from anisomesh.metric.quality import anisotropic_quality

_MAX_ROUNDS = 20
_MIN_GAIN = 1e-3  # of the sum of the qualities of the two triangles
_MAX_TURN = 30.0  # degrees between the normals of the triangles before and after
_SLACK = 0.01  # edge lengths by which the new edge may be farther from the surface than the old one
_FLAT_QUALITY = -2.0  # of a triangle without area: no gain elsewhere makes up for one
_FLAT_SLACK = 0.25  # the same as the other slack, to be rid of one


@dataclass(frozen=True, eq=False)
class Flips:
    """Edges with another diagonal of their two triangles that is not an edge yet.

    Attributes
    ----------
    pair
        The two triangles at each edge (n, 2).
    old, new
        Ends of the edge and of the other diagonal (n, 2).
    triangles
        The triangles after the flip (n, 2, 3), oriented as before.
    """

    pair: Ints
    old: Ints
    new: Ints
    triangles: Ints

    def take(self, chosen: npt.NDArray[np.bool_]) -> Flips:
        """Return some of the flips, by mask (n,)."""
        return Flips(self.pair[chosen], self.old[chosen], self.new[chosen], self.triangles[chosen])

    def change(self, k: int) -> Change:
        """Return one flip as a change."""
        return Change(self.pair[k], self.triangles[k])


def possible_flips(surface: Surface, edges: npt.NDArray[np.integer]) -> Flips:
    """Return the flips of these edges (n,) that keep the mesh a manifold; edges with one triangle have none."""
    edges = edges[surface.edge_face_count[edges] == 2]
    faces = surface.faces.astype(np.int64)
    pair = surface.edge_faces[edges].astype(np.int64)
    corner = np.argmax(surface.face_edges[pair[:, 0]] == edges[:, None], axis=1)
    a, x, y = (faces[pair[:, 0], (corner + k) % 3] for k in range(3))
    b = faces[pair[:, 1]].sum(axis=1) - x - y
    known = edge_keys(surface.edges)
    free = (a != b) & ~np.isin(edge_keys(np.stack([a, b], axis=1)), known)
    triangles = np.stack([np.stack([a, x, b], axis=1), np.stack([a, b, y], axis=1)], axis=1)
    return Flips(pair, np.stack([x, y], axis=1), np.stack([a, b], axis=1), triangles).take(free)


def do_flips(surface: Surface, flips: Flips, order: Ints) -> Faces:
    """Return the faces (F, 3) after the flips in this order, except flips that conflict with an earlier one.

    No triangle changes twice and no edge is made twice; so every flip has the effect that it has alone.
    """
    changes = []
    taken: set[int] = set()
    made: set[tuple[int, int]] = set()
    for k in order.tolist():
        first, second = flips.pair[k].tolist()
        low, high = sorted(flips.new[k].tolist())
        if first not in taken and second not in taken and (low, high) not in made:
            taken |= {first, second}
            made.add((low, high))
            changes.append(flips.change(k))
    return apply_changes(surface, changes)[1]


def flip_for_shape(
    points: Points, faces: Faces, roots: PointTensors, reference: ClosestPoints, *, kept: Ints | None = None
) -> Faces:
    """Return the faces (F, 3) after flips of edges that give better triangles in the metric.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3).
    roots
        Symmetric square roots of the metric at the points (V, 3, 3).
    reference
        The surface that the mesh approximates.
    kept
        Edges (n, 2) that stay, but for the longest side of a triangle without area: the other two are the same line.

    Notes
    -----
    The dual of a Voronoi diagram has the best triangles for the metric that the embedding has, which is not quite the
    one asked for. A flip is made if the qualities G of the two triangles have a larger sum after it, unless it makes a
    fold or a triangle that faces away, or takes the middle of the edge farther from the surface, as a flip over a
    crease does. Triangles without area, as between three vertices on a straight boundary, go first: they count less
    than nothing, and cannot be folded. The sum over the mesh grows with every flip, so the rounds end.
    """
    active = np.ones(len(faces), dtype=bool)
    keys = edge_keys(np.zeros((0, 2), dtype=np.int64) if kept is None else kept)
    for _ in range(_MAX_ROUNDS):
        surface = Surface(points, faces)
        edges = np.unique(surface.face_edges[active])
        edges = edges[~np.isin(edge_keys(surface.edges[edges]), keys) | np.isin(edges, _sides_of_flat(surface))]
        flips = possible_flips(surface, edges)
        before, after = (
            _quality(points, triangles.reshape(-1, 3), roots).reshape(-1, 2).sum(axis=1)
            for triangles in (faces[flips.pair], flips.triangles)
        )
        gain = after - before
        flips, gain = flips.take(gain > _MIN_GAIN), gain[gain > _MIN_GAIN]
        allowed = _keeps_surface(surface, flips, reference)
        flips, gain = flips.take(allowed), gain[allowed]
        if len(gain) == 0:
            break
        changed = do_flips(surface, flips, np.argsort(-gain, kind="stable"))
        active = (changed != faces).any(axis=1)
        faces = changed
    return faces


def _sides_of_flat(surface: Surface) -> Ints:
    """Return the longest sides of the triangles without area, as numbers of edges (n,)."""
    sides = surface.face_edges[geometry.is_flat(surface.points[surface.faces])]
    longest = np.argmax(surface.edge_lengths[sides], axis=1)
    return np.asarray(sides[np.arange(len(sides)), longest], dtype=np.int64)


def _quality(points: Points, triangles: Ints, roots: PointTensors) -> npt.NDArray[np.float64]:
    """Return the qualities of triangles (n, 3) in the metric."""
    return np.where(geometry.is_flat(points[triangles]), _FLAT_QUALITY, anisotropic_quality(points, triangles, roots))


def _keeps_surface(surface: Surface, flips: Flips, reference: ClosestPoints) -> npt.NDArray[np.bool_]:
    """Return which flips (n,) keep the normals and do not take the mesh away from the reference."""
    points = surface.points
    normals = geometry.unit(geometry.face_cross(points, flips.triangles.reshape(-1, 3))).reshape(-1, 2, 3)
    cosine = np.einsum("nix,njx->nij", normals, surface.face_normals[flips.pair])
    flat = geometry.is_flat(points[surface.faces[flips.pair]].reshape(-1, 3, 3)).reshape(-1, 1, 2)
    cosine[np.broadcast_to(flat, cosine.shape)] = 1.0
    allowed = np.asarray(cosine.min(axis=(1, 2)) > np.cos(np.radians(_MAX_TURN)))
    some = flips.take(allowed)
    old_distance, new_distance = (
        np.sqrt(reference.squared_distances(points[ends].mean(axis=1))) for ends in (some.old, some.new)
    )
    old_length, new_length = (
        np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1) for ends in (some.old, some.new)
    )
    slack = np.where(np.asarray(flat.any(axis=(1, 2)))[allowed], _FLAT_SLACK * new_length, _SLACK * old_length)
    facing = reference.clearly_facing(points[some.triangles.reshape(-1, 3)]).reshape(-1, 2).all(axis=1)
    allowed[allowed] = (new_distance <= old_distance + slack) & facing
    return allowed
