"""The learnt filter of normals: a bilateral one before training, the same with and without torch, and it learns."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from anisomesh.denoise.filters import FaceNeighbours, bilateral_filtered, taubin_smoothed  # noqa: E402
from anisomesh.denoise.noise import with_noise  # noqa: E402
from anisomesh.learn.architecture import FilterOptions  # noqa: E402
from anisomesh.learn.data.items import Item  # noqa: E402
from anisomesh.learn.graphs.faces import FILTER_ROUNDS, NORMAL_WIDTH, face_graph  # noqa: E402
from anisomesh.learn.inference.normals import NormalFilterInference  # noqa: E402
from anisomesh.learn.models.normals import NormalFilter  # noqa: E402
from anisomesh.learn.training.config import TrainingOptions  # noqa: E402
from anisomesh.learn.training.tasks import FilterTask  # noqa: E402
from anisomesh.mesh.surface import Surface  # noqa: E402
from anisomesh.shapes.analytic import box, ellipsoid, open_patch, torus  # noqa: E402

SMALL = FilterOptions(channels=8, blocks=2, rounds=2)


def noisy_and_moved(clean, size=0.3):
    noisy = with_noise(clean, size, np.random.default_rng(0))
    return noisy, taubin_smoothed(noisy, 2)


def untrained(options=SMALL):
    torch.manual_seed(0)
    return NormalFilter(options)


def with_random_head(network):
    with torch.no_grad():
        network.of_pairs.weight.normal_(std=0.3)
        for block in network.blocks:
            block.out.weight.normal_(std=0.3)
    return network


def inference(network):
    return NormalFilterInference(network.options, {name: value.numpy() for name, value in network.state_dict().items()})


SURFACES = {
    "ellipsoid": lambda: ellipsoid((1.0, 0.6, 0.35), 3),
    "box": lambda: box(n=6),
    "sheet": lambda: open_patch(lambda x, y: 0.3 * np.sin(4 * x) * y, n=15),
}


def test_neighbours_share_a_point():
    surface = torus(1.0, 0.4, 12, 6)
    found = FaceNeighbours.of(surface)
    for face in range(0, surface.n_faces, 7):
        wanted = np.flatnonzero(np.isin(surface.faces, surface.faces[face]).any(axis=1))
        np.testing.assert_array_equal(np.sort(found.neighbour[found.face == face]), wanted)


@pytest.mark.parametrize("surface", SURFACES)
def test_before_its_training_the_filter_is_bilateral(surface):
    noisy, moved = noisy_and_moved(SURFACES[surface]())
    options = FilterOptions(channels=8, blocks=1, rounds=FILTER_ROUNDS)
    wanted = bilateral_filtered(moved, rounds=FILTER_ROUNDS, normal_width=NORMAL_WIDTH)
    np.testing.assert_allclose(inference(untrained(options))(noisy, moved).points, wanted.points, atol=1e-12)
    with torch.no_grad():
        found = untrained(options)(face_graph(noisy, moved)).points
    np.testing.assert_allclose(found.numpy(), wanted.points, atol=1e-5)


@pytest.mark.parametrize("surface", SURFACES)
def test_the_filter_is_the_one_of_torch(surface):
    noisy, moved = noisy_and_moved(SURFACES[surface]())
    network = with_random_head(untrained())
    found = inference(network)(noisy, moved)
    with torch.no_grad():
        wanted = network(face_graph(noisy, moved)).points.numpy()
    np.testing.assert_allclose(found.points, wanted, atol=1e-5)
    assert np.abs(found.points - bilateral_filtered(moved, rounds=2, normal_width=NORMAL_WIDTH).points).max() > 1e-3


def test_the_filtered_mesh_turns_and_grows_with_the_mesh():
    noisy, moved = noisy_and_moved(SURFACES["box"]())
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    order, faces = rng.permutation(noisy.n_points), rng.permutation(noisy.n_faces)

    def placed(surface):
        return Surface(7.0 * surface.points[order] @ turn.T + 3.0, np.argsort(order)[surface.faces][faces])

    apply = inference(with_random_head(untrained()))
    wanted = 7.0 * apply(noisy, moved).points[order] @ turn.T + 3.0
    np.testing.assert_allclose(apply(placed(noisy), placed(moved)).points, wanted, atol=1e-4)


def test_points_on_the_boundary_stay():
    noisy, moved = noisy_and_moved(SURFACES["sheet"]())
    found = inference(with_random_head(untrained()))(noisy, moved)
    np.testing.assert_array_equal(found.points[moved.on_boundary], moved.points[moved.on_boundary])


def test_training_beats_the_bilateral_filter_on_its_example():
    clean = box(n=8)
    clean = clean.with_points(clean.points / clean.diagonal)
    n = clean.n_points
    item = Item.of(clean, np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 5)), np.ones(n, dtype=bool))
    task = FilterTask(TrainingOptions(data="", out="", network=SMALL))
    example = task.example(item, 0.3, np.random.default_rng(0), training=True)
    network = untrained()
    optimiser = torch.optim.Adam(network.parameters(), lr=0.02)
    bar = sum(map(float, task.baseline_losses(example).values()))
    for _ in range(40):
        optimiser.zero_grad()
        loss = torch.stack(list(task.losses(network, example).values())).sum()
        loss.backward()
        optimiser.step()
    assert float(loss.detach()) < 0.8 * bar
