"""Lloyd's algorithm and L-BFGS: direction, descent, convergence."""

import naive_rvd as naive
import numpy as np
import pytest

import anisomesh
from anisomesh.cvt import lbfgs
from anisomesh.cvt.energy import NormalMetric
from anisomesh.cvt.lbfgs import DescentOptions, Status
from anisomesh.cvt.lloyd import lloyd
from anisomesh.cvt.sampling import sample_surface
from anisomesh.mesh.embedded_surface import EmbeddedSurface
from anisomesh.shapes import analytic as shapes
from anisomesh.voronoi.restricted import EnergyValue, RestrictedVoronoi


def start(n=40, seed=0, surface=None):
    surface = surface or shapes.sphere(2)
    voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(surface))
    return voronoi, naive.random_sites(surface.points, surface.faces, n, np.random.default_rng(seed))


def fake(gradient, mass):
    return EnergyValue(value=1.0, gradient=gradient, mass=mass, per_cell=np.ones(len(mass)))


def minimise(voronoi, sites, sharpness, on_iteration=None, **bounds):
    options = DescentOptions(**bounds)
    return lbfgs.minimise(voronoi, sites, NormalMetric(sharpness), options=options, on_iteration=on_iteration)


@pytest.mark.parametrize("with_blocks", [False, True])
@pytest.mark.parametrize("n_pairs", [0, 1, 2, 5])
def test_direction_matches_the_dense_recursion(n_pairs, with_blocks):
    rng = np.random.default_rng(n_pairs)
    n, d = 4, 5
    mass = rng.uniform(0.5, 2.0, n)
    root = rng.normal(size=(n * d, n * d))
    hessian = root @ root.T + np.eye(n * d)
    inverse = np.diag(np.repeat(1.0 / (2.0 * mass), d))
    blocks = None
    if with_blocks:
        factors = rng.normal(size=(n, 3, 3))
        blocks = factors @ factors.transpose(0, 2, 1) + np.eye(3)
        for k in range(n):
            inverse[d * k : d * k + 3, d * k : d * k + 3] = blocks[k] / (2.0 * mass[k])
    steps = rng.normal(size=(n_pairs, n * d))
    if n_pairs:
        change = hessian @ steps[-1]
        inverse *= (change @ steps[-1]) / (change @ inverse @ change)
    learnt = lbfgs._InverseHessian(n_pairs, blocks)
    for step in steps:
        change = hessian @ step
        rho = 1.0 / (change @ step)
        left = np.eye(n * d) - rho * np.outer(step, change)
        inverse = left @ inverse @ left.T + rho * np.outer(step, step)
        learnt.learn(step.reshape(n, d), change.reshape(n, d))
    gradient = rng.normal(size=(n, d))
    direction, slope = learnt.descent(fake(gradient, mass))
    assert slope == pytest.approx(float((gradient * direction).sum()))
    np.testing.assert_allclose(direction.ravel(), -inverse @ gradient.ravel(), rtol=1e-10, atol=1e-12)
    if n_pairs:
        # secant equation: the last change of the gradient is mapped to the last step
        last, _ = learnt.descent(fake((hessian @ steps[-1]).reshape(n, d), mass))
        np.testing.assert_allclose(last.ravel(), -steps[-1], rtol=1e-9, atol=1e-10)


def test_direction_without_pairs_is_lloyds_step():
    voronoi, sites = start()
    value = voronoi.integrate(sites, 1.0)
    direction, _ = lbfgs._InverseHessian(5, None).descent(value)
    np.testing.assert_allclose(sites + direction, lloyd(voronoi, sites, 1), rtol=0, atol=1e-14)


def test_sites_with_empty_cells_stay():
    voronoi, sites = start(20)
    sites[3] = sites[7]
    moved = lloyd(voronoi, sites, 1)
    np.testing.assert_array_equal(moved[3], sites[3])
    assert not np.array_equal(moved[7], sites[7])


@pytest.mark.parametrize("seed", range(3))
def test_lloyd_never_raises_the_plain_energy_and_moves_sites_to_centroids(seed):
    voronoi, sites = start(seed=seed)
    _, mass, moment = naive.energy(voronoi.embedded.points, voronoi.embedded.faces, sites, 1.0)
    np.testing.assert_allclose(lloyd(voronoi, sites, 1), moment / mass[:, None], atol=1e-11)
    energies = []
    last = lloyd(voronoi, sites, 30, lambda iteration, energy: energies.append((iteration, energy)))
    assert [iteration for iteration, _ in energies] == list(range(1, 31))
    values = [energy for _, energy in energies] + [voronoi.integrate(last).value]
    assert np.all(np.diff(values) <= 1e-12 * values[0])
    assert values[-1] < 0.9 * values[0]


@pytest.mark.parametrize(("sharpness", "tolerance"), [(1.0, 1e-5), (7.0, 1e-3)])
def test_minimise_converges_to_a_point_without_gradient(sharpness, tolerance):
    voronoi, sites = start(surface=shapes.sphere(4))
    energies = []
    result = minimise(
        voronoi,
        sites,
        sharpness=sharpness,
        max_iterations=2000,
        tolerance=tolerance,
        on_iteration=lambda iteration, energy: energies.append((iteration, energy)),
    )
    assert result.status is Status.CONVERGED
    assert result.iterations == len(energies) == energies[-1][0]
    assert result.evaluations > result.iterations
    assert np.all(np.diff([voronoi.integrate(sites, sharpness).value, *(energy for _, energy in energies)]) < 0)
    here = voronoi.integrate(result.sites, sharpness)
    assert here.value == pytest.approx(result.energy, rel=1e-12)
    step = here.gradient / (2 * here.mass[:, None])
    mean_square = (here.mass * (step**2).sum(axis=1)).sum() / here.mass.sum()
    assert np.sqrt(mean_square) < tolerance * np.sqrt(here.value / here.mass.sum()) * (1 + 1e-6)


def test_a_smaller_tolerance_takes_more_iterations_and_the_limit_is_reported():
    voronoi, sites = start()
    counts = [
        minimise(voronoi, sites, sharpness=1.0, max_iterations=1000, tolerance=tolerance).iterations
        for tolerance in (1e-1, 1e-2, 1e-4)
    ]
    assert counts[0] < counts[1] < counts[2]
    few = minimise(voronoi, sites, sharpness=1.0, max_iterations=3)
    assert few.status is Status.ITERATION_LIMIT
    assert few.iterations == 3
    none = minimise(voronoi, sites, sharpness=1.0, max_iterations=0)
    np.testing.assert_array_equal(none.sites, sites)


def test_an_impossible_tolerance_ends_without_descent_or_at_the_limit_and_never_raises_the_energy():
    voronoi, sites = start(12)
    result = minimise(voronoi, sites, sharpness=1.0, max_iterations=400, tolerance=0.0)
    assert result.status is not Status.CONVERGED
    reference = minimise(voronoi, sites, sharpness=1.0, max_iterations=400, tolerance=1e-6)
    assert result.energy <= reference.energy * (1 + 1e-12)


def test_where_no_step_descends_there_is_a_kink():
    # On coarse facets the normal-metric energy is not smooth where a cell boundary lies along mesh edges.
    voronoi, sites = start()
    result = minimise(voronoi, sites, sharpness=7.0, max_iterations=3000, tolerance=1e-6)
    assert result.status is Status.NO_DESCENT
    here = voronoi.integrate(result.sites, 7.0)
    direction = -here.gradient / np.linalg.norm(here.gradient)
    for step in 10.0 ** np.arange(-6, 0):
        there = voronoi.integrate(result.sites + step * direction, 7.0)
        assert there.value > here.value
        assert (there.gradient * direction).sum() > 0 > (here.gradient * direction).sum()


def test_minimise_is_deterministic_for_any_number_of_threads():
    surface = shapes.torus()
    results = []
    for threads in (1, 2, 2):
        voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(surface), threads=threads)
        sites = naive.random_sites(surface.points, surface.faces, 200, np.random.default_rng(0))
        results.append(minimise(voronoi, sites, sharpness=7.0, max_iterations=15))
    for result in results[1:]:
        np.testing.assert_array_equal(result.sites, results[0].sites)
        assert result.energy == results[0].energy


def test_lbfgs_beats_lloyd_for_as_many_evaluations():
    voronoi, sites = start(60)
    result = minimise(voronoi, sites, sharpness=1.0, max_iterations=40)
    assert result.energy < voronoi.integrate(lloyd(voronoi, sites, result.evaluations)).value * (1 + 1e-3)


def test_cells_on_a_sphere_have_about_equal_areas():
    surface = shapes.sphere(4)
    voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(surface))
    embedded = voronoi.embedded
    sites = sample_surface(embedded.points, embedded.faces, embedded.face_areas, 120, np.random.default_rng(0))
    result = minimise(voronoi, sites, sharpness=1.0, max_iterations=200)
    mass = voronoi.integrate(result.sites).mass
    assert mass.std() < 0.06 * mass.mean()
    assert voronoi.integrate(sites).mass.std() > 0.3 * mass.mean()


def test_a_sharp_metric_attracts_sites_to_the_creases_of_a_box():
    surface = shapes.box(n=6)
    voronoi = RestrictedVoronoi(EmbeddedSurface.in_space(surface))
    sites = naive.random_sites(surface.points, surface.faces, 150, np.random.default_rng(0))
    sites = lloyd(voronoi, sites, 10)

    def near_crease(x):
        to_planes = np.sort(np.abs(x - np.round(x)), axis=1)
        return np.mean(to_planes[:, 1] < 0.02)

    plain, sharp = (minimise(voronoi, sites, sharpness=s, max_iterations=80).sites for s in (1.0, 7.0))
    assert near_crease(sharp) > near_crease(plain) + 0.1


def test_blocks_are_the_inverses_of_the_stiffness_of_cells():
    """In a plane it is 1 within, and the squared share of the sharpness across; elsewhere a mean over the cell."""
    voronoi, sites = start(surface=shapes.open_patch(lambda x, y: 0.0 * x, n=9))
    stiffness = (0.35 * 7.0) ** 2
    np.testing.assert_allclose(NormalMetric(7.0).inverse_blocks(voronoi, sites), [np.diag([1, 1, 1 / stiffness])] * 40)
    voronoi, sites = start(n=12)
    diagram, surface = voronoi.diagram(sites), voronoi.embedded.surface
    found = NormalMetric(7.0).inverse_blocks(voronoi, sites)
    for site in range(12):
        mine = np.flatnonzero(diagram.site == site)
        area = diagram.fractions[mine] * surface.face_areas[diagram.facet[mine]]
        normals = surface.face_normals[diagram.facet[mine]]
        mean = sum(a * np.outer(v, v) for a, v in zip(area, normals, strict=True)) / area.sum()
        np.testing.assert_allclose(found[site] @ (np.eye(3) + (stiffness - 1.0) * mean), np.eye(3), atol=1e-12)
    assert NormalMetric(1.0).inverse_blocks(voronoi, sites) is None


def test_blocks_lower_the_energy_faster(monkeypatch):
    voronoi, sites = start(n=150, surface=shapes.torus(1.0, 0.4, 60, 24))
    sites = lloyd(voronoi, sites, 5)
    with_blocks = minimise(voronoi, sites, 7.0, max_iterations=20).energy
    monkeypatch.setattr(NormalMetric, "inverse_blocks", lambda *given: None)
    assert with_blocks < minimise(voronoi, sites, 7.0, max_iterations=20).energy


class Plain:
    """The energy of the paper without its blocks."""

    def evaluate(self, voronoi, sites):
        return NormalMetric(7.0).evaluate(voronoi, sites)


class WithBlocks(Plain):
    def __init__(self, blocks):
        self.blocks = blocks

    def inverse_blocks(self, voronoi, sites):
        return self.blocks(len(sites))


def test_blocks_of_an_own_energy_are_used():
    options = DescentOptions(max_iterations=3)
    voronoi, sites = start()
    plain = lbfgs.minimise(voronoi, sites, Plain(), options=options)
    unit = lbfgs.minimise(voronoi, sites, WithBlocks(lambda n: np.tile(np.eye(3), (n, 1, 1))), options=options)
    flat = lbfgs.minimise(
        voronoi, sites, WithBlocks(lambda n: np.tile(np.diag([0.5, 1.0, 2.0]), (n, 1, 1))), options=options
    )
    np.testing.assert_allclose(unit.sites, plain.sites, rtol=0, atol=1e-12)
    assert not np.allclose(flat.sites, plain.sites, rtol=0, atol=1e-6)


@pytest.mark.parametrize("blocks", [lambda n: np.ones((n, 3)), lambda n: np.full((n, 3, 3), np.nan)])
def test_wrong_blocks_are_refused(blocks):
    voronoi, sites = start()
    with pytest.raises(anisomesh.OptionError, match="inverse_blocks"):
        lbfgs.minimise(voronoi, sites, WithBlocks(blocks), options=DescentOptions(max_iterations=1))
