"""Which edges can be collapsed without a change of topology."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from anisomesh.mesh.surface import Surface


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
