"""The faces around the two ends of an edge, and whether the edge may be collapsed."""

from typing import Any, NamedTuple

from .compiled import kernel


class Stars(NamedTuple):
    """Workspace for the faces around two points; points with more faces than it holds stay.

    Attributes
    ----------
    faces, corners
        The faces counter-clockwise around the point that goes, and its corner in each (n,).
    other_faces, other_corners
        The same for the point that it goes to (n,).
    marks
        0 for each point (V,) between uses.
    """

    faces: Any
    corners: Any
    other_faces: Any
    other_corners: Any
    marks: Any


@kernel
def _mark_ring(mesh, stars, n, value):
    """Mark the points of the faces around the point that another one goes to, but not that point itself."""
    for k in range(n):
        for turn in range(1, 3):
            stars.marks[mesh.faces[stars.other_faces[k], (stars.other_corners[k] + turn) % 3]] = value


@kernel
def keeps_topology(mesh, stars, n, closed, n_other, closed_other):
    """Return whether a point can go to another one: they have no common neighbours but the ones across their edge.

    Parameters
    ----------
    mesh
        The triangulation.
    stars
        The n faces around the point that goes, and the ``n_other`` ones around the other point.
    closed, closed_other
        Whether the points are not on the boundary.

    References
    ----------
    Dey, Edelsbrunner, Guha, Nekhayev, "Topology preserving edge contraction", 1999.
    """
    gone = mesh.faces[stars.faces[0], stars.corners[0]]
    _mark_ring(mesh, stars, n_other, 1)
    common, joined = 0, 0
    for k in range(n):
        common += stars.marks[mesh.faces[stars.faces[k], (stars.corners[k] + 1) % 3]]
    if not closed:
        common += stars.marks[mesh.faces[stars.faces[n - 1], (stars.corners[n - 1] + 2) % 3]]
    _mark_ring(mesh, stars, n_other, 0)
    for k in range(n_other):
        for turn in range(1, 3):
            joined += mesh.faces[stars.other_faces[k], (stars.other_corners[k] + turn) % 3] == gone
    if not closed and not closed_other and joined == 2:  # an edge across, between two points of the boundary
        return False
    left = n + n_other - 2 * joined
    return common == joined and left >= (3 if closed_other else 1)
