"""Transfer of everything that a mesh carries to another mesh of the same surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anisomesh.attributes.blend import Blend, blend_skin, skin_sets
from anisomesh.attributes.charts import Joints, with_seams_at_corners
from anisomesh.attributes.lines import same_faces, transfer_fixed_points, transfer_lines
from anisomesh.attributes.located import Located, majority
from anisomesh.attributes.model import Array, Ints, Mesh, Regions
from anisomesh.attributes.places import Floats
from anisomesh.mesh.closest_points import ClosestPoints
from anisomesh.mesh.surface import Surface


def transferred(source: Mesh, target: Surface) -> Mesh:
    """Return a surface with everything that a mesh of about the same surface carries.

    Parameters and result are the ones of :func:`~anisomesh.io.transfer.transfer_attributes`.
    """
    own = source.surface
    if np.array_equal(own.points, target.points) and np.array_equal(own.faces, target.faces):
        return replace(source, surface=target)
    given, source = source, _in_order(with_seams_at_corners(source, Joints(own)))
    located = Located(source, target)
    features, line = transfer_lines(own.points[source.features], target)
    fixed_points, place = transfer_fixed_points(own.points[source.fixed_points], target)
    return Mesh(
        surface=target,
        point_data=_point_data(located) if source.point_data else {},
        face_data={name: _face_values(values, located) for name, values in source.face_data.items()},
        corner_data={name: _corner_values(name, values, located) for name, values in source.corner_data.items()},
        regions={
            name: Regions(source.part_labels[name][located.parts], regions.names)
            for name, regions in source.regions.items()
        },
        features=features,
        fixed_points=fixed_points,
        fixed_faces=same_faces(own, given.fixed_faces, target),
        feature_regions={name: Regions(d.labels[line], d.names) for name, d in source.feature_regions.items()},
        fixed_point_regions={name: Regions(d.labels[place], d.names) for name, d in source.fixed_point_regions.items()},
        materials=source.materials,
    )


def _in_order(mesh: Mesh) -> Mesh:
    """Return a mesh with its faces in the order of their points, so that ties do not depend on the order given."""
    order = np.lexsort(np.sort(mesh.surface.faces, axis=1).T)
    return replace(
        mesh,
        surface=Surface(mesh.surface.points, mesh.surface.faces[order]),
        face_data={name: values[order] for name, values in mesh.face_data.items()},
        corner_data={name: values[order] for name, values in mesh.corner_data.items()},
        fixed_faces=np.flatnonzero(np.isin(order, mesh.fixed_faces)),
        regions={name: Regions(regions.labels[order], regions.names) for name, regions in mesh.regions.items()},
    )


def _point_data(located: Located) -> dict[str, Array]:
    """Return the point data at the points of the target."""
    source = located.source
    facet, weights = located.points
    corners = source.surface.faces[facet]
    nearest = _nearest_corners(source.surface, facet, located.target.points)
    data = {}
    for name, values in source.point_data.items():
        data[name] = Blend(name, values).at(values[corners], weights, nearest)
    pairs = skin_sets(source.point_data)
    if pairs:
        joints, shares = (np.concatenate([source.point_data[pair[k]] for pair in pairs], axis=1) for k in (0, 1))
        blended = blend_skin(joints[corners], shares[corners], weights)
        ends = np.cumsum([source.point_data[name].shape[1] for name, _ in pairs])[:-1]
        for k in (0, 1):
            for pair, part in zip(pairs, np.split(blended[k], ends, axis=1), strict=True):
                data[pair[k]] = part.astype(source.point_data[pair[k]].dtype)
    return data


def _face_values(values: Array, located: Located) -> Array:
    """Return the values (F', ...) of face data (F, ...) on the target."""
    if values.dtype.kind in "fc":
        return np.asarray(values[located.samples[:, 0]])
    rows, code = np.unique(values.reshape(len(values), -1), axis=0, return_inverse=True)
    chosen = majority(code.reshape(-1)[located.samples])
    return np.asarray(rows[chosen].reshape(-1, *values.shape[1:]))


def _corner_values(name: str, values: Array, located: Located) -> Array:
    """Return the values (F', 3, ...) of corner data (F, 3, ...) on the target."""
    source, target = located.source.surface, located.target
    facet, weights = located.corners(located.joints.continuous(values))
    nearest = _nearest_corners(source, facet, target.points[target.faces.ravel()])
    blended = Blend(name, values).at(values[facet], weights, nearest)
    return np.asarray(blended.reshape(target.n_faces, 3, *values.shape[2:]))


def _nearest_corners(surface: Surface, facet: Ints, points: Floats) -> Ints:
    """Return the corner (n,) of each face (n,) that is nearest to a point (n, 3)."""
    offsets = surface.points[surface.faces[facet]] - points[:, None]
    return np.asarray(np.argmin((offsets**2).sum(axis=2), axis=1))


def oriented_as(mesh: Mesh, surface: Surface) -> Mesh:
    """Return a mesh with its faces reversed where a surface with the same faces has them reversed."""
    own = mesh.surface
    closest = ClosestPoints(surface).locate(own.points[own.faces].mean(axis=1))[0]
    opposed = np.einsum("nx,nx->n", own.face_normals, surface.face_normals[closest]) < 0.0
    faces = own.faces.copy()
    faces[opposed] = faces[opposed][:, [0, 2, 1]]
    corner_data = {name: values.copy() for name, values in mesh.corner_data.items()}
    for values in corner_data.values():
        values[opposed] = values[opposed][:, [0, 2, 1]]
    return replace(mesh, surface=Surface(own.points, faces), corner_data=corner_data)
