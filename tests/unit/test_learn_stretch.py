"""The network: what it sees does not change under motion, its lines turn with the mesh, and it learns."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from anisomesh.denoise.noise import NOISES, with_noise  # noqa: E402
from anisomesh.learn.architecture import NetworkOptions  # noqa: E402
from anisomesh.learn.data.examples import OffsetTarget, stretch_example  # noqa: E402
from anisomesh.learn.data.items import Item  # noqa: E402
from anisomesh.learn.graphs.graph import graph_from_edges  # noqa: E402
from anisomesh.learn.graphs.hierarchy import N_EDGE_FEATURES, N_NODE_FEATURES, graph_hierarchy  # noqa: E402
from anisomesh.learn.models.messages import mean_by_scatter  # noqa: E402
from anisomesh.learn.models.stretch import ResidualBlock, StretchNetwork  # noqa: E402
from anisomesh.learn.training.config import TrainingOptions  # noqa: E402
from anisomesh.learn.training.losses import line_loss, offset_loss  # noqa: E402
from anisomesh.learn.training.tasks import StretchTask  # noqa: E402
from anisomesh.mesh.surface import Surface  # noqa: E402
from anisomesh.metric.curvature import principal_curvatures  # noqa: E402
from anisomesh.metric.line_field import (  # noqa: E402
    MAX_LOG_STRETCH_SQUARED,
    line_field_components,
    principal_stretch,
    tensors_of_line_field,
)
from anisomesh.metric.tangent import tangent_frames  # noqa: E402
from anisomesh.metric.tensors import curvature_metric  # noqa: E402
from anisomesh.shapes.analytic import ellipsoid, open_patch, sphere, torus  # noqa: E402

SMALL = NetworkOptions(channels=16, scales=3, blocks=1, heads=2)


def shaken(surface, seed=0):
    rng = np.random.default_rng(seed)
    points = surface.points + rng.normal(0.0, 0.05 * surface.edge_lengths.mean(), surface.points.shape)
    surface = surface.with_points(points)
    return surface.with_points(points / surface.diagonal)


def moved(surface, seed=1):
    """Return the surface with its points in another order and turned, that order, and the turn."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(surface.n_points)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    faces = np.argsort(order)[surface.faces][rng.permutation(surface.n_faces)]
    return Surface(surface.points[order] @ turn.T, faces), order, turn


def predicted(network, surface):
    seen = graph_hierarchy(surface, network.options.scales)
    with torch.no_grad():
        found = network(seen)
    return tensors_of_line_field(found.line_field.numpy(), seen.frames), found.offsets.numpy()


def egg_item():
    surface = ellipsoid((1.0, 0.6, 0.3), 3)
    surface = surface.with_points(surface.points / surface.diagonal)
    curvature = principal_curvatures(surface)
    tensors = curvature_metric(surface, curvature)
    return Item.of(surface, tensors, np.zeros((surface.n_points, 5)), curvature.trusted)


@pytest.mark.parametrize("seed", range(3))
def test_lines_come_back_from_tensors_and_tensors_from_lines(seed):
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(50, 3))
    frames = tangent_frames(normals / np.linalg.norm(normals, axis=1, keepdims=True))
    lines = rng.normal(size=(50, 2))
    tensors = tensors_of_line_field(lines, frames)
    values = np.linalg.eigvalsh(tensors)
    np.testing.assert_allclose(values[:, :2], 1.0, atol=1e-9)
    np.testing.assert_allclose(np.log(values[:, 2]), np.hypot(*lines.T), atol=1e-9)
    np.testing.assert_allclose(line_field_components(*principal_stretch(tensors), frames), lines, atol=1e-5)
    assert np.linalg.eigvalsh(tensors_of_line_field(100.0 * lines, frames)).max() <= np.exp(MAX_LOG_STRETCH_SQUARED) * (
        1 + 1e-9
    )


def test_an_isotropic_metric_has_no_line_at_any_scale():
    normals = np.random.default_rng(0).normal(size=(20, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    across = normals[:, :, None] * normals[:, None, :]
    tensors = across + 4.0 * (np.eye(3) - across)  # as of an embedding that doubles all lengths
    np.testing.assert_allclose(principal_stretch(tensors)[1], 0.0, atol=1e-9)


def test_the_loss_is_zero_for_the_answer_and_a_distance_elsewhere():
    wanted = torch.tensor([[3.0, 4.0], [0.0, 0.0], [1.0, 0.0]])
    weight = torch.tensor([1.0, 1.0, 0.0])
    assert float(line_loss(wanted, wanted, weight)) == pytest.approx(0.0, abs=1e-6)
    assert float(line_loss(torch.zeros(3, 2), wanted, weight)) == pytest.approx(0.5 * 5.0, abs=0.03)
    assert float(line_loss(wanted + torch.tensor([[0, 0], [0, 0], [9.0, 0]]), wanted, weight)) < 1e-6


@pytest.mark.parametrize("surface", [sphere(3), torus(n_major=40, n_minor=16)])
def test_features_of_nodes_and_edges_match_the_shape(surface):
    surface = surface.with_points(surface.points / surface.diagonal)
    finest = graph_hierarchy(surface, 3).levels[0]
    assert finest.nodes.shape == (surface.n_points, N_NODE_FEATURES)
    assert finest.graph.features.shape == (2 * len(surface.edges), N_EDGE_FEATURES)
    if surface.n_points == sphere(3).n_points:
        radius = 1.0 / (2.0 * np.sqrt(3.0))
        np.testing.assert_allclose(finest.graph.features[:, 1:4], np.arcsinh(1.0 / radius), rtol=0.1)
        assert np.median(finest.graph.features[:, 1]) == pytest.approx(np.arcsinh(1.0 / radius), rel=0.01)
    length = np.linalg.norm(finest.directions, axis=1)
    np.testing.assert_allclose(length, 1.0, atol=1e-6)


def test_what_the_network_sees_does_not_change_with_order_or_motion():
    surface = shaken(torus(n_major=40, n_minor=16))
    other, order, _ = moved(surface)
    mine, theirs = graph_hierarchy(surface, 3), graph_hierarchy(other, 3)
    np.testing.assert_allclose(theirs.levels[0].nodes, mine.levels[0].nodes[order], atol=1e-4)
    for a, b in zip(mine.levels, theirs.levels, strict=True):
        assert len(a.nodes) == len(b.nodes)
        np.testing.assert_allclose(np.sort(a.nodes, axis=0), np.sort(b.nodes, axis=0), atol=1e-4)


@pytest.mark.parametrize("surface", [torus(n_major=40, n_minor=16), open_patch(lambda x, y: 0.3 * x * y, n=15)])
def test_metric_and_offsets_turn_with_the_mesh_and_ignore_the_order(surface):
    torch.manual_seed(0)
    network = StretchNetwork(SMALL).eval()
    for block in network.modules():
        if hasattr(block, "out") and isinstance(block.out, torch.nn.Linear):
            torch.nn.init.normal_(block.out.weight, std=0.1)
    surface = shaken(surface)
    other, order, turn = moved(surface)
    (mine, my_offsets), (theirs, their_offsets) = predicted(network, surface), predicted(network, other)
    assert np.ptp(np.linalg.eigvalsh(mine)[:, 2]) > 0.1
    np.testing.assert_allclose(theirs, turn @ mine[order] @ turn.T, rtol=1e-3, atol=1e-3)
    size = np.linalg.norm(my_offsets, axis=1).max()
    assert size > 0.0
    np.testing.assert_allclose(their_offsets, my_offsets[order] @ turn.T, atol=1e-3 * size)


def plain_block(block, x, graph):
    """Return what a block gives by the formulas of its docstrings alone."""
    layer, norm = block.convolution, block.norm
    mean = mean_by_scatter(layer.own(x), layer.sent(x), layer.along, graph, 0.1)
    mixed = torch.cat([x, mean], dim=1) @ layer.out.weight.T + layer.out.bias
    away = mixed - mixed.mean(dim=0)
    normal = away / torch.sqrt((away**2).mean(dim=0) + 1e-5) * norm.scale + norm.shift
    return x + block.out(torch.where(normal > 0.0, normal, 0.1 * normal))


@pytest.mark.parametrize("n_nodes", [1, 2, 600])
def test_a_block_and_its_derivatives_match_the_plain_formulas(n_nodes):
    torch.manual_seed(0)
    graph = graph_hierarchy(shaken(torus(n_major=40, n_minor=15)), 1).levels[0].graph
    if n_nodes < 3:
        ends = np.arange(n_nodes)
        along = np.random.default_rng(0).normal(size=(n_nodes, N_EDGE_FEATURES)).astype(np.float32)
        graph = graph_from_edges(n_nodes, ends, ends[::-1], along)
    block = ResidualBlock(8)
    for values in block.parameters():
        torch.nn.init.normal_(values)
    x = torch.randn(n_nodes, 8, requires_grad=True)
    factors = torch.randn(n_nodes, 8)
    wanted, found = plain_block(block, x, graph), block(x, graph)
    torch.testing.assert_close(found, wanted, atol=1e-4, rtol=1e-4)
    inputs = [x, *block.parameters()]
    theirs, mine = (torch.autograd.grad((factors * y).sum(), inputs) for y in (wanted, found))
    for a, b in zip(mine, theirs, strict=True):
        torch.testing.assert_close(a, b, atol=1e-4 * max(1.0, float(b.abs().max())), rtol=1e-4)


def test_a_mesh_of_four_points_leaves_the_network_as_it_is():
    torch.manual_seed(0)
    network = StretchNetwork(SMALL).eval()  # its coarser graphs have one node, whose norm is the shift alone
    before = {name: values.clone() for name, values in network.state_dict().items()}
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    surface = Surface(points, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))
    tensors, offsets = predicted(network, surface)
    assert np.isfinite(tensors).all() and np.isfinite(offsets).all()
    for name, values in network.state_dict().items():
        assert torch.equal(values, before[name]), name


def test_it_does_not_matter_how_many_edges_are_worked_on_at_once(monkeypatch):
    torch.manual_seed(0)
    surface, network = shaken(torus(n_major=24, n_minor=12)), StretchNetwork(SMALL).eval()
    whole, offsets = predicted(network, surface)
    monkeypatch.setattr("anisomesh.learn.models.stretch.EDGES_PER_CHUNK", 7)
    parts, other_offsets = predicted(network, surface)
    np.testing.assert_allclose(parts, whole, rtol=1e-5, atol=1e-5)  # entries are about 1, of single precision
    np.testing.assert_allclose(other_offsets, offsets, atol=1e-4 * np.abs(offsets).max())


def test_noise_moves_the_mesh_and_not_the_lines_wanted():
    item = egg_item()
    clean, noisy = stretch_example(item, 3), stretch_example(item, 3, 0.3, np.random.default_rng(0))
    assert np.abs(clean.hierarchy.levels[0].nodes - noisy.hierarchy.levels[0].nodes).max() > 0.1
    length = [torch.linalg.norm(example.line_field, dim=1) for example in (clean, noisy)]
    torch.testing.assert_close(*length, atol=1e-4, rtol=1e-4)
    assert float(clean.offsets.weight.sum()) == pytest.approx(1.0)
    tensors = [tensors_of_line_field(each.line_field.numpy(), each.hierarchy.frames) for each in (clean, noisy)]
    cosine = np.einsum("nx,nx->n", *(principal_stretch(t)[0] for t in tensors))
    stretched = length[0].numpy() > 0.3
    assert np.median(np.abs(cosine[stretched])) > 0.95
    again = stretch_example(item, 3, 0.3, np.random.default_rng(0))
    torch.testing.assert_close(again.line_field, noisy.line_field)


@pytest.mark.parametrize("kind", NOISES)
def test_the_offsets_wanted_take_the_noise_away(kind):
    item = egg_item()
    rng, again = np.random.default_rng(0), np.random.default_rng(0)
    target = stretch_example(item, 3, 0.3, rng, kind).offsets
    noisy = with_noise(item.surface, 0.3, again, kind)
    away = np.linalg.norm(noisy.points - item.surface.points, axis=1)
    deviation = {"independent": 0.3 * np.sqrt(3.0), "normal": 0.3, "smooth": 0.15 * np.sqrt(3.0)}[kind]
    assert np.sqrt((away**2).mean()) == pytest.approx(deviation * target.unit, rel=0.15)
    np.testing.assert_allclose(noisy.points + target.unit * target.offsets.numpy(), item.points, atol=1e-6)
    height = np.einsum("nx,nx->n", noisy.points - item.surface.points, item.surface.point_normals)
    seen = torch.einsum("vi,vij,vj->v", target.offsets, target.quadrics, target.offsets).sqrt().numpy()
    np.testing.assert_allclose(seen * target.unit, np.abs(height), atol=0.15 * away.max())


def test_the_loss_of_offsets_is_zero_for_the_answer_and_for_motion_along_a_plane():
    rng = np.random.default_rng(0)
    wanted = torch.from_numpy(rng.normal(size=(4, 3)).astype(np.float32))
    up = torch.diag(torch.tensor([0.0, 0.0, 1.0])).expand(4, 3, 3)
    edges, weight = torch.tensor([[0, 1], [1, 2], [2, 3]]), torch.full((4,), 0.25)
    target = OffsetTarget(offsets=wanted, quadrics=up, edges=edges, weight=weight, unit=1.0)
    along = wanted + torch.tensor([3.0, -2.0, 0.0])
    for offsets in (wanted, along):
        assert float(offset_loss(offsets, target)) == pytest.approx(0.0, abs=1e-6)
    raised = wanted + torch.tensor([0.0, 0.0, 1.0])
    assert float(offset_loss(raised, target)) == pytest.approx(1.0, abs=0.03)
    rough = wanted + torch.tensor([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]] * 2)
    assert float(offset_loss(rough, target)) == pytest.approx(3.0, abs=0.05)


@pytest.mark.slow
def test_a_network_learns_one_shape():
    torch.manual_seed(0)
    task = StretchTask(TrainingOptions(data="", out="", network=SMALL))
    network = task.network()
    clean, noisy = (task.example(egg_item(), noise, np.random.default_rng(0), training=False) for noise in (0.0, 0.3))
    nothing = [task.baseline_losses(clean)["lines"], task.baseline_losses(noisy)["offsets"]]
    optimiser = torch.optim.AdamW(network.parameters(), lr=5e-3)
    for _ in range(60):
        optimiser.zero_grad()
        losses = [task.losses(network, clean)["lines"], task.losses(network, noisy)["offsets"]]
        sum(losses).backward()
        optimiser.step()
    assert float(losses[0].detach()) < 0.3 * nothing[0]
    assert float(losses[1].detach()) < 0.7 * nothing[1]
