"""Gradients of the differentiable tessellation against automatic differentiation, differences and invariances."""

import subprocess
import sys

import naive_rvd as naive
import numpy as np
import pytest
from embedded import embedded_surface

torch = pytest.importorskip("torch")

from anisomesh.cvt.energy import NormalMetric  # noqa: E402
from anisomesh.errors import MeshError, OptionError  # noqa: E402
from anisomesh.learn import embedded_area, tessellation_energy  # noqa: E402
from anisomesh.shapes import analytic as shapes  # noqa: E402
from anisomesh.voronoi.restricted import RestrictedVoronoi  # noqa: E402
from conftest import pairwise  # noqa: E402


def torus_patch():
    """Return a part of a torus with a boundary and a point that no face uses."""
    whole = shapes.torus(n_major=9, n_minor=6)
    kept = whole.faces[(whole.points[whole.faces, 0] > -0.2).all(axis=1)]
    return type(whole)(whole.points, kept)


SHAPES = {
    "sphere": lambda: shapes.sphere(1),
    "patch": torus_patch,
    "box": lambda: shapes.box((1.0, 0.6, 0.3), n=2),
}


def make(shape, dimension, n, seed=0):
    """Return sites (n, d) and vertices (V, d) that require gradients, and faces."""
    rng = np.random.default_rng(seed)
    surface = SHAPES[shape]()
    points = naive.embed(surface.points, dimension, rng, strength=0.3)
    sites = naive.random_sites(points, surface.faces, n, rng, lift=0.02)
    return (*(torch.tensor(table, requires_grad=True) for table in (sites, points)), surface.faces)


def gradients(sites, vertices, faces, sharpness):
    value = tessellation_energy(sites, vertices, faces, sharpness=sharpness)
    return value.detach(), *torch.autograd.grad(value, (sites, vertices))


def symbolic_energy(diagram, sites, vertices, sharpness):
    """Return the energy of a diagram whose combinatorics are fixed, as torch operations from its definition.

    Vertices of polygons solve one linear equation for each of the two lines that they are on, and l_a + l_b + l_c = 1.
    """
    polygon = torch.as_tensor(diagram.polygon_of, dtype=torch.int64)
    own = torch.as_tensor(diagram.site, dtype=torch.int64)[polygon]
    corners = vertices[torch.as_tensor(diagram.faces[diagram.facet], dtype=torch.int64)][polygon]

    def rows(site):
        return ((corners - sites[site][:, None]) ** 2).sum(dim=2)

    def line(label):
        label = torch.as_tensor(label, dtype=torch.int64)
        side = torch.eye(3, dtype=torch.float64)[(-1 - label).clamp(0, 2)]
        return torch.where((label >= 0)[:, None], rows(label.clamp(min=0)) - rows(own), side)

    matrix = torch.stack([line(diagram.label[diagram.previous]), line(diagram.label), torch.ones_like(rows(own))], 1)
    place = torch.linalg.solve(matrix, torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64).expand(len(own), 3))
    first = place[torch.as_tensor(diagram.offset[:-1])[polygon]]
    fan = torch.stack([first, place, place[torch.as_tensor(diagram.following, dtype=torch.int64)]], dim=1)
    along, across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    gram = (along**2).sum(1) * (across**2).sum(1) - (along * across).sum(1) ** 2
    normal = torch.linalg.cross(along[:, :3], across[:, :3])
    normal = normal / normal.norm(dim=1, keepdim=True)
    u = fan @ corners - sites[own][:, None]
    height = torch.einsum("qkx,qx->qk", u[:, :, :3], normal)
    stretched = u[:, :, :3] + (sharpness - 1) * height[:, :, None] * normal[:, None]
    u = torch.cat([stretched, u[:, :, 3:]], dim=2)
    share = 0.5 * torch.sqrt(gram) * torch.linalg.det(fan)
    return (share * ((u**2).sum(dim=(1, 2)) + (u.sum(dim=1) ** 2).sum(dim=1)) / 12).sum()


@pytest.mark.parametrize(("shape", "dimension", "sharpness"), pairwise(SHAPES, [3, 4, 8], [1.0, 2.0, 7.0]))
def test_gradients_are_those_of_automatic_differentiation_through_the_clipped_polygons(shape, dimension, sharpness):
    sites, vertices, faces = make(shape, dimension, 20)
    diagram = RestrictedVoronoi(embedded_surface(vertices.detach().numpy(), faces)).diagram(sites.detach().numpy())
    energy = symbolic_energy(diagram, sites, vertices, sharpness)
    wanted = torch.autograd.grad(energy, (sites, vertices))
    value, *found = gradients(sites, vertices, faces, sharpness)
    assert float(value) == pytest.approx(float(energy.detach()), rel=1e-11)
    for ours, theirs in zip(found, wanted, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 * float(theirs.abs().max()))


@pytest.mark.parametrize(("shape", "dimension", "sharpness"), pairwise(SHAPES, [3, 8], [1.0, 7.0]))
def test_gradients_are_the_limit_of_central_differences(shape, dimension, sharpness):
    sites, vertices, faces = make(shape, dimension, 60, seed=3)
    _, *found = gradients(sites, vertices, faces, sharpness)
    rng, step = np.random.default_rng(0), 1e-6
    for _ in range(6):
        ways = [torch.tensor(rng.normal(size=tuple(table.shape))) for table in (sites, vertices)]
        above, below = (
            float(tessellation_energy(sites + h * ways[0], vertices + h * ways[1], faces, sharpness=sharpness).detach())
            for h in (step, -step)
        )
        wanted = sum(float((gradient * way).sum()) for gradient, way in zip(found, ways, strict=True))
        size = sum(float((gradient**2).sum()) for gradient in found) ** 0.5
        assert (above - below) / (2 * step) == pytest.approx(wanted, abs=1e-6 * size)


def test_gradcheck_accepts_the_function():
    octahedron = shapes.sphere(0)
    rng = np.random.default_rng(5)
    points = naive.embed(octahedron.points, 4, rng)
    sites = naive.random_sites(points, octahedron.faces, 4, rng, lift=0.05)
    inputs = [torch.tensor(table, requires_grad=True) for table in (sites, points)]
    assert torch.autograd.gradcheck(
        lambda x, v: 3.0 * tessellation_energy(x, v, octahedron.faces, sharpness=3.0, threads=1), inputs
    )


@pytest.mark.parametrize("sharpness", [1.0, 7.0])
def test_value_and_gradient_by_the_sites_are_those_of_the_normal_metric(sharpness):
    sites, vertices, faces = make("sphere", 8, 40)
    positions = sites.detach().numpy()
    voronoi = RestrictedVoronoi(embedded_surface(vertices.detach().numpy(), faces))
    wanted = NormalMetric(sharpness).evaluate(voronoi, positions)
    value, by_sites, _ = gradients(sites, vertices, torch.tensor(faces), sharpness)
    assert float(value) == wanted.value
    np.testing.assert_array_equal(by_sites, wanted.gradient)


@pytest.mark.parametrize("sharpness", [1.0, 7.0])
def test_gradients_follow_from_invariance_under_motions_and_homogeneity(sharpness):
    sites, vertices, faces = make("patch", 8, 30)
    value, by_sites, by_vertices = gradients(sites, vertices, faces, sharpness)
    # translations leave the energy as it is, and so do rotations in space and among the other coordinates
    assert float((by_sites.sum(dim=0) + by_vertices.sum(dim=0)).abs().max()) < 1e-12
    torques = by_sites.T @ sites.detach() + by_vertices.T @ vertices.detach()
    for block in (torques[:3, :3], torques[3:, 3:]):
        assert float((block - block.T).abs().max()) < 1e-12
    # Euler: the energy is homogeneous of degree 4
    assert float(torch.trace(torques)) == pytest.approx(4.0 * float(value), rel=1e-12)


def test_gradients_move_with_the_surface_and_scale_with_the_third_power():
    sites, vertices, faces = make("box", 8, 25)
    rng = np.random.default_rng(1)
    rotation = torch.eye(8, dtype=torch.float64)
    for block in (slice(0, 3), slice(3, 8)):
        size = block.stop - block.start
        rotation[block, block] = torch.tensor(np.linalg.qr(rng.normal(size=(size, size)))[0])
    rotation[0] *= torch.sign(torch.linalg.det(rotation[:3, :3]))
    still = gradients(sites, vertices, faces, 7.0)
    moved = [(2.5 * table.detach() @ rotation.T + 0.7).requires_grad_() for table in (sites, vertices)]
    found = gradients(*moved, faces, 7.0)
    assert float(found[0]) == pytest.approx(2.5**4 * float(still[0]), rel=1e-10)
    for ours, theirs in zip(found[1:], still[1:], strict=True):
        np.testing.assert_allclose(ours, 2.5**3 * theirs @ rotation.T, rtol=0, atol=1e-9 * float(ours.abs().max()))


def test_sites_without_a_cell_unused_vertices_and_flat_faces_have_no_gradient():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5], [0.5, 0.5, 0.0]], dtype=float)
    faces = np.array([[0, 1, 2], [1, 4, 2]])  # the second has no area
    vertices = torch.tensor(points, requires_grad=True)
    sites = torch.tensor([[0.2, 0.2, 0.1], [9.0, 9.0, 9.0]], dtype=torch.float64, requires_grad=True)
    _, by_sites, by_vertices = gradients(sites, vertices, faces, 7.0)
    assert torch.isfinite(by_vertices).all()
    assert not by_sites[1].any()
    assert not by_vertices[3:].any()
    assert by_vertices[:3].any(dim=1).all()


def test_gradients_are_finite_where_sites_coincide_or_lie_in_a_grid_or_a_face_is_a_segment_in_space():
    box = shapes.box((1.0, 1.0, 1.0), n=2)
    points = np.column_stack([box.points, np.zeros(len(box.points))])
    points[box.faces[0], :3] = [[0, 0, 0], [0.5, 0, 0], [1, 0, 0]]
    points[box.faces[0][1], 3] = 0.5
    sites = np.concatenate([points[:8], points[:3]])
    for gradient in gradients(*(torch.tensor(x, requires_grad=True) for x in (sites, points)), box.faces, 7.0)[1:]:
        assert torch.isfinite(gradient).all()


def test_the_gradient_is_taken_where_the_function_was_evaluated():
    sites, vertices, faces = make("sphere", 4, 10)
    _, by_sites, by_vertices = gradients(sites, vertices, faces, 7.0)
    value = tessellation_energy(sites, vertices, faces)
    with torch.no_grad():
        sites.add_(1.0)
        vertices.mul_(2.0)
    value.backward()
    torch.testing.assert_close(sites.grad, by_sites, rtol=0, atol=0)
    torch.testing.assert_close(vertices.grad, by_vertices, rtol=0, atol=0)


def test_results_do_not_depend_on_the_number_of_threads():
    surface = shapes.torus(n_major=60, n_minor=30)
    rng = np.random.default_rng(0)
    points = naive.embed(surface.points, 5, rng, strength=0.3)
    sites = naive.random_sites(points, surface.faces, 200, rng)
    found = []
    for threads in (1, 2):
        tables = [torch.tensor(table, requires_grad=True) for table in (sites, points)]
        tessellation_energy(*tables, surface.faces, threads=threads).backward()
        found.append([table.grad.numpy() for table in tables])
    for one, two in zip(*found, strict=True):
        np.testing.assert_array_equal(one, two)


def test_embedded_area_is_the_area_of_the_surface_and_differentiable():
    _, vertices, faces = make("patch", 8, 1)
    area = embedded_area(vertices, faces)
    assert float(area.detach()) == pytest.approx(embedded_surface(vertices.detach().numpy(), faces).area, rel=1e-13)
    assert torch.autograd.gradcheck(lambda v: embedded_area(v, torch.tensor(faces)), [vertices])
    flat = torch.zeros((3, 4), dtype=torch.float64, requires_grad=True)
    embedded_area(flat, np.array([[0, 1, 2]])).backward()
    assert not flat.grad.any()


GOOD = {"sites": torch.zeros((2, 4), dtype=torch.float64), "vertices": torch.eye(3, 4, dtype=torch.float64)}


@pytest.mark.parametrize(
    ("changed", "error", "message"),
    [
        ({"sites": np.zeros((2, 4))}, OptionError, "sites is ndarray; expected a torch tensor"),
        ({"sites": GOOD["sites"].float()}, OptionError, r"torch.float32 on cpu; expected torch.float64.*sites.to\("),
        ({"sites": torch.zeros((2, 5), dtype=torch.float64)}, OptionError, r"\(2, 5\); expected \(S, 4\)"),
        ({"sites": GOOD["sites"] * torch.nan}, OptionError, "not finite"),
        ({"vertices": GOOD["vertices"][:, :2]}, MeshError, r"vertices has shape \(3, 2\); expected \(n, d\)"),
        ({"vertices": GOOD["vertices"][0]}, MeshError, r"vertices has shape \(4,\)"),
        ({"vertices": GOOD["vertices"].to("meta")}, MeshError, "torch.float64 on meta"),
        ({"vertices": GOOD["vertices"] / 0.0}, MeshError, "vertices has a number that is not finite"),
        ({"faces": [[0, 1, 3]]}, MeshError, "3"),
        ({"faces": torch.tensor([[0.5, 1.0, 2.0]])}, MeshError, "faces"),
        ({"sharpness": 0.5}, OptionError, "sharpness = 0.5"),
        ({"threads": 0}, OptionError, "threads = 0"),
    ],
)
def test_bad_input_is_refused_with_a_reason(changed, error, message):
    arguments = {**GOOD, "faces": np.array([[0, 1, 2]]), **changed}
    with pytest.raises(error, match=message):
        tessellation_energy(**arguments)


def test_importing_the_package_does_not_import_torch():
    code = "import sys, anisomesh.learn as learn; assert not hasattr(learn, 'other'); assert 'torch' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
