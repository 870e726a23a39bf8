"""From a delta complex to a simplicial complex: no edge from a point to itself, no two edges with the same ends."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import EmbeddedPoints, Faces
from anisomesh.delaunay.dual import Dual

MAX_SPLIT_ROUNDS = 20  # heuristic; two are enough almost always


class DeltaComplex:
    """Triangles with numbered edges, several of which may join the same two points (Hatcher 2002, section 2.1).

    Attributes
    ----------
    faces, face_edges
        Points of each triangle and the edge opposite each of them, rows of 3.
    points
        Positions of all points.
    edge_points
        A position on every edge that has one of its own; new edges take their middle.
    """

    def __init__(self, dual: Dual) -> None:
        self.faces: list[list[int]] = dual.faces.tolist()
        self.face_edges: list[list[int]] = dual.face_edges.tolist()
        self.points: list[npt.NDArray[np.float64]] = list(dual.points)
        self.edge_points: dict[int, npt.NDArray[np.float64]] = dict(enumerate(dual.edge_points))
        self._n_edges = len(dual.edge_points)
        self._faces_at: dict[int, list[int]] = {}
        for face, edges in enumerate(self.face_edges):
            for edge in edges:
                self._faces_at.setdefault(edge, []).append(face)

    def surplus_edges(self) -> list[int]:
        """Return the edges that no simplicial complex has: from a point to itself, or parallel to another one."""
        edges = np.array(self.face_edges).ravel()
        ends = np.sort(np.array(self.faces)[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
        edges, first = np.unique(edges, return_index=True)
        ends = ends[first]
        kept = np.zeros(len(edges), dtype=bool)
        kept[np.unique(ends, axis=0, return_index=True)[1]] = True
        return [int(edge) for edge in edges[~kept | (ends[:, 0] == ends[:, 1])]]

    def split(self, edge: int) -> None:
        """Put a point on an edge and join it to the points opposite."""
        middle = len(self.points)
        face = self._faces_at[edge][0]
        corner = self.face_edges[face].index(edge)
        ends = [self.points[self.faces[face][(corner + k) % 3]] for k in (1, 2)]
        self.points.append(self.edge_points.get(edge, 0.5 * (ends[0] + ends[1])))
        halves = [self._new_edge(), self._new_edge()]
        for order in (halves, halves[::-1]):
            if not self._faces_at[edge]:
                break
            self._split_face(self._faces_at[edge].pop(0), edge, middle, order)
        del self._faces_at[edge]

    def _split_face(self, face: int, edge: int, middle: int, halves: list[int]) -> None:
        """Split a face a, x, y, whose side x y is the edge, into a, x, m and a, m, y."""
        c = self.face_edges[face].index(edge)
        a, x, y = (self.faces[face][(c + k) % 3] for k in range(3))
        _, side_ya, side_ax = (self.face_edges[face][(c + k) % 3] for k in range(3))
        between, new = self._new_edge(), len(self.faces)
        self.faces[face], self.face_edges[face] = [a, x, middle], [halves[0], between, side_ax]
        self.faces.append([a, middle, y])
        self.face_edges.append([halves[1], side_ya, between])
        self._faces_at[side_ya].remove(face)
        self._faces_at[side_ya].append(new)
        self._faces_at[between] = [face, new]
        self._faces_at[halves[0]].append(face)
        self._faces_at[halves[1]].append(new)

    def _new_edge(self) -> int:
        self._n_edges += 1
        self._faces_at[self._n_edges - 1] = []
        return self._n_edges - 1


def simplicial_mesh(dual: Dual) -> tuple[EmbeddedPoints, Faces, bool]:
    """Return points (V, d) and faces (F, 3) of the dual after splitting edges until it is a simplicial complex.

    Returns
    -------
    points, faces
        The first points are the points of the dual. The faces, glued where they share two points, make up the same
        surface as the triangles glued along dual edges.
    done
        Whether no surplus edge is left.

    Notes
    -----
    If every cell is a disk, the dual is a delta complex: two triangles may share two points without being neighbours,
    and a point may be its own neighbour. A point on every surplus edge removes it, as a subdivision would, but only
    where it is needed; a split makes surplus edges only next to a point with one or two triangles, so few rounds are
    enough.
    """
    mesh = DeltaComplex(dual)
    for _ in range(MAX_SPLIT_ROUNDS):
        surplus = mesh.surplus_edges()
        if not surplus:
            break
        for edge in surplus:
            mesh.split(edge)
    return np.array(mesh.points), np.array(mesh.faces, dtype=np.int32), not mesh.surplus_edges()
