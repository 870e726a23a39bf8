"""The arrays of a mesh that is fitted to samples of a surface.

The faces of a patch, or the ones that a change would put in their place, are rows of corners in ``Patch.triangles``.
"""

from typing import Any, NamedTuple


class Samples(NamedTuple):
    """Points of a surface, each of them on the list of one face of the mesh.

    Attributes
    ----------
    points, normals
        Points and unit normals (S, 3).
    weights
        The area that each stands for (S,).
    roots
        Symmetric square roots of the metric (S, 3, 3).
    first, following
        The first sample on the list of each face (F,), and the sample after each (S,); -1 at the end.
    owner
        The face that each sample is on (S,).
    """

    points: Any
    normals: Any
    weights: Any
    roots: Any
    first: Any
    following: Any
    owner: Any


class Patch(NamedTuple):
    """Workspace for a patch of faces.

    Attributes
    ----------
    faces, corners
        Faces, and the corner of each that is the point which they surround (n,).
    triangles
        Corners of the triangles that are looked at (n, 3).
    before, normals, sums
        Normals of triangles before a change, of the ones that are looked at, and sums over their samples (n, 3).
    members, owners, trial
        Samples of the faces, and the triangle that each is nearest to, for the best change and for one on trial (m,).
    other_faces, other_corners
        Faces and corners of a second point (n,).
    marks
        0 for each point (V,) between uses.
    """

    faces: Any
    corners: Any
    triangles: Any
    before: Any
    normals: Any
    sums: Any
    members: Any
    owners: Any
    trial: Any
    other_faces: Any
    other_corners: Any
    marks: Any


class Fit(NamedTuple):
    """A mesh and the samples that it is fitted to.

    Attributes
    ----------
    mesh
        The mesh; sides with a label are not changed.
    samples
        The samples.
    roots
        The metric of each face (F, 3, 3), as a square root.
    face_at
        One of the faces at each point (V,).
    freedom
        0 for points that stay, 1 for points on creases, 2 for others (V,).
    active
        1 for points around which something has changed (V,): others are where they are best.
    patch
        Workspace.
    place
        Workspace for a point (3,).
    """

    mesh: Any
    samples: Any
    roots: Any
    face_at: Any
    freedom: Any
    active: Any
    patch: Any
    place: Any
