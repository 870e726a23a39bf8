"""Sheets that get the same vertices along junctions, and are joined there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EdgeMask, PointLabels, Points
from anisomesh.conforming.chains import conform
from anisomesh.delaunay.feature_mesh import edges_left, renumbered
from anisomesh.delaunay.meshing import MeshingTask, ValidMesh
from anisomesh.junctions.chains import Bundled, bundled
from anisomesh.junctions.cut import Junctions
from anisomesh.junctions.narrow import beside, without_narrow_faces
from anisomesh.mesh.geometry import Frame, even_edge_length
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.meshops.change import apply_changes
from anisomesh.meshops.decimation import decimate
from anisomesh.meshops.flip import flip_for_shape
from anisomesh.meshops.held import Held
from anisomesh.meshops.inverted import remove_inverted_triangles
from anisomesh.meshops.split import edge_split, split_longest_edges
from anisomesh.metric.transfer import transfer_metric_roots

_MAX_CROWDING = 2.0  # vertices of a chain in the length of a mean edge; heuristic
_MAX_EXCESS = 1.5  # of the vertices asked for, where junctions take more; heuristic
_MAX_SETTLING_ROUNDS = 10  # of changes until no edges coincide and the number of vertices is right

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


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


def sites_for(junctions: Junctions, n: int) -> int:
    """Return about how many vertices all sheets need, apart, so that n are left when they are joined."""
    surface, graph = junctions.sheets, junctions.graph
    spacing = even_edge_length(surface.area, n)
    where = np.zeros((int(junctions.joined.max()) + 1, 3))
    where[junctions.joined] = surface.points
    total = float(np.count_nonzero(graph.nodes) - len(np.unique(junctions.joined[graph.nodes])))
    for curve, copies in zip(graph.curves, graph.copies, strict=True):
        length = float(np.linalg.norm(np.diff(where[curve], axis=0), axis=1).sum())
        total += (copies - 1) * max(length / spacing - 1.0, 0.0)
    return n + round(total)


@dataclass(frozen=True, eq=False)
class Conforming:
    """A mesh of sheets with the same vertices along junctions.

    Attributes
    ----------
    mesh
        The mesh.
    seam
        Where it is to be joined.
    """

    mesh: ValidMesh
    seam: Seam

    def after(self, surface: Surface) -> Conforming:
        """Return the same for a mesh that was changed away from the seam."""
        none = self.mesh.crease_edges[:0]
        return replace(self, mesh=replace(self.mesh, points=surface.points, faces=surface.faces, crease_edges=none))


@dataclass(frozen=True, eq=False)
class JoinTask:
    """What meshes of sheets are to be joined to.

    Attributes
    ----------
    task
        The task that they are made for.
    junctions
        The junctions, in model units.
    frame
        From model units to the units of the meshes.
    n_vertices
        Vertices wanted when the sheets are joined.
    """

    task: MeshingTask
    junctions: Junctions
    frame: Frame
    n_vertices: int

    def conforming(self, mesh: ValidMesh) -> Conforming | None:
        """Return a mesh of sheets with the same vertices along junctions, as many as wanted in all when joined.

        None if that cannot be done.
        """
        task, sheets = self.task, self.junctions.sheets
        reference = sheets.with_points(self.frame.to_unit(sheets.points))
        exact = np.array_equal(reference.points, task.surface.points)
        found = bundled(Surface(mesh.points, mesh.faces), self.junctions, reference, exact=exact)
        thinner = None if found is None else _thinned(mesh, found, task)
        if thinner is not None:
            mesh = thinner
            found = bundled(Surface(mesh.points, mesh.faces), self.junctions, reference, exact=exact)
        if found is None:
            return None
        found = without_narrow_faces(found, task.reference)
        made = conform(found.points, found.faces, found.bundles)
        seam = _seam(made.points, made.chains)
        tidy = _tidied(replace(mesh, points=made.points, faces=made.faces), task)
        settled = _settled(Conforming(tidy, seam), task, self.n_vertices)
        if settled is None or seam.join(Surface(settled.points, settled.faces)) is None:
            return None
        return Conforming(settled, seam)

    def joined(self, conforming: Conforming) -> Surface | None:
        """Return the joined sheets of a mesh, None if that would join more than its seam."""
        settled = _settled(conforming, self.task, self.n_vertices)
        return None if settled is None else conforming.seam.join(Surface(settled.points, settled.faces))


def _thinned(mesh: ValidMesh, found: Bundled, task: MeshingTask) -> ValidMesh | None:
    """Return a mesh with edges collapsed where chains have many more vertices than their metric length asks for.

    None if no chain has. The vertices there, as added to short boundaries for the topology, would come into all sheets.
    """
    sheets = Surface(mesh.points, mesh.faces)
    roots = transfer_metric_roots(task.embedded_reference, task.roots, found.points)

    def lengths(ends: Ints) -> Floats:
        way = found.points[ends[:, 1]] - found.points[ends[:, 0]]
        return np.asarray(np.linalg.norm(np.einsum("eij,ej->ei", roots[ends].mean(axis=1), way), axis=1))

    even = float(lengths(sheets.edges.astype(np.int64)).mean())
    stays, surplus = np.ones(sheets.n_points, dtype=bool), 0
    for bundle in found.bundles:
        for chain in bundle.chains:
            length = float(lengths(np.stack([chain.points[:-1], chain.points[1:]], axis=1)).sum())
            most = max(bundle.least, int(_MAX_CROWDING * length / even))
            inner = chain.points[1:-1][chain.points[1:-1] < sheets.n_points]
            if len(inner) > most:
                stays[inner], surplus = False, surplus + len(inner) - most
    if not surplus:
        return None
    wanted = sheets.n_points - surplus
    fewer = decimate(
        sheets, wanted, held=stays, crease_edges=mesh.crease_edges, moves=False, reference=task.reference
    )
    return replace(mesh, points=fewer.surface.points, faces=fewer.surface.faces, crease_edges=fewer.crease_edges)


def _tidied(mesh: ValidMesh, task: MeshingTask) -> ValidMesh:
    """Return a mesh with inverted triangles repaired, and edges flipped where that makes better triangles."""
    points, faces, _ = remove_inverted_triangles(
        mesh.points, mesh.faces, task.reference, held=Held(task.anchors.places), deadline=task.deadline
    )
    creases = mesh.crease_edges
    if points is not mesh.points:
        creases = renumbered(mesh.points, points)[creases]
    creases = edges_left(faces, creases)
    roots = transfer_metric_roots(task.embedded_reference, task.roots, points)
    faces = flip_for_shape(points, faces, roots, task.reference, kept=creases)
    return replace(mesh, points=points, faces=faces, crease_edges=edges_left(faces, creases))


def _seam(points: Points, chains: tuple[Ints, ...]) -> Seam:
    """Return the seam along chains of points: one table (k, n) for each curve."""
    first = [points[table[0]] for table in chains]
    places, number = np.unique(np.concatenate(first), axis=0, return_inverse=True)
    parts = np.split(number.reshape(-1), np.cumsum([len(each) for each in first])[:-1])
    edges = [np.stack([part[:-1], part[1:]], axis=1) for part in parts]
    counts = [np.full(len(edge), len(table)) for edge, table in zip(edges, chains, strict=True)]
    return Seam(places=places, edges=np.concatenate(edges).astype(np.int64), counts=np.concatenate(counts))


def _settled(conforming: Conforming, task: MeshingTask, n: int) -> ValidMesh | None:
    """Return a mesh of sheets changed away from the seam, such that it has n vertices and no new edge when joined.

    Edges of two sheets between the same two vertices of the seam become one when these are joined; one of them is
    split. Then points are removed or added; if no more can be removed, it may have somewhat more. None if that does not
    end.
    """
    mesh, seam = conforming.mesh, conforming.seam
    apart = mesh.points[:0]  # points that keep edges from becoming one
    for _ in range(_MAX_SETTLING_ROUNDS):
        sheets = Surface(mesh.points, mesh.faces)
        joined = seam.joined(sheets)
        if (joined[sheets.edges[:, 0]] == joined[sheets.edges[:, 1]]).any():
            return None
        twice, n_joined = _coincident_edges(sheets, seam), int(joined.max()) + 1
        if len(twice) == 0 and n_joined == n:
            return mesh
        if len(twice):
            points, faces = _split_edges(sheets, twice)
            apart = np.concatenate([apart, points[sheets.n_points :]])
            creases = edges_left(faces, mesh.crease_edges)
        else:
            points, faces, creases = _with_count(mesh, task, seam, apart, sheets.n_points + n - n_joined)
            if len(points) == sheets.n_points:
                return mesh if n < n_joined <= _MAX_EXCESS * n else None
        mesh = replace(mesh, points=points, faces=faces, crease_edges=creases)
    return None


def _coincident_edges(sheets: Surface, seam: Seam) -> Ints:
    """Return edges (n,) of the sheets that would become one with others, all but one of each, but none of the seam."""
    joined = seam.joined(sheets)
    keys, on_seam = edge_keys(joined[sheets.edges]), seam.on_seam(sheets)
    order = np.lexsort((~on_seam, keys))
    again = np.append(False, keys[order][1:] == keys[order][:-1])
    return np.asarray(order[again & ~on_seam[order]], dtype=np.int64)


def _split_edges(sheets: Surface, edges: Ints) -> tuple[Points, PointLabels]:
    """Split edges (n,) in the middle, no two at one face."""
    taken, changes = np.zeros(sheets.n_faces, dtype=bool), []
    for edge in edges.tolist():
        change = edge_split(sheets, edge, sheets.points[sheets.edges[edge]].mean(axis=0))
        if not taken[change.gone].any():
            taken[change.gone] = True
            changes.append(change)
    return apply_changes(sheets, changes)


def _with_count(
    mesh: ValidMesh, task: MeshingTask, seam: Seam, apart: Points, n_points: int
) -> tuple[Points, PointLabels, npt.NDArray[np.int64]]:
    """Return points, faces and crease edges with a number of points, if possible; some points (n, 3) stay."""
    sheets = Surface(mesh.points, mesh.faces)
    if n_points < sheets.n_points:
        held = (seam.labels(sheets) >= 0) | task.anchors.held_in(sheets.points)
        again = renumbered(apart, sheets.points)
        held[again[again >= 0]] = True
        fewer = decimate(
            sheets, n_points, held=held, crease_edges=mesh.crease_edges, moves=False, reference=task.reference
        )
        return fewer.surface.points, fewer.surface.faces, fewer.crease_edges
    roots = transfer_metric_roots(task.embedded_reference, task.roots, sheets.points)
    kept = np.concatenate([mesh.crease_edges, sheets.edges[seam.on_seam(sheets)]])
    points, faces = split_longest_edges(sheets.points, sheets.faces, n_points, task.reference, roots, kept=kept)
    return points, faces, mesh.crease_edges
