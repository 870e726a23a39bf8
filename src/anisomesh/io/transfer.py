"""Everything that a mesh carries, on another mesh of the same surface."""

from __future__ import annotations

from typing import Any

from anisomesh.attributes.model import Mesh
from anisomesh.attributes.transfer import transferred
from anisomesh.io.meshes import mesh_of


def transfer_attributes(source: Any, target: Any) -> Mesh:
    """Return a surface with everything that a mesh of about the same surface carries.

    Parameters
    ----------
    source
        The mesh: a :class:`Mesh`, the name of a file, or an object of trimesh, meshio or PyVista. It need be neither
        manifold nor oriented; where it is thin, the sheet that faces the way of the target is taken.
    target
        A surface near the one of the mesh, in the same units: a :class:`Surface`, or what ``source`` can be. What it
        carries itself is not looked at. If it is the same surface, everything is returned unchanged.

    Returns
    -------
    Mesh
        The target. Point data with different values at coincident points, as on seams of texture coordinates in files
        that have no corner data, are corner data of it.

    Raises
    ------
    MeshFileError
        If a file cannot be read.
    MeshError
        If an object is not a mesh.

    Notes
    -----
    - *Regions.* A face is in the part of the source that most of it is on, judged at seven places inside it with the
      weights of a quadrature.
    - *Point data* are evaluated at the closest point, on the parts of the faces around the target point: real numbers
      and colours between the corners of the triangle there, bools, integers and strings at its nearest corner.
    - *Face data.* Real numbers come from the source face closest to the centroid; of others the most frequent ones at
      the seven places are taken.
    - *Corner data* are continuous on charts. A face is on the chart that most of the seven places are on, and the
      places of its corners are reached by straight walks from one of these within the chart: no value beyond a seam
      has a part in it.
    - *Features* are the edges of the target along the ones of the source, *fixed points* the points of the target at
      the ones of the source; they are in the regions of the closest of these. *Fixed faces* are the faces of the target
      with the same corners.
    """
    return transferred(mesh_of(source), mesh_of(target).surface)
