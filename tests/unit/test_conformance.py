"""The conformance tests accept what the package has, and find what is wrong with a plug-in."""

from dataclasses import replace

import numpy as np
import pytest
from polygon_functions import plain, without_site_gradient

import anisomesh
from anisomesh import ConformanceError, MetricError, MetricField, NormalMetric, OptionError


@pytest.mark.parametrize("source", [anisomesh.Curvature(), anisomesh.Approximation(), anisomesh.Uniform()])
def test_built_in_metric_sources_conform(source):
    assert anisomesh.check_metric_source(source).tensors.shape[1:] == (3, 3)


@pytest.mark.parametrize(
    ("tensors", "message"),
    [
        (lambda n: np.tile(-np.eye(3), (n, 1, 1)), "positive definite"),
        (lambda n: np.eye(3), "shape"),
        (lambda n: np.full((n, 3, 3), np.nan), "not finite"),
    ],
)
def test_tensors_that_are_not_a_metric_are_found(tensors, message):
    with pytest.raises(MetricError, match=message):
        anisomesh.check_metric_source(lambda surface: MetricField(tensors=tensors(surface.n_points)))


def test_other_faults_of_metric_sources_are_found():
    with pytest.raises(MetricError, match="returned ndarray; expected a MetricField"):
        anisomesh.check_metric_source(lambda surface: np.tile(np.eye(3), (surface.n_points, 1, 1)))
    with pytest.raises(MetricError, match="points of the metric field has shape"):
        anisomesh.check_metric_source(lambda surface: replace(anisomesh.Uniform()(surface), points=np.zeros((4, 3))))
    rng = np.random.default_rng(0)
    with pytest.raises(ConformanceError, match="two calls"):
        anisomesh.check_metric_source(
            lambda surface: MetricField(tensors=np.tile(rng.uniform(1, 2) * np.eye(3), (surface.n_points, 1, 1)))
        )


def test_the_direct_embedding_conforms_and_wrong_ones_are_found():
    direct = anisomesh.Direct(iterations=2)
    anisomesh.check_embedder(direct)
    with pytest.raises(OptionError, match="off scale times the surface"):
        anisomesh.check_embedder(lambda surface, field: replace(direct(surface, field), scale=2.0))
    with pytest.raises(OptionError, match="expected an Embedding"):
        anisomesh.check_embedder(lambda surface, field: surface.points)
    with pytest.raises(OptionError, match="points of shape"):
        anisomesh.check_embedder(lambda surface, field: replace(direct(surface, field), points=surface.points[:-1]))


@pytest.mark.slow
@pytest.mark.parametrize("energy", [NormalMetric(1.0), NormalMetric(7.0), anisomesh.energy_from_kernel(plain)])
def test_energies_with_exact_gradients_conform(energy):
    assert anisomesh.check_energy_gradient(energy) < 1e-4


@pytest.mark.slow
def test_faults_of_energies_are_found():
    with pytest.raises(ConformanceError, match="off central differences"):
        anisomesh.check_energy_gradient(anisomesh.energy_from_kernel(without_site_gradient))

    class Wrong:
        def __init__(self, **changes):
            self.changes = changes

        def evaluate(self, voronoi, sites):
            value = voronoi.integrate(sites)
            return replace(value, **{name: change(getattr(value, name)) for name, change in self.changes.items()})

    for name, change, message in (
        ("mass", lambda mass: -mass, "no negative mass"),
        ("per_cell", lambda energy: 2.0 * energy, "adds up to"),
        ("gradient", lambda gradient: gradient[:, :3], "gradient has shape"),
        ("gradient", lambda gradient: np.full_like(gradient, np.nan), "gradient has a value that is not finite"),
        ("value", lambda value: np.nan, "value has a value that is not finite"),
        ("value", lambda value: np.array([value]), "value has shape"),
    ):
        with pytest.raises(ConformanceError, match=message):
            anisomesh.check_energy_gradient(Wrong(**{name: change}))
