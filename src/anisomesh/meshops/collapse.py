"""Edge collapses that keep the topology, to bring a mesh down to a number of vertices."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from anisomesh._arrays import Faces, PointMask, Points
from anisomesh.mesh import geometry
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys

_LENGTH_WEIGHT = 1e-3  # of the squared length against the squared distance to the planes
_MIN_NORMAL_COSINE = 0.2  # a face turns by no more than this in one collapse
_MIN_COLLAPSED_THICKNESS = 1e-3  # area over squared longest side of a face that a collapse may leave
_BATCHES = (0.1, 0.3, 1.0)  # shares of the collapses considered in one round, the larger where too few are possible
_ENOUGH = 0.002  # of the points are a round worth while

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Links = npt.NDArray[np.int64]


def decimate(
    points: Points,
    faces: Faces,
    n_points: int,
    reference: ClosestPoints,
    *,
    kept: PointMask | None = None,
    creases: Links | None = None,
) -> tuple[Points, Faces, Links]:
    """Collapse edges until no more than ``n_points`` points are left, or none can go.

    Parameters
    ----------
    points, faces
        An oriented manifold mesh (V, 3), (F, 3) without unused points.
    n_points
        Number of points wanted.
    reference
        The surface that the mesh approximates; no collapse inverts a face against it.
    kept
        Points that are not removed (V,).
    creases
        Edges (n, 2) along creases: only points between two of them are removed, and only along them.

    Returns
    -------
    points, faces, creases
        The coarser mesh, whose points are a subset of the input, and the remaining crease edges.

    Notes
    -----
    Rounds of half-edge collapses, cheapest first, of edges far enough apart to go together. The cost is the
    quadric error (Garland and Heckbert 1997) of the planes around removed points; short edges go first where that does
    not decide. Collapses fulfil the link condition (Dey, Edelsbrunner, Guha, Nekhayev 1999), so topology, orientation
    and boundary loops stay, and
    no face turns by more than about 80 degrees.
    """
    links = np.zeros((0, 2), dtype=np.int64) if creases is None else creases
    quadrics = _quadrics(Surface(points, faces), links)
    surplus = len(points) - n_points
    refused = np.zeros(0, dtype=np.int64)
    kept = kept if kept is not None else np.zeros(len(points), dtype=bool)
    while surplus > 0:
        surface = Surface(points, faces)
        gone, into, refused = _collapses(surface, quadrics, surplus, reference, kept, links, refused)
        if len(gone) == 0:
            break
        around = np.unique(faces[np.isin(faces, gone).any(axis=1)])
        refused = refused[~np.isin(refused // len(points), around)]  # these may do now
        np.add.at(quadrics, into, quadrics[gone])
        target = np.arange(len(points), dtype=np.int32)
        target[gone] = into
        links = target[links].astype(np.int64)
        links = links[links[:, 0] != links[:, 1]]
        faces = target[faces]
        faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
        surplus -= len(gone)
    used, faces = np.unique(faces, return_inverse=True)
    return points[used], faces.reshape(-1, 3).astype(np.int32), np.searchsorted(used, links)


def fixed_by(creases: Links, n_points: int) -> PointMask:
    """Return which points (n_points,) no collapse along these creases (n, 2) takes: corners, and ends."""
    count = np.bincount(creases.ravel(), minlength=n_points)
    return np.asarray((count != 0) & (count != 2))


def _quadrics(surface: Surface, links: Ints) -> Floats:
    """Return the sum of weight times squared plane at each point (V, 4, 4).

    The planes are the planes of the faces, weighted by area, and, at a boundary edge or a link, the plane through the
    edge perpendicular to the face, weighted by squared length.
    """
    points, side, face = surface.points, surface.edges, surface.edge_faces[:, 0]
    linked = np.isin(edge_keys(surface.edges), edge_keys(links))
    rim = np.flatnonzero((surface.edge_face_count == 1) | linked)
    along = points[side[rim, 1]] - points[side[rim, 0]]
    upright = geometry.unit(np.cross(along, surface.face_normals[face[rim]]))
    result = np.zeros((surface.n_points, 4, 4))
    for normal, place, weight, ends in (
        (surface.face_normals, points[surface.faces[:, 0]], surface.face_areas, surface.faces),
        (upright, points[side[rim, 0]], (along**2).sum(axis=1), side[rim]),
    ):
        plane = np.concatenate([normal, -np.einsum("nx,nx->n", normal, place)[:, None]], axis=1)
        terms = weight[:, None, None] * plane[:, :, None] * plane[:, None, :]
        for corner in ends.T:
            np.add.at(result, corner, terms)
    return result


def _collapses(
    surface: Surface,
    quadrics: Floats,
    surplus: int,
    reference: ClosestPoints,
    kept: PointMask,
    links: Links,
    refused: Ints,
) -> tuple[Ints, Ints, Ints]:
    """Return points to remove and where each goes: cheap, allowed, and with neighbourhoods that do not touch.

    ``refused`` names collapses, as gone * V + into, that would invert a face; it is returned with the ones found here.
    """
    edges = surface.edges[collapsible_edges(surface)].astype(np.int64)
    gone, into = np.concatenate([edges, edges[:, ::-1]]).T
    allowed = ~kept[gone] & (~surface.on_boundary[gone] | surface.on_boundary[into])
    allowed &= ~np.isin(gone * surface.n_points + into, refused)
    on_crease = np.zeros(surface.n_points, dtype=bool)
    on_crease[links] = True
    along = np.isin(edge_keys(np.stack([gone, into], axis=1)), edge_keys(links))
    allowed &= ~fixed_by(links, surface.n_points)[gone] & (along | ~on_crease[gone])
    gone, into = gone[allowed], into[allowed]
    place = np.concatenate([surface.points[into], np.ones((len(into), 1))], axis=1)
    area = np.bincount(surface.faces.ravel(), np.repeat(surface.face_areas, 3), minlength=surface.n_points)
    length2 = ((surface.points[gone] - surface.points[into]) ** 2).sum(axis=1)
    cost = np.einsum("ni,nij,nj->n", place, quadrics[gone], place) + _LENGTH_WEIGHT * area[gone] * length2
    order = np.argsort(cost, kind="stable")
    enough = min(surplus, max(int(_ENOUGH * surface.n_points), 1))
    chosen = order[:0]
    for share in _BATCHES:
        pool = order[: max(int(share * len(order)), 64)]
        good = pool[_keeps_normals(surface, gone[pool], into[pool])]
        while len(good):
            chosen = good[_apart(surface, gone[good], into[good])][:surplus]
            faithful = _faces_reference(surface, gone[chosen], into[chosen], reference)
            bad, chosen = chosen[~faithful], chosen[faithful]
            refused = np.concatenate([refused, gone[bad] * surface.n_points + into[bad]])
            if len(chosen) >= enough or len(bad) == 0:
                break
            good = good[~np.isin(good, bad)]
        if len(chosen) >= enough:
            break
    return gone[chosen], into[chosen], refused


def collapsible_edges(surface: Surface) -> npt.NDArray[np.bool_]:
    """Return which edges (E,) fulfil the link condition."""
    edges, n = surface.edges, surface.n_points
    rows, columns = np.concatenate([edges, edges[:, ::-1]]).T
    adjacency = csr_array((np.ones(len(rows), dtype=np.int32), (rows, columns)), shape=(n, n))
    common = np.asarray((adjacency @ adjacency)[edges[:, 0], edges[:, 1]]).ravel()
    valence = np.diff(adjacency.indptr)
    across = surface.on_boundary[edges].all(axis=1) & (surface.edge_face_count == 2)
    tetrahedron = (valence[edges] == 3).all(axis=1)
    lonely = np.zeros(len(edges), dtype=bool)
    lonely[surface.face_edges[(surface.face_neighbours < 0).all(axis=1)]] = True  # a triangle that is a component
    return np.asarray((common == surface.edge_face_count) & ~across & ~tetrahedron & ~lonely)


def _keeps_normals(surface: Surface, gone: Ints, into: Ints) -> npt.NDArray[np.bool_]:
    """Return which collapses (n,) turn no face around the point that goes by too much, nor make it a needle."""
    which, face, moved = _changed_faces(surface, gone, into)
    new = geometry.unit(geometry.face_cross(surface.points, moved))
    tilted = np.einsum("nx,nx->n", new, surface.face_normals[face]) < _MIN_NORMAL_COSINE
    flat = geometry.thickness(surface.points[moved]) < _MIN_COLLAPSED_THICKNESS
    return np.asarray(np.bincount(which, tilted | flat, minlength=len(gone)) == 0)


def _faces_reference(surface: Surface, gone: Ints, into: Ints, reference: ClosestPoints) -> npt.NDArray[np.bool_]:
    """Return which collapses (n,) leave only faces that clearly face the way of the reference."""
    which, _, moved = _changed_faces(surface, gone, into)
    return np.asarray(np.bincount(which, ~reference.clearly_facing(surface.points[moved]), minlength=len(gone)) == 0)


def _changed_faces(surface: Surface, gone: Ints, into: Ints) -> tuple[Ints, Ints, Ints]:
    """Return collapse (m,), face (m,) and new corners (m, 3) of the faces that live on after each collapse."""
    incidence = _faces_at(surface)
    count = np.diff(incidence.indptr)[gone]
    which = np.repeat(np.arange(len(gone)), count)
    offset = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    face = incidence.indices[incidence.indptr[gone][which] + offset]
    corners = surface.faces[face].astype(np.int64)
    lives = (corners != into[which][:, None]).all(axis=1)
    which, face, corners = which[lives], face[lives], corners[lives]
    return which, face, np.where(corners == gone[which][:, None], into[which][:, None], corners)


def _faces_at(surface: Surface) -> csr_array:
    corners = surface.faces.ravel()
    face = np.repeat(np.arange(surface.n_faces), 3)
    return csr_array((np.ones(len(face), dtype=np.int8), (corners, face)), shape=(surface.n_points, surface.n_faces))


def _apart(surface: Surface, gone: Ints, into: Ints) -> npt.NDArray[np.bool_]:
    """Return collapses (n,), in order of preference, of which no two share a point of their neighbourhoods.

    Greedily: collapses without a better one nearby are taken, then again among the rest, until none is left.
    """
    n = surface.n_points
    rows, columns = np.concatenate([surface.edges, surface.edges[:, ::-1]]).T
    ring = csr_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(n, n))
    touched = csr_array(ring[gone] + ring[into])
    which, point = np.repeat(np.arange(len(gone)), np.diff(touched.indptr)), touched.indices
    chosen = np.zeros(len(gone), dtype=bool)
    while len(which):
        best = np.full(n, len(gone))
        np.minimum.at(best, point, which)
        first = np.ones(len(gone), dtype=bool)
        first[which[best[point] < which]] = False
        winner = np.unique(which[first[which]])
        chosen[winner] = True
        used = np.zeros(n, dtype=bool)
        used[point[first[which]]] = True
        blocked = np.zeros(len(gone), dtype=bool)
        blocked[which[used[point]]] = True
        left = ~blocked[which]
        which, point = which[left], point[left]
    return chosen
