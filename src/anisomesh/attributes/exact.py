"""What a mesh carries, taken over value by value where faces and points of it are the same in another mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from anisomesh.attributes.charts import Joints, with_seams_at_corners
from anisomesh.attributes.model import Array, Ints, Mesh, Regions
from anisomesh.mesh.topology import edge_keys


def with_first_rows(target: Mesh, source: Mesh, points: Ints, faces: Ints, distance: float = 0.0) -> Mesh:
    """Return a mesh whose first points and faces carry exactly what points and faces of another mesh do.

    Parameters
    ----------
    target
        The mesh, with everything that ``source`` carries.
    source
        The other mesh.
    points, faces
        Its points (n,) and faces (m,) that are the first ones of the target, up to the order of the corners.
    distance
        Distance, in model units, up to which points of the source are the same.
    """
    joints = Joints(source.surface, distance)
    source = with_seams_at_corners(source, Joints(source.surface))
    n_points, n_faces = len(points), len(faces)
    own = joints.place[points][target.surface.faces[:n_faces]]
    given = joints.place[source.surface.faces[faces]]
    corner = np.argmax(own[:, :, None] == given[:, None, :], axis=2)

    def merged(values: Array, exact: Array) -> Array:
        values = values.astype(np.result_type(values, exact))
        values[: len(exact)] = exact
        return values

    def number(places: Ints) -> Ints:
        table = np.full(source.surface.n_points, -1)
        table[joints.place[points]] = np.arange(n_points)
        return np.asarray(table[joints.place[places]])

    known = edge_keys(target.surface.edges)
    own_features = number(source.features)
    kept = np.flatnonzero((own_features >= 0).all(axis=1))
    kept = kept[np.isin(edge_keys(own_features[kept]), known)]
    features = np.concatenate([target.features, own_features[kept]])
    once = np.unique(edge_keys(features), return_index=True)[1]
    return replace(
        target,
        point_data={k: merged(v, source.point_data[k][points]) for k, v in target.point_data.items()},
        face_data={k: merged(v, source.face_data[k][faces]) for k, v in target.face_data.items()},
        corner_data={
            k: merged(v, source.corner_data[k][faces[:, None], corner]) for k, v in target.corner_data.items()
        },
        regions={
            k: Regions(merged(v.labels, source.regions[k].labels[faces]), v.names) for k, v in target.regions.items()
        },
        features=features[once],
        feature_regions={
            k: Regions(np.concatenate([v.labels, source.feature_regions[k].labels[kept]])[once], v.names)
            for k, v in target.feature_regions.items()
        },
    )
