"""Conformance tests for metric sources, embedders and energies of your own."""

from __future__ import annotations

import numpy as np

from anisomesh._values import whole_number
from anisomesh.cvt.energy import Energy, evaluate_energy
from anisomesh.embedding.embedder import Embedder, checked_embedding
from anisomesh.errors import AnisomeshError
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.mesh.geometry import unit_frame
from anisomesh.mesh.surface import Surface
from anisomesh.metric.field import MetricField, MetricSource, checked_field
from anisomesh.metric.sources import Curvature
from anisomesh.options import RemeshOptions
from anisomesh.shapes.analytic import ellipsoid, open_patch, torus
from anisomesh.voronoi.restricted import RestrictedVoronoi

_STEP = 1e-6  # of the site spacing, for central differences: error about its square, plus rounding over it
_GRADIENT_TOLERANCE = 1e-4  # relative, of directional derivatives: far above both, far below a missing term
_SUM_TOLERANCE = 1e-9  # relative, of the energies of the cells against the whole


class ConformanceError(AnisomeshError, AssertionError):
    """A plug-in does not do what its protocol says."""


def check_metric_source(source: MetricSource, surface: Surface | None = None) -> MetricField:
    """Check that a metric source can be used in ``remesh``; return its field on the surface checked last.

    Parameters
    ----------
    source
        The metric source.
    surface
        A surface at bounding-box diagonal 1; by default a closed and an open one are tried.

    Raises
    ------
    MetricError
        If the result is not a valid :class:`~anisomesh.metric.field.MetricField`.
    OptionError
        If a class is given in place of an object.
    ConformanceError
        If the source is not callable, or two calls give different results.
    """
    if not callable(source):
        raise ConformanceError(f"a metric source is callable with a surface, and {source!r} is not")
    RemeshOptions(metric=source)
    for sample in [surface] if surface is not None else _samples():
        field, again = (checked_field(source(sample), sample) for _ in range(2))
        _expect_equal("tensors", field.tensors, again.tensors)
        _expect_equal("corner_tensors", field.corner_tensors, again.corner_tensors)
    return field


def check_embedder(embedder: Embedder, surface: Surface | None = None, source: MetricSource | None = None) -> None:
    """Check that an embedder can be used in ``remesh``.

    Parameters
    ----------
    embedder
        The embedder.
    surface
        A surface at bounding-box diagonal 1; by default a closed and an open one are tried.
    source
        The metric that is embedded; :class:`~anisomesh.metric.sources.Curvature` by default.

    Raises
    ------
    OptionError
        If the result is not a valid :class:`~anisomesh.embedding.base.Embedding` of the surface.
    ConformanceError
        If the embedder is not callable, or two calls give different results.
    """
    if not callable(embedder):
        raise ConformanceError(f"an embedder is callable with a surface and a metric field, and {embedder!r} is not")
    RemeshOptions(embedding=embedder)
    for sample in [surface] if surface is not None else _samples():
        field = checked_field((source or Curvature())(sample), sample)
        embedding = checked_embedding(embedder(sample, field), sample)
        _expect_equal("points", embedding.points, checked_embedding(embedder(sample, field), sample).points)


def check_energy_gradient(
    energy: Energy, voronoi: RestrictedVoronoi | None = None, *, n_sites: int = 60, directions: int = 8, seed: int = 0
) -> float:
    """Check the gradient of an energy against central differences; return the largest relative error.

    Parameters
    ----------
    energy
        The energy.
    voronoi
        Diagrams on an embedded surface; by default of a torus with its normals as extra coordinates, d = 6.
    n_sites
        Number of random sites.
    directions
        Number of random directions in which derivatives are compared.
    seed
        Seed of sites and directions.

    Raises
    ------
    OptionError
        If the result is not an :class:`~anisomesh.voronoi.restricted.EnergyValue`, a shape is wrong, a number is not
        finite, or a mass is negative.
    ConformanceError
        If every mass is 0, the energies of the cells do not add up, or a derivative is off by more than 1e-4 of the
        size of the gradient.

    Notes
    -----
    Masses only scale the steps of the optimisation: wrong ones make it slow, not wrong, and are not found here.
    """
    if energy is None:
        raise ConformanceError("the energy is None; expected an object with evaluate(voronoi, sites)")
    RemeshOptions(energy=energy)
    for name, value, low in (("n_sites", n_sites, 2), ("directions", directions, 1), ("seed", seed, 0)):
        whole_number(name, value, low)
    rng = np.random.default_rng(seed)
    voronoi = voronoi or RestrictedVoronoi(_with_normals(torus(n_major=24, n_minor=12)))
    embedded = voronoi.embedded
    spacing = embedded.site_spacing(n_sites)
    sites = embedded.points[rng.choice(len(embedded.points), n_sites, replace=n_sites > len(embedded.points))]
    sites = sites + 0.1 * spacing * rng.normal(size=sites.shape)
    here = evaluate_energy(energy, voronoi, sites)
    if not (here.mass > 0.0).any():
        raise ConformanceError("every mass is 0; expected the weight of each cell, such as its area")
    if abs(here.per_cell.sum() - here.value) > _SUM_TOLERANCE * np.abs(here.per_cell).sum():
        raise ConformanceError(f"per_cell adds up to {here.per_cell.sum()}, and value is {here.value}")
    worst = 0.0
    for _ in range(directions):
        direction = rng.normal(size=sites.shape)
        step = _STEP * spacing
        up, down = (evaluate_energy(energy, voronoi, sites + sign * step * direction).value for sign in (1.0, -1.0))
        expected, found = (up - down) / (2.0 * step), float((here.gradient * direction).sum())
        size = max(float(np.linalg.norm(here.gradient)), np.finfo(np.float64).tiny)
        worst = max(worst, abs(found - expected) / size)
    if worst > _GRADIENT_TOLERANCE:
        raise ConformanceError(f"the gradient is off central differences by {worst:.2g} of its size")
    return worst


def _samples() -> list[Surface]:
    """Return a closed and an open surface at bounding-box diagonal 1."""
    surfaces = [ellipsoid(subdivisions=3), open_patch(lambda x, y: 0.3 * x * x - 0.2 * y * y, 12)]
    return [surface.with_points(unit_frame(surface.points).to_unit(surface.points)) for surface in surfaces]


def _with_normals(surface: Surface) -> EmbeddedSurface:
    return EmbeddedSurface(surface, np.concatenate([surface.points, 0.5 * surface.point_normals], axis=1))


def _expect_equal(name: str, first: object, second: object) -> None:
    if not np.array_equal(np.asarray(first), np.asarray(second)):
        raise ConformanceError(f"two calls on the same surface give different {name}; results must be reproducible")
