"""The conformance tests accept what the package has, and find what is wrong with a plug-in."""

from dataclasses import replace

import numba
import numpy as np
import pytest
from polygon_functions import plain, without_site_gradient

import anisomesh
from anisomesh import ConformanceError, MetricError, MetricField, NormalMetric, OptionError
from anisomesh.shapes.analytic import torus


class Wrong:
    def __init__(self, **changes):
        self.changes = changes

    def evaluate(self, voronoi, sites):
        value = voronoi.integrate(sites)
        return replace(value, **{name: change(getattr(value, name)) for name, change in self.changes.items()})


ENERGY_FAULTS = [
    ("mass", lambda mass: -mass, "no negative mass"),
    ("mass", lambda mass: None, "mass of the energy"),
    ("per_cell", lambda energy: energy[:-1], "per_cell of the energy has shape"),
    ("gradient", lambda gradient: gradient[:, :3], "gradient of the energy has shape"),
    (
        "gradient",
        lambda gradient: np.full_like(gradient, np.nan),
        "gradient of the energy has a number",
    ),
    ("gradient", lambda gradient: gradient + 0j, "real numbers"),
    ("value", lambda value: 1e200, "value of the energy has a number that is not finite or above"),
    ("value", lambda value: np.nan, "value of the energy has a number that is not finite"),
    ("value", lambda value: np.array([value]), "value of the energy has shape"),
]


@pytest.mark.parametrize("source", [anisomesh.Curvature(), anisomesh.Approximation(), anisomesh.Uniform()])
def test_built_in_metric_sources_conform(source):
    assert anisomesh.check_metric_source(source).tensors.shape[1:] == (3, 3)


@pytest.mark.parametrize(
    ("tensors", "message"),
    [
        (lambda n: np.tile(-np.eye(3), (n, 1, 1)), "positive definite"),
        (lambda n: np.eye(3), "shape"),
        (lambda n: np.full((n, 3, 3), np.nan), "not finite"),
        (lambda n: np.tile((1 + 1j) * np.eye(3), (n, 1, 1)), "real numbers: type complex128"),
        (lambda n: np.tile(1e300 * np.eye(3), (n, 1, 1)), "above 1e"),
        (lambda n: np.tile(1e-300 * np.eye(3), (n, 1, 1)), "no entry above 1e-100"),
        (lambda n: np.tile(np.diag([1e14, 1.0, 1.0]), (n, 1, 1)), "nearly singular"),
        (lambda n: None, "cannot be read as real numbers|has shape"),
    ],
)
def test_tensors_that_are_not_a_metric_are_found(tensors, message):
    with pytest.raises(MetricError, match=message):
        anisomesh.check_metric_source(lambda surface: MetricField(tensors=tensors(surface.n_points)))


def test_tensors_in_lists_and_single_precision_are_a_metric():
    for form in (list, lambda array: array.astype(np.float32)):
        field = anisomesh.check_metric_source(
            lambda surface, form=form: MetricField(tensors=form(np.tile(np.eye(3), (surface.n_points, 1, 1))))
        )
        assert field.tensors.dtype == np.float64


def test_what_is_not_a_plug_in_is_refused():
    with pytest.raises(ConformanceError, match="callable"):
        anisomesh.check_metric_source(np.eye(3))
    with pytest.raises(OptionError, match="is a class; expected an object"):
        anisomesh.check_metric_source(anisomesh.Curvature)
    with pytest.raises(OptionError, match="is a class; expected an object"):
        anisomesh.check_embedder(anisomesh.Direct)
    for wrong in (None, "direct"):
        with pytest.raises(ConformanceError, match="an embedder is callable"):
            anisomesh.check_embedder(wrong)
    with pytest.raises(ConformanceError, match="energy is None"):
        anisomesh.check_energy_gradient(None)
    with pytest.raises(OptionError, match="directions = 0"):
        anisomesh.check_energy_gradient(NormalMetric(7.0), directions=0)
    with pytest.raises(OptionError, match="is a class; expected an object"):
        anisomesh.check_energy_gradient(NormalMetric)
    with pytest.raises(OptionError, match="evaluate"):
        anisomesh.check_energy_gradient(7.0)


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


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"points": lambda points: points * 1e200}, "points of the metric field has a number"),
        ({"points": lambda points: points * 0.0}, "change the size of the surface by a factor of 0"),
        ({"points": lambda points: points[:, :2]}, "points of the metric field has shape"),
        ({"extra": lambda points: points * 1e150}, "extra of the metric field has a number"),
        ({"extra": lambda points: points[:, 0]}, r"extra of the metric field has shape .*; expected \(\d+, k\)"),
        ({"extra": lambda points: [[1.0], [1.0, 2.0]]}, "extra of the metric field cannot be read"),
        ({"noise": lambda points: "a"}, "noise of the metric field = 'a'; expected a number"),
        ({"noise": lambda points: np.nan}, "noise of the metric field is nan"),
        ({"noise": lambda points: 10**400}, "smaller number"),
    ],
)
def test_other_fields_of_a_metric_that_are_wrong_are_found(changes, message):
    def source(surface):
        field = anisomesh.Uniform()(surface)
        return replace(field, **{name: change(surface.points) for name, change in changes.items()})

    with pytest.raises(MetricError, match=message):
        anisomesh.check_metric_source(source)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"scale": np.inf}, "scale = inf"),
        ({"scale": 10**400}, "smaller number"),
        ({"scale": 1e-300}, "scale = 1e-300"),
        ({"residual": np.nan}, "residual = nan"),
        ({"iterations": None}, "iterations of the embedding = None"),
        ({"status": "converged"}, "status = 'converged'; expected EmbeddingStatus"),
        ({"achieved_mean": None}, "achieved_mean of the embedding = None"),
    ],
)
def test_wrong_figures_of_an_embedding_are_found(changes, message):
    def embedder(surface, field):
        found = anisomesh.precomputed_embedding(surface, 0.1 * surface.point_normals, field.tensors)
        if "achieved_mean" in changes:
            return replace(found, stretch=replace(found.stretch, **changes))
        return replace(found, **changes)

    with pytest.raises(OptionError, match=message):
        anisomesh.check_embedder(embedder)


@pytest.mark.parametrize("extra", [None, "a", [[1.0], [1.0, 2.0]], np.ones(3), np.ones((4, 2)) + 1j])
def test_extra_coordinates_that_do_not_fit_are_refused(extra):
    with pytest.raises(OptionError, match=r"^extra "):
        anisomesh.precomputed_embedding(anisomesh.sample("ring"), extra, np.tile(np.eye(3), (4, 1, 1)))


@pytest.mark.parametrize(
    "make",
    [
        lambda: NormalMetric("a"),
        lambda: NormalMetric(None),
        lambda: anisomesh.Direct(iterations=1.5),
        lambda: anisomesh.Direct(extra_dimensions="a"),
        lambda: anisomesh.Direct(tolerance=np.nan),
        lambda: anisomesh.Curvature(limits=3),
        lambda: anisomesh.Curvature(limits=("a", "b")),
        lambda: anisomesh.Curvature(radius=2.5),
        lambda: anisomesh.Curvature(radius=100_000),
        lambda: anisomesh.Approximation(smoothing=None),
        lambda: anisomesh.Neural(3),
        lambda: anisomesh.Hybrid(denoise="x"),
    ],
)
def test_wrong_parameters_of_built_in_objects_are_refused(make):
    with pytest.raises(OptionError):
        make()


@pytest.mark.slow
def test_a_polygon_function_that_does_not_compile_is_refused():
    @numba.njit
    def without_value(vertices, site, normal, vertex_gradient, site_gradient):
        pass

    with pytest.raises(OptionError, match="cannot be compiled for its five arguments"):
        anisomesh.check_energy_gradient(anisomesh.energy_from_kernel(without_value))


def test_the_direct_embedding_conforms_and_wrong_ones_are_found():
    direct = anisomesh.Direct(iterations=2)
    anisomesh.check_embedder(direct)
    with pytest.raises(OptionError, match="off scale times the surface"):
        anisomesh.check_embedder(lambda surface, field: replace(direct(surface, field), scale=2.0))
    with pytest.raises(OptionError, match="expected an Embedding"):
        anisomesh.check_embedder(lambda surface, field: surface.points)
    with pytest.raises(OptionError, match="points of the embedding has shape"):
        anisomesh.check_embedder(lambda surface, field: replace(direct(surface, field), points=surface.points[:-1]))
    with pytest.raises(OptionError, match="stretch = None; expected StretchStatistics"):
        anisomesh.check_embedder(lambda surface, field: replace(direct(surface, field), stretch=None))


@pytest.mark.slow
@pytest.mark.parametrize("energy", [NormalMetric(1.0), NormalMetric(7.0), anisomesh.energy_from_kernel(plain)])
def test_energies_with_exact_gradients_conform(energy):
    assert anisomesh.check_energy_gradient(energy) < 1e-4


@pytest.mark.slow
def test_faults_of_energies_are_found():
    with pytest.raises(ConformanceError, match="off central differences"):
        anisomesh.check_energy_gradient(anisomesh.energy_from_kernel(without_site_gradient))

    for name, change, message in ENERGY_FAULTS:
        with pytest.raises(OptionError, match=message):
            anisomesh.check_energy_gradient(Wrong(**{name: change}))
    with pytest.raises(ConformanceError, match="adds up to"):
        anisomesh.check_energy_gradient(Wrong(per_cell=lambda energy: 2.0 * energy))
    with pytest.raises(ConformanceError, match="every mass is 0"):
        anisomesh.check_energy_gradient(Wrong(mass=np.zeros_like))


MASS_FAULT = ("mass", lambda mass: 1e-300 * mass, "a site is not finite or far beyond the surface")


@pytest.mark.parametrize(("name", "change", "message"), [*ENERGY_FAULTS, MASS_FAULT])
def test_a_remesh_ends_at_the_first_wrong_value_of_an_energy(name, change, message):
    with pytest.raises(OptionError, match=message):
        anisomesh.remesh(torus(1.0, 0.3, 24, 12), n_vertices=60, embedding="direct", energy=Wrong(**{name: change}))
