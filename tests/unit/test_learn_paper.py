"""The paper's network and losses: against the formula edge by edge, under motions, and their derivatives."""

from dataclasses import asdict, replace

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from anisomesh.bench.suite import load_suite  # noqa: E402
from anisomesh.learn.architecture import SKIPS  # noqa: E402
from anisomesh.learn.data.items import Item  # noqa: E402
from anisomesh.learn.models.paper import (  # noqa: E402
    BatchNorm,
    PaperBlock,
    PaperConvolution,
    PaperNetwork,
    PaperOptions,
    TopKPooling,
    interpolated,
    joined,
    paper_input,
)
from anisomesh.learn.training.config import TrainingOptions, parse_training  # noqa: E402
from anisomesh.learn.training.losses import (  # noqa: E402
    LOSSES,
    corner_dots,
    cosine_loss,
    dot_loss,
    l2_loss,
    laplacian_loss,
)
from anisomesh.learn.training.tasks import N_SYMMETRIES, EmbeddingTask, symmetry  # noqa: E402
from anisomesh.mesh.surface import Surface  # noqa: E402
from anisomesh.shapes.analytic import sphere, torus  # noqa: E402


def shaken(surface):
    rng = np.random.default_rng(0)
    return surface.with_points(surface.points + rng.normal(0.0, 0.01, surface.points.shape))


def embedded(surface, seed=0):
    """Return random extra coordinates, the surface in 8-D with them, faces and edges, as tensors of float64."""
    extra = torch.from_numpy(np.random.default_rng(seed).normal(size=(surface.n_points, 5)))
    whole = torch.cat([torch.from_numpy(surface.points.copy()), extra], dim=1)
    faces, edges = (torch.from_numpy(table.astype(np.int64)) for table in (surface.faces, surface.edges))
    return extra, whole, faces, edges


def turned(values, seed=1):
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(values.shape[1],) * 2))[0]
    return values @ torch.from_numpy(turn)


def test_the_convolution_is_the_formula_of_the_paper():
    torch.manual_seed(0)
    surface = sphere(1)
    seen = paper_input(surface)
    layer = PaperConvolution(6, 4)
    b = layer.own.weight
    a = layer.sent.weight - b
    found = layer(seen.values, seen.graph)
    for i in range(surface.n_points):
        f_i = seen.values[i]
        messages = []
        for e in range(seen.graph.first[i], seen.graph.first[i + 1]):
            f_j = seen.values[seen.graph.neighbour[e]]
            messages.append(a @ f_j + b @ (f_j - f_i) + layer.away[0] * torch.linalg.norm(f_j - f_i))
        wanted = layer.out(torch.cat([f_i, torch.stack(messages).amax(dim=0)]))
        torch.testing.assert_close(found[i], wanted, atol=1e-5, rtol=1e-5)


def test_pooling_keeps_the_nodes_of_largest_score():
    pool = TopKPooling(3, 0.5)
    x = torch.randn(11, 3)
    values, kept, counts = pool(x, (11,))
    score = x @ pool.direction / pool.direction.norm()
    assert len(kept) == 6
    assert counts == (6,)
    assert score[kept].min() >= score[np.setdiff1d(np.arange(11), kept)].max()
    torch.testing.assert_close(values, x[kept] * torch.tanh(score[kept])[:, None])


def test_interpolation_gives_back_what_was_kept_and_means_between():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [0.5, 0, 0]])
    values = interpolated(torch.tensor([[1.0], [3.0], [9.0]]), points, np.array([0, 1, 2]))
    torch.testing.assert_close(values[:3], torch.tensor([[1.0], [3.0], [9.0]]), atol=1e-6, rtol=0)
    assert 2.0 < float(values[3]) < 4.0


def test_the_network_ignores_the_order_of_points_and_faces():
    torch.manual_seed(0)
    network = PaperNetwork(PaperOptions(channels=16, levels=3)).eval()
    surface = shaken(torus(n_major=24, n_minor=10))
    rng = np.random.default_rng(0)
    order = rng.permutation(surface.n_points)
    other = Surface(surface.points[order], np.argsort(order)[surface.faces][rng.permutation(surface.n_faces)])
    with torch.no_grad():
        mine, theirs = network(paper_input(surface)), network(paper_input(other))
    assert mine.shape == (surface.n_points, 5)
    torch.testing.assert_close(theirs, mine[order], atol=1e-4, rtol=1e-4)


@pytest.mark.parametrize("skip", SKIPS)
def test_the_block_is_the_formula_of_the_paper(skip):
    torch.manual_seed(0)
    block = PaperBlock(6, PaperOptions(channels=5, skip=skip)).double()
    x, graph = torch.randn(9, 6, dtype=torch.float64), None
    first, second = torch.nn.Linear(6, 5, dtype=torch.float64), torch.nn.Linear(5, 5, dtype=torch.float64)
    block.first, block.second = (Mapped(layer) for layer in (first, second))

    def normalised(values):
        return (values - values.mean(dim=0)) / torch.sqrt(values.var(dim=0, unbiased=False) + 1e-5)

    def leaky(values):
        return torch.where(values > 0, values, 0.1 * values)

    inner = normalised(second(leaky(normalised(first(x)))))
    wanted = leaky(inner + block.skip(x)) if skip == "before" else leaky(inner) + block.skip(x)
    torch.testing.assert_close(block(x, graph, (9,)), wanted)


class Mapped(torch.nn.Module):
    """A linear map in place of a convolution."""

    def __init__(self, layer):
        super().__init__()
        self.layer = layer

    def forward(self, x, graph):
        return self.layer(x)


def test_a_batch_norm_normalises_by_the_batch_and_then_by_running_means():
    torch.manual_seed(0)
    norm, theirs = BatchNorm(4), torch.nn.BatchNorm1d(4)
    for n in (30, 7, 12):
        x = 3.0 + 2.0 * torch.randn(n, 4)
        torch.testing.assert_close(norm(x), theirs(x))
    x = torch.randn(5, 4)
    torch.testing.assert_close(norm.eval()(x), theirs.eval()(x))
    before = norm.train().mean.clone()
    torch.testing.assert_close(norm(x[:1]), torch.zeros(1, 4))
    torch.testing.assert_close(norm.mean, before)


def batch_of_three():
    surfaces = [shaken(sphere(1)), shaken(torus(n_major=24, n_minor=10)), shaken(sphere(0))]
    return [paper_input(surface) for surface in surfaces]


@pytest.mark.parametrize(("norm", "training"), [("mesh", True), ("mesh", False), ("batch", False)])
def test_meshes_of_a_batch_do_not_see_each_other_but_for_batch_norms(norm, training):
    torch.manual_seed(0)
    network = PaperNetwork(PaperOptions(channels=8, levels=3, norm=norm)).train(training)
    inputs = batch_of_three()
    with torch.no_grad():
        alone = torch.cat([network(one) for one in inputs])
        together = network(joined(inputs))
    torch.testing.assert_close(together, alone, atol=1e-5, rtol=1e-4)


def test_batch_norms_see_the_whole_batch():
    torch.manual_seed(0)
    network = PaperNetwork(PaperOptions(channels=8, levels=0))
    inputs = batch_of_three()
    seen = {}
    network.bottom.norms[0].register_forward_hook(lambda module, given, out: seen.update(out=out.clone()))
    network(joined(inputs))
    assert len(seen["out"]) == sum(len(one.values) for one in inputs)
    torch.testing.assert_close(seen["out"].mean(dim=0), torch.zeros(8), atol=1e-5, rtol=0)


def test_all_weights_of_the_network_take_part():
    torch.manual_seed(0)
    network = PaperNetwork(PaperOptions(channels=8, levels=3))
    network(paper_input(shaken(torus(n_major=24, n_minor=10)))).square().sum().backward()
    assert all(value.grad is not None and value.grad.abs().sum() > 0 for value in network.parameters())


def test_dot_products_are_lengths_and_angles():
    surface = sphere(1)
    _, whole, faces, _ = embedded(surface)
    a, b, c = whole[faces[0]]
    expected = torch.stack([(b - a) @ (c - a), (c - b) @ (a - b), (a - c) @ (b - c)])
    torch.testing.assert_close(corner_dots(whole, faces)[0], expected)


@pytest.mark.parametrize("name", ["dot", "l2", "cosine", "laplacian", "raw laplacian"])
def test_losses_vanish_at_the_answer_and_those_with_a_gauge_see_motions(name):
    surface = shaken(sphere(2))
    extra, whole, faces, edges = embedded(surface)
    losses = {
        "dot": lambda x: dot_loss(torch.cat([whole[:, :3], x], dim=1), whole, faces),
        "l2": lambda x: l2_loss(x, extra),
        "cosine": lambda x: cosine_loss(x, extra),
        "laplacian": lambda x: laplacian_loss(x, extra, edges),
        "raw laplacian": lambda x: laplacian_loss(x, extra, edges, aligned=False),
    }
    loss = losses[name]
    assert float(loss(extra)) == pytest.approx(0.0, abs=1e-12)
    moved = float(loss(turned(extra)))
    assert (moved < 1e-9) if name in ("dot", "laplacian") else (moved > 0.1)
    other = embedded(surface, seed=7)[0].requires_grad_(True)
    value = loss(other)
    (gradient,) = torch.autograd.grad(value, other)
    step, way = 1e-6, torch.from_numpy(np.random.default_rng(3).normal(size=extra.shape))
    if name == "laplacian":
        return  # its alignment moves with the values and is not differentiated, on purpose
    with torch.no_grad():
        slope = float(loss(other + step * way) - loss(other - step * way)) / (2 * step)
    assert float((gradient * way).sum()) == pytest.approx(slope, rel=1e-5)


def test_dot_loss_does_not_depend_on_the_size_of_the_mesh():
    surface = sphere(1)
    _, whole, faces, _ = embedded(surface)
    other = embedded(surface, seed=5)[1]
    assert float(dot_loss(other, whole, faces)) == pytest.approx(float(dot_loss(9.0 * other, 9.0 * whole, faces)))


def paper_loss(name, weight, extra, target, surface):
    """Return L + w L_lap as the paper has it, without any scaling, corner by corner and point by point."""
    points = surface.points
    mine, theirs = (np.hstack([points, values]) for values in (extra.numpy(), target.numpy()))
    neighbours = [set() for _ in points]
    for a, b in surface.edges:
        neighbours[a].add(b)
        neighbours[b].add(a)

    def laplacian(values):
        return np.array([values[list(near)].mean(axis=0) - values[i] for i, near in enumerate(neighbours)])

    def dots(values):
        return np.array(
            [
                (values[face[k - 2]] - values[face[k]]) @ (values[face[k - 1]] - values[face[k]])
                for face in surface.faces
                for k in range(3)
            ]
        )

    if name == "dot":
        first = np.mean((dots(mine) - dots(theirs)) ** 2)
    elif name == "l2":
        first = np.mean((mine - theirs) ** 2)
    else:
        norms = np.linalg.norm(mine[:, 3:], axis=1) * np.linalg.norm(theirs[:, 3:], axis=1)
        first = 1.0 - np.mean(np.einsum("ij,ij->i", mine[:, 3:], theirs[:, 3:]) / norms)
    return first + weight * np.mean((laplacian(mine) - laplacian(theirs)) ** 2)


def task_and_example(surface, target, norm="batch", **options):
    item = Item.of(surface, np.tile(np.eye(3), (surface.n_points, 1, 1)), target.numpy(), np.ones(surface.n_points))
    network = PaperOptions(channels=8, levels=1, norm=norm)
    task = EmbeddingTask(TrainingOptions(data="", out="", network=network, **options))
    return task, task.example(item, 0.0, np.random.default_rng(0), training=False)


@pytest.mark.parametrize("name", LOSSES)
@pytest.mark.parametrize("weight", [0.1, 0.5])
@pytest.mark.parametrize("size", [1.0, 0.2])
def test_losses_are_the_sum_of_the_paper_times_a_factor_of_the_target(name, weight, size):
    """Losses of two predictions have the ratio of the unscaled sums, so the weight is the w_lap of the paper."""
    surface = shaken(sphere(1))
    surface = surface.with_points(size * surface.points / surface.diagonal)
    rng = np.random.default_rng(0)
    target = torch.from_numpy(0.1 * size * rng.normal(size=(surface.n_points, 5)).astype(np.float32).astype(float))
    task, example = task_and_example(surface, target, loss=name, laplacian=weight, gauge="raw")
    ratios = []
    for amount in (0.05, 0.5, 2.0):
        extra = target + amount * size * torch.from_numpy(rng.normal(size=target.shape))
        losses = task.losses(lambda inputs, extra=extra: extra.float(), example)
        found = sum(map(float, losses.values()))
        ratios.append(found / paper_loss(name, weight, extra, target, surface))
    np.testing.assert_allclose(ratios, ratios[0], rtol=2e-4)


def test_losses_of_a_batch_are_the_sums_over_its_examples():
    surface = shaken(sphere(1))
    target = torch.from_numpy(np.random.default_rng(0).normal(size=(surface.n_points, 5)))
    for norm in ("batch", "mesh"):
        task, example = task_and_example(surface, target, norm=norm)
        network = task.network().eval()  # so that batch norms do not see the batch
        (*found,) = task.training_losses(network, iter([example, example]))
        assert len(found) == (1 if norm == "batch" else 2)
        once = task.losses(network, example)
        for name, value in once.items():
            total = sum(float(losses[name].detach()) for losses in found)
            assert total == pytest.approx(2.0 * float(value.detach()), rel=1e-4)
    assert list(task_and_example(surface, target)[0].training_losses(network, iter([]))) == []


def test_the_relative_scale_of_the_laplacian_is_the_value_for_zeros():
    surface = shaken(sphere(1))
    target = torch.from_numpy(np.random.default_rng(0).normal(size=(surface.n_points, 5)))
    options = {"laplacian": 0.1, "laplacian_scale": "relative", "gauge": "raw"}
    task, example = task_and_example(surface, target, **options)
    assert float(task.baseline_losses(example)["laplacian"]) == pytest.approx(0.1, rel=1e-5)


def test_the_laplacian_of_linear_values_on_a_regular_grid_is_zero_within():
    from anisomesh.learn.training.losses import _laplacian
    from anisomesh.shapes.analytic import open_patch

    patch = open_patch(lambda x, y: 0.0 * x, n=6)
    values = torch.from_numpy(patch.points @ np.random.default_rng(0).normal(size=(3, 2)))
    found = _laplacian(values, torch.from_numpy(patch.edges.astype(np.int64)))
    torch.testing.assert_close(
        found[~torch.from_numpy(patch.on_boundary.copy())].abs().max(), torch.tensor(0.0, dtype=torch.float64)
    )


def test_symmetries_of_the_augmentation_are_ten_and_targets_turn_with_the_mesh():
    turns = [symmetry(number) for number in range(N_SYMMETRIES)]
    different = {tuple(turn.round(6).ravel()) for turn in turns}
    assert len(different) == 10
    for turn in turns:
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert sum(np.linalg.det(np.reshape(turn, (3, 3))) < 0 for turn in different) == 3
    surface = shaken(sphere(2))
    surface = surface.with_points(surface.points / surface.diagonal)
    tensors = np.tile(np.diag([1.0, 2.0, 4.0]), (surface.n_points, 1, 1))
    extra = np.random.default_rng(0).normal(size=(surface.n_points, 5))
    item = Item.of(surface, tensors, extra, np.ones(surface.n_points, dtype=bool))
    options = TrainingOptions(data="", out="", network=PaperOptions(channels=8, levels=2))
    task, of_all = EmbeddingTask(options), EmbeddingTask(replace(options, symmetries="all"))
    assert (task.copies, of_all.copies) == (1, 10)
    plain = task.example(item, 0.0, np.random.default_rng(0), training=False)
    whole = torch.cat([plain.points, plain.extra], dim=1)
    for seed in range(20):
        if seed < 10:
            turn, rng = symmetry(seed), np.random.default_rng(0)
            example = of_all.example(item, 0.0, rng, training=True, copy=seed)
        else:
            turn = symmetry(int(np.random.default_rng(seed).integers(N_SYMMETRIES)))
            example = task.example(item, 0.0, np.random.default_rng(seed), training=True)
        points = example.points.numpy()
        np.testing.assert_allclose(points, surface.points @ turn.T, atol=1e-6)
        np.testing.assert_allclose(example.inputs.values[:, 3:], surface.point_normals @ turn.T * 1.0, atol=1e-5)
        moved = torch.cat([example.points, example.extra], dim=1)
        dots = corner_dots(moved, plain.faces)
        torch.testing.assert_close(dots, corner_dots(whole, plain.faces), atol=1e-4, rtol=1e-4)


@pytest.mark.parametrize(
    ("suite", "studied"), [("ablation-loss", {"loss", "augment"}), ("ablation-laplacian", {"laplacian", "gauge"})]
)
def test_networks_of_an_ablation_differ_in_what_it_studies_only(suite, studied):
    tables = {method.name: method.training for method in load_suite(suite).methods}
    found = {name: asdict(parse_training(name, {"data": "", "out": "", **table})) for name, table in tables.items()}
    first = next(iter(found.values()))
    for options in found.values():
        assert {name for name, value in options.items() if value != first[name]} <= studied
        assert options["network"] == asdict(PaperOptions())  # the paper's but for the channels
        assert (options["laplacian_scale"], options["keep"]) == ("paper", "last")
    whole = found.get("dot product", found.get("0.1, raw"))
    assert (whole["loss"], whole["laplacian"], whole["gauge"], whole["augment"]) == ("dot", 0.1, "raw", True)
