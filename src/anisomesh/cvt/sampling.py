"""Start positions of the sites: random points of the embedded surface."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import EmbeddedPoints, Faces, FaceScalars, Sites


def sample_surface(
    points: EmbeddedPoints, faces: Faces, weights: FaceScalars, n: int, rng: np.random.Generator
) -> Sites:
    """Return n points (n, d) spread over the faces in proportion to the weights (F,), stratified.

    Parameters
    ----------
    points, faces
        The embedded surface (V, d), (F, 3).
    weights
        Expected share of the points on each face, any scale; the area of the face for a uniform sample.
    n
        Number of points.
    rng
        The only source of randomness.

    Notes
    -----
    One point per equal part of the running sum of the weights: faces that follow each other get numbers of
    points that differ from the expectation by less than one, so a spatial order of the faces makes the sample
    more even than independent draws.
    """
    edges = np.cumsum(weights)
    places = (np.arange(n) + rng.random(n)) * (edges[-1] / n)
    face = np.minimum(np.searchsorted(edges, places, side="right"), len(faces) - 1)
    u, v = rng.random(n), rng.random(n)
    root = np.sqrt(u)
    barycentric = np.stack([1.0 - root, root * (1.0 - v), root * v], axis=1)
    return np.asarray(np.einsum("nc,ncd->nd", barycentric, points[faces[face]]))
