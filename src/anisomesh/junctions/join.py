"""Sheets that get the same vertices along junctions, and are joined there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import PointLabels, Points
from anisomesh.conforming.chains import conform
from anisomesh.delaunay.feature_mesh import edges_left, renumbered
from anisomesh.delaunay.meshing import MeshingTask, ValidMesh
from anisomesh.junctions.chains import Bundled, bundled
from anisomesh.junctions.cut import Junctions
from anisomesh.junctions.line_ends import with_ends_at_nodes
from anisomesh.junctions.narrow import place_beside, without_narrow_faces
from anisomesh.junctions.seam import Seam, seam_along
from anisomesh.mesh.geometry import Frame, even_edge_length
from anisomesh.mesh.surface import Surface
from anisomesh.mesh.topology import edge_keys
from anisomesh.mesh.validity import faulty_faces
from anisomesh.meshops.change import apply_changes
from anisomesh.meshops.flip import flip_for_shape
from anisomesh.meshops.held import Held
from anisomesh.meshops.inverted import remove_inverted_triangles
from anisomesh.meshops.split import edge_split, split_longest_edges
from anisomesh.metric.transfer import transfer_metric_roots

_MAX_CROWDING = 2.0  # vertices of a chain in the length of a mean edge; heuristic
_MAX_EXCESS = 1.5  # of the vertices asked for, where junctions take more than sheets apart would; heuristic
_MAX_INVERTED = 10  # triangles of sheets made to conform, of which some stay inverted where there are more; heuristic
_LEAST_LENGTH = 0.08  # of a curve, in distances of evenly spread vertices; heuristic, chosen on training meshes
MAX_FAULTS = 3  # of joined sheets, up to which a fit or another start may remove them; heuristic
_MAX_SETTLING_ROUNDS = 20  # of changes until no edges coincide and the number of vertices is right

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


def are_resolved(junctions: Junctions, n: int) -> bool:
    """Return whether n vertices are enough for the junctions to be more than points.

    Where most curves are far shorter than the distance of vertices, as where parts touch by accident, triangles with
    three vertices at such a place hardly ever fit together.
    """
    return bool(np.median(junctions.lengths) >= _LEAST_LENGTH * even_edge_length(junctions.sheets.area, n))


def sites_for(junctions: Junctions, n: int) -> int:
    """Return about how many vertices all sheets need, apart, so that n are left when they are joined."""
    graph, spacing = junctions.graph, even_edge_length(junctions.sheets.area, n)
    total = float(np.count_nonzero(graph.nodes) - len(np.unique(junctions.joined[graph.nodes])))
    for length, copies in zip(junctions.lengths.tolist(), graph.copies, strict=True):
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
    most
        Vertices that it may have when it is joined.
    """

    mesh: ValidMesh
    seam: Seam
    most: int


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

        None if that cannot be done, or only with many faulty triangles.
        """
        task, bundles = self.task, self._bundled(mesh)
        if bundles is None:
            return None
        mesh, found = bundles
        most = max(int(_MAX_EXCESS * self.n_vertices), len(mesh.points))
        found = without_narrow_faces(found, task.reference)
        made = conform(found.points, found.faces, found.bundles)
        if np.count_nonzero(task.reference.inverted(made.points[made.faces])) > _MAX_INVERTED:
            return None
        seam = seam_along(made.points, made.chains)
        nodes = np.unique(np.concatenate([table[:, [0, -1]].ravel() for table in made.chains]))
        working = task.voronoi.embedded.surface
        lines = working.points[working.edges[task.features.required & (working.edge_face_count == 2)]]
        faces, creases = with_ends_at_nodes(made.points, made.faces, mesh.crease_edges, nodes, lines, task.reference)
        tidy = _tidied(replace(mesh, points=made.points, faces=faces, crease_edges=creases), task)
        settled = _settled(Conforming(tidy, seam, most), task, self.n_vertices)
        if settled is None:
            return None
        sheets = Surface(settled.points, settled.faces)
        fits = seam.join(sheets) is not None and len(faulty_faces(sheets, task.reference)) <= MAX_FAULTS
        return Conforming(settled, seam, most) if fits else None

    def _bundled(self, mesh: ValidMesh) -> tuple[ValidMesh, Bundled] | None:
        """Return a mesh without crowded chains, and these; None if its boundary is not the one of the sheets."""
        sheets = self.junctions.sheets
        reference = sheets.with_points(self.frame.to_unit(sheets.points))
        exact = np.array_equal(reference.points, self.task.surface.points)
        found = bundled(Surface(mesh.points, mesh.faces), self.junctions, reference, exact=exact)
        thinner = None if found is None else _thinned(mesh, found, self.task)
        if thinner is not None:
            mesh = thinner
            found = bundled(Surface(mesh.points, mesh.faces), self.junctions, reference, exact=exact)
        return None if found is None else (mesh, found)

    def joined(self, conforming: Conforming, fitted: Surface) -> Surface:
        """Return the joined sheets of a mesh as they are fitted, or as they were where that would join more."""
        none = conforming.mesh.crease_edges[:0]
        mesh = replace(conforming.mesh, points=fitted.points, faces=fitted.faces, crease_edges=none)
        for each in (_settled(replace(conforming, mesh=mesh), self.task, self.n_vertices), conforming.mesh):
            joined = None if each is None else conforming.seam.join(Surface(each.points, each.faces))
            if joined is not None:
                return joined
        raise AssertionError("a mesh that could be joined cannot")

    def apart(self, mesh: ValidMesh) -> ValidMesh:
        """Return a mesh of sheets that are not to be joined, with as many vertices as wanted where possible."""
        sheets, held = Surface(mesh.points, mesh.faces), self.task.anchors.held_in(mesh.points)
        fewer, creases = self.task.decimated(sheets, self.n_vertices, held, mesh.crease_edges)
        return replace(mesh, points=fewer.points, faces=fewer.faces, crease_edges=creases)


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
    fewer, creases = task.decimated(sheets, sheets.n_points - surplus, stays, mesh.crease_edges)
    return replace(mesh, points=fewer.points, faces=fewer.faces, crease_edges=creases)


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


def _settled(conforming: Conforming, task: MeshingTask, n: int) -> ValidMesh | None:
    """Return a mesh of sheets changed away from the seam, such that it has n vertices and no new edge when joined.

    Edges between the same two vertices of the seam become one when the sheets are joined, and one of them is split, as
    are edges between two points that become one. Then points are removed or added, if there is time. If no more can be
    removed, since that would bring such edges back, it has somewhat more. None if that does not end.
    """
    mesh, seam = conforming.mesh, conforming.seam
    apart = mesh.points[:0]  # points that keep edges from becoming one
    best, fewest = None, conforming.most + 1
    for _ in range(_MAX_SETTLING_ROUNDS):
        sheets = Surface(mesh.points, mesh.faces)
        joined = seam.joined(sheets)
        closed = np.flatnonzero(joined[sheets.edges[:, 0]] == joined[sheets.edges[:, 1]])
        if (sheets.edge_face_count[closed] == 1).any():
            return None
        twice, n_joined = _coincident_edges(sheets, seam), int(joined.max()) + 1
        if len(closed) + len(twice) == 0:
            if n_joined == n or task.deadline.passed():
                return mesh
            if best is not None and n_joined >= fewest:
                break
            if n < n_joined < fewest:
                best, fewest = mesh, n_joined
            points, faces, creases = _with_count(mesh, task, seam, apart, sheets.n_points + n - n_joined)
            if len(points) == sheets.n_points:
                break
        else:
            split = closed if len(closed) else twice
            if len(closed):
                places = np.array([place_beside(sheets, edge, task.reference) for edge in closed.tolist()])
            else:
                places = sheets.points[sheets.edges[twice]].mean(axis=1)
            points, faces = _split_edges(sheets, split, places)
            apart = np.concatenate([apart, points[sheets.n_points :]])
            creases = edges_left(faces, mesh.crease_edges)
        mesh = replace(mesh, points=points, faces=faces, crease_edges=creases)
    return best


def _coincident_edges(sheets: Surface, seam: Seam) -> Ints:
    """Return edges (n,) of the sheets that would become one with others, all but one of each, but none of the seam."""
    joined = seam.joined(sheets)
    keys, on_seam = edge_keys(joined[sheets.edges]), seam.on_seam(sheets)
    order = np.lexsort((~on_seam, keys))
    again = np.append(False, keys[order][1:] == keys[order][:-1])
    return np.asarray(order[again & ~on_seam[order]], dtype=np.int64)


def _split_edges(sheets: Surface, edges: Ints, places: Points) -> tuple[Points, PointLabels]:
    """Split edges (n,) at places (n, 3), no two at one face."""
    taken, changes = np.zeros(sheets.n_faces, dtype=bool), []
    for edge, place in zip(edges.tolist(), places, strict=True):
        change = edge_split(sheets, edge, place)
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
        fewer, creases = task.decimated(sheets, n_points, held, mesh.crease_edges)
        return fewer.points, fewer.faces, creases
    roots = transfer_metric_roots(task.embedded_reference, task.roots, sheets.points)
    kept = np.concatenate([mesh.crease_edges, sheets.edges[seam.on_seam(sheets)]])
    points, faces = split_longest_edges(sheets.points, sheets.faces, n_points, task.reference, roots, kept=kept)
    return points, faces, mesh.crease_edges
