"""Start positions of the sites: random points of the embedded surface."""

from __future__ import annotations

import numpy as np

from anisomesh._arrays import EmbeddedPoints, Faces, FaceScalars, Sites
from anisomesh.cvt.energy import Energy, evaluate_energy
from anisomesh.voronoi.restricted import RestrictedVoronoi


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


def resample_by_energy(voronoi: RestrictedVoronoi, sites: Sites, energy: Energy, rng: np.random.Generator) -> Sites:
    """Return as many new sites (S, d), denser where the cells of these sites have more energy for their size.

    Parameters
    ----------
    voronoi
        The diagram over the embedded surface.
    sites
        Evenly spread sites (S, d), with cells of about equal area.
    energy
        The energy; the sharper a normal metric, the more the sites gather where the surface bends.
    rng
        The only source of randomness.

    Notes
    -----
    In an optimal tessellation cells have equal energies (Gersho 1979), but descent moves sites only locally. The
    density is the area times the square root of (energy / area^2) of the cell, which is constant where the plain
    energy dominates and grows where the surface leaves the tangent plane within a cell.
    """
    value = evaluate_energy(energy, voronoi, sites)
    diagram, embedded = voronoi.diagram(sites), voronoi.embedded
    area = value.mass
    if embedded.density is not None:
        area = np.bincount(diagram.site, diagram.fractions * embedded.face_areas[diagram.facet], minlength=len(sites))
    density = np.sqrt(np.maximum(value.per_cell, 0.0)) / np.maximum(area, np.finfo(np.float64).tiny)
    share = diagram.fractions * density[diagram.site]
    weights = np.bincount(diagram.facet, share, minlength=embedded.surface.n_faces) * embedded.face_areas
    return sample_surface(embedded.points, embedded.faces, weights, len(sites), rng)
