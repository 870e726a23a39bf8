"""The distance from points to the edges of a mesh."""

import igl
import numpy as np


def distance_to_edges(points, surface):
    """Return the distance (n,) of points (n, 3) to the nearest point on an edge."""
    tree = igl.AABB()
    edges = surface.edges.astype(np.int64)
    tree.init(surface.points, edges)
    return np.sqrt(tree.squared_distance(surface.points, edges, np.ascontiguousarray(points, dtype=float))[0])
