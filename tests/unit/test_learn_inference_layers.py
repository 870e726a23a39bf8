"""Networks in NumPy against the ones in torch, whose weights they read."""

import json
from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from anisomesh._kernels.products import add_product  # noqa: E402
from anisomesh.denoise.noise import with_noise  # noqa: E402
from anisomesh.learn.architecture import NORMS, SKIPS, NetworkOptions, PaperOptions  # noqa: E402
from anisomesh.learn.graphs.hierarchy import graph_hierarchy  # noqa: E402
from anisomesh.learn.inference.layers import sums_at_nodes  # noqa: E402
from anisomesh.learn.inference.on_device import network_on  # noqa: E402
from anisomesh.learn.inference.paper import PaperInference, paper_shapes  # noqa: E402
from anisomesh.learn.inference.predict import predict  # noqa: E402
from anisomesh.learn.inference.pretrained import pretrained_networks, weights_path  # noqa: E402
from anisomesh.learn.inference.stretch import StretchInference, stretch_shapes  # noqa: E402
from anisomesh.learn.models.checkpoint import load_weights, save_weights  # noqa: E402
from anisomesh.learn.models.paper import PaperNetwork, paper_input  # noqa: E402
from anisomesh.learn.models.stretch import StretchNetwork  # noqa: E402
from anisomesh.learn.weights_file import WeightsError, read_safetensors, read_weights  # noqa: E402
from anisomesh.mesh.surface import Surface  # noqa: E402
from anisomesh.shapes.analytic import ellipsoid, open_patch, sphere, torus  # noqa: E402


def unit(surface):
    return surface.with_points(surface.points / surface.diagonal)


def with_random_weights(network, seed):
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for values in network.parameters():
            values.copy_(torch.randn(values.shape, generator=generator) / max(values.shape[-1], 1) ** 0.5)
        for values in network.buffers():  # means and variances of norms
            values.copy_(values + 0.5 * torch.rand(values.shape, generator=generator))
    return network.eval()


def arrays_of(network):
    return {name: value.numpy() for name, value in network.state_dict().items()}


SURFACES = {
    "noisy ellipsoid": lambda: with_noise(unit(ellipsoid((1.0, 0.6, 0.35), 4)), 0.3, np.random.default_rng(0)),
    "sheet": lambda: unit(open_patch(lambda x, y: 0.3 * np.sin(4 * x) * y, n=17)),
    "tetrahedron": lambda: unit(
        Surface(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    ),
}


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("seed", range(2))
def test_the_default_network_is_the_one_of_torch(surface, seed):
    options = NetworkOptions(channels=12 + seed, scales=4, blocks=2 - seed, heads=3)
    network = with_random_weights(StretchNetwork(options), seed)
    hierarchy = graph_hierarchy(SURFACES[surface](), options.scales)
    lines, offsets = StretchInference(options, arrays_of(network))(hierarchy)
    with torch.inference_mode():
        wanted = network(hierarchy)
    for found, expected in ((lines, wanted.line_field.numpy()), (offsets, wanted.offsets.numpy())):
        assert found.dtype == np.float32
        np.testing.assert_allclose(found, expected, atol=1e-5 * max(1.0, float(np.abs(expected).max())))


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize(("seed", "skip"), list(enumerate(SKIPS)))
@pytest.mark.parametrize("norm", NORMS)
def test_the_network_of_the_paper_is_the_one_of_torch(surface, seed, skip, norm):
    options = PaperOptions(channels=12 + seed, levels=3 * seed, skip=skip, norm=norm)
    network = with_random_weights(PaperNetwork(options), seed)
    shape = SURFACES[surface]()
    extra = PaperInference(options, arrays_of(network))(shape)
    with torch.inference_mode():
        expected = network(paper_input(shape)).numpy()
    np.testing.assert_allclose(extra, expected, atol=1e-5 * max(1.0, float(np.abs(expected).max())))


@pytest.mark.parametrize("name", pretrained_networks())
def test_pretrained_networks_predict_the_same_with_and_without_torch(name):
    surface = unit(torus(1.0, 0.4, 60, 25))
    found, weights = predict(surface, name), weights_path(name)
    network = network_on(weights, "cpu")
    if isinstance(network, PaperInference):
        np.testing.assert_allclose(found.extra, network(surface), atol=1e-5)
    else:
        lines, _ = network(graph_hierarchy(surface, network.options.scales))
        mine, _ = StretchInference(network.options, read_weights(weights).arrays)(
            graph_hierarchy(surface, network.options.scales)
        )
        np.testing.assert_allclose(mine, lines, atol=1e-5)


def test_the_shapes_of_the_weights_are_the_ones_of_torch():
    for options in (NetworkOptions(channels=5, scales=3, blocks=1, heads=2), NetworkOptions()):
        wanted = {name: tuple(value.shape) for name, value in StretchNetwork(options).state_dict().items()}
        assert stretch_shapes(options) == wanted
    for options in (PaperOptions(channels=5, levels=2), PaperOptions(channels=6, levels=0), PaperOptions()):
        wanted = {name: tuple(value.shape) for name, value in PaperNetwork(options).state_dict().items()}
        assert paper_shapes(options) == wanted


@pytest.mark.parametrize("terms", [1, 3, 4, 6, 64])
def test_products_are_sums_in_order(terms):
    rng = np.random.default_rng(terms)
    x, weight = (rng.normal(size=shape).astype(np.float32) for shape in ((7, terms), (terms, 5)))
    start = rng.normal(size=(7, 5)).astype(np.float32)
    out = start.copy()
    add_product(x, weight, out)
    expected = start.copy()
    for k in range(terms):
        expected += x[:, k : k + 1] * weight[k]
    np.testing.assert_array_equal(out, expected)


def test_sums_at_nodes_skip_nodes_without_edges():
    first = np.array([0, 2, 2, 3, 3])
    values = np.arange(6, dtype=np.float32).reshape(3, 2)
    np.testing.assert_array_equal(sums_at_nodes(values, first), [[2, 4], [0, 0], [4, 5], [0, 0]])


def test_a_file_is_read_as_torch_wrote_it(tmp_path):
    network = with_random_weights(StretchNetwork(NetworkOptions(channels=4, scales=2, blocks=1, heads=1)), 0)
    save_weights(network, tmp_path / "w.safetensors", {"epoch": 3})
    weights = read_weights(tmp_path / "w.safetensors")
    assert weights.options == network.options
    assert weights.facts == {"epoch": 3}
    for name, value in network.state_dict().items():
        np.testing.assert_array_equal(weights.arrays[name], value.numpy())
    again, _ = load_weights(tmp_path / "w.safetensors")
    assert all(torch.equal(a, b) for a, b in zip(again.parameters(), network.parameters(), strict=True))


def test_a_file_of_the_paper_network_keeps_its_options_and_an_old_one_its_meaning(tmp_path):
    path = tmp_path / "w.safetensors"
    options = PaperOptions(channels=4, levels=1, skip="before", norm="mesh")
    save_weights(with_random_weights(PaperNetwork(options), 0), path, {})
    assert read_weights(path).options == options
    data = path.read_bytes()
    length = int.from_bytes(data[:8], "little")
    table = json.loads(data[8 : 8 + length])
    table["__metadata__"]["network"] = '{"channels": 4, "levels": 1, "ratio": 0.5}'  # before there were skip and norm
    head = json.dumps(table).encode()
    path.write_bytes(len(head).to_bytes(8, "little") + head + data[8 + length :])
    assert read_weights(path).options == replace(options, skip="after")
    assert read_weights(weights_path("paper")).options == PaperOptions(channels=64, skip="after", norm="mesh")


def test_damaged_files_are_refused(tmp_path):
    network = StretchNetwork(NetworkOptions(channels=4, scales=2, blocks=1, heads=1))
    good, path = tmp_path / "good.safetensors", tmp_path / "bad.safetensors"
    save_weights(network, good, {})
    data = good.read_bytes()
    length = int.from_bytes(data[:8], "little")
    table = json.loads(data[8 : 8 + length])

    def rewritten(change):
        changed = json.loads(json.dumps(table))
        change(changed)
        head = json.dumps(changed).encode()
        return len(head).to_bytes(8, "little") + head + data[8 + length :]

    broken = [
        b"",
        data[:7],
        data[: 8 + length // 2],
        data[:-4],
        (2**63).to_bytes(8, "little") + data[8:],
        rewritten(lambda t: t["rise.bias"].update(dtype="Q4")),
        rewritten(lambda t: t["rise.bias"].update(shape=[2])),
        rewritten(lambda t: t["rise.bias"].update(data_offsets=[-4, 8])),
        rewritten(lambda t: t.update({"rise.bias": 3})),
        rewritten(lambda t: t["__metadata__"].pop("kind")),
        rewritten(lambda t: t["__metadata__"].update(network="[1]")),
        rewritten(lambda t: t["__metadata__"].update(network='{"channels": 0}')),
    ]
    for content in broken:
        path.write_bytes(content)
        with pytest.raises(WeightsError, match=r"bad\.safetensors"):
            read_weights(path)
    for change in (
        lambda t: t.pop("rise.bias"),
        lambda t: t.update(other=t["rise.bias"]),
        lambda t: t["__metadata__"].update(network='{"channels": 8}'),
    ):
        path.write_bytes(rewritten(change))
        with pytest.raises(WeightsError, match="does not hold the weights of a known network"):
            predict(unit(sphere(2)), path)
    with pytest.raises(WeightsError, match="cannot be read"):
        read_safetensors(tmp_path / "missing.safetensors")
