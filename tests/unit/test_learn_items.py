"""Items of a data set: written and read again, damaged files refused, targets of variants against the clean shape."""

import numpy as np
import pytest
import trimesh

from anisomesh.errors import MeshFileError, OptionError
from anisomesh.learn.data.items import Item, load_item, save_item
from anisomesh.learn.data.make import UnsuitableError, even_mesh, items_of_blobs, items_of_mesh
from anisomesh.learn.data.recipe import Recipe
from anisomesh.mesh.distance import surface_distance
from anisomesh.mesh.geometry import thickness
from anisomesh.metric.curvature import principal_curvatures
from anisomesh.metric.tensors import curvature_metric, validate_metric
from anisomesh.pipeline import remesh
from anisomesh.shapes.analytic import box, ellipsoid, sphere, torus
from anisomesh.shapes.implicit import Blobs

RECIPE = Recipe(target=500)


@pytest.fixture(scope="module")
def made():
    return items_of_mesh(ellipsoid((1.0, 0.5, 0.3), 3), RECIPE, np.random.default_rng(0), remesh)


def random_item(n=30):
    rng = np.random.default_rng(0)
    surface = sphere(1)
    root = rng.normal(size=(surface.n_points, 3, 3))
    tensors = root @ root.transpose(0, 2, 1) + np.eye(3)
    extra = rng.normal(size=(surface.n_points, 5))
    return surface, tensors, Item.of(surface, tensors, extra, rng.random(surface.n_points) > 0.5)


def test_an_item_comes_back_from_its_file_as_it_was(tmp_path):
    surface, tensors, item = random_item()
    save_item(item, tmp_path / "a.npz")
    again = load_item(tmp_path / "a.npz")
    for name in ("points", "faces", "metric", "extra", "trusted"):
        np.testing.assert_array_equal(getattr(again, name), getattr(item, name))
        assert getattr(again, name).dtype == getattr(item, name).dtype
    np.testing.assert_allclose(again.tensors, tensors, rtol=1e-6)
    np.testing.assert_allclose(again.surface.points, surface.points, rtol=1e-6)


@pytest.mark.parametrize("damage", ["cut", "empty", "missing", "text", "shape", "pickle"])
def test_damaged_files_are_refused(tmp_path, damage):
    path = tmp_path / "a.npz"
    item = random_item()[2]
    save_item(item, path)
    data = path.read_bytes()
    if damage == "missing":
        path.unlink()
    elif damage == "shape":
        np.savez(
            path, points=item.points[:5], faces=item.faces, metric=item.metric, extra=item.extra, trusted=item.trusted
        )
    elif damage == "pickle":
        names = ("faces", "metric", "extra", "trusted")
        np.savez(path, points=np.array([{}], dtype=object), **{name: getattr(item, name) for name in names})
    else:
        path.write_bytes({"cut": data[: len(data) // 2], "empty": b"", "text": b"hello"}[damage])
    with pytest.raises(MeshFileError, match=r"a\.npz"):
        load_item(path)


@pytest.mark.slow
def test_an_input_mesh_becomes_an_item_with_the_metric_measured_on_it():
    surface = ellipsoid((1.0, 0.5, 0.3), 4)  # 2,562 points
    recipe = Recipe(target=1_500, variants=("given",))
    made = items_of_mesh(surface, recipe, np.random.default_rng(0), remesh)
    assert [entry.kind for entry in made] == ["even", "given"]
    item = made[1].item
    unit = surface.points / surface.diagonal
    np.testing.assert_allclose(np.linalg.norm(np.ptp(item.points, axis=0)), 1.0, atol=1e-6)
    offset = item.points[: len(unit)] - unit
    np.testing.assert_allclose(offset, np.broadcast_to(offset.mean(axis=0), offset.shape), atol=1e-6)
    wanted = curvature_metric(item.surface, principal_curvatures(item.surface))
    np.testing.assert_allclose(item.tensors, wanted, rtol=1e-3, atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("reason", ["needles", "many points", "even as it is"])
def test_an_input_mesh_that_teaches_nothing_becomes_no_item(reason):
    surface = ellipsoid((1.0, 0.5, 0.3), 3)
    recipe = Recipe(target=100 if reason == "many points" else 600, variants=("given",))
    if reason == "needles":
        surface = torus(1.0, 0.3, 120, 6)
    assert [entry.kind for entry in items_of_mesh(surface, recipe, np.random.default_rng(0), remesh)] == ["even"]


@pytest.mark.slow
def test_the_items_of_a_mesh_are_its_even_mesh_and_the_variants(made):
    assert [entry.kind for entry in made] == ["even", "decimated", "stretched"]
    even = made[0].item.surface
    assert 300 <= even.n_points <= 800
    for entry in made:
        mesh = entry.item.surface
        assert np.linalg.norm(np.ptp(mesh.points, axis=0)) == pytest.approx(1.0, abs=0.03)
        assert surface_distance(even, mesh, 2_000).hausdorff < 0.03
        validate_metric(entry.item.tensors, mesh)
        assert entry.facts["points"] == mesh.n_points
        assert entry.facts["residual"] <= RECIPE.max_residual
    assert made[1].item.surface.n_points <= 0.76 * even.n_points
    shapes = [thickness(entry.item.surface.points[entry.item.surface.faces]).mean() for entry in made]
    assert shapes[2] < 0.75 * shapes[0]


@pytest.mark.slow
def test_variants_have_the_metric_of_the_clean_mesh_not_their_own(made):
    clean = made[0].item
    for entry in made[1:]:
        for point, tensor in zip(entry.item.points[::7], entry.item.tensors[::7], strict=True):
            nearest = np.argmin(np.linalg.norm(clean.points - point, axis=1))
            same = np.linalg.norm(clean.points[nearest] - point) < 1e-6
            error = np.abs(tensor - clean.tensors[nearest]).max() / np.abs(tensor).max()
            assert error < (1e-3 if same else 1.0)
    exact = np.isin(made[1].item.points.round(6), clean.points.round(6)).all(axis=1)
    assert exact.mean() > 0.9  # decimation keeps points


@pytest.mark.slow
def test_items_of_implicit_shapes_have_exact_curvature_at_every_point():
    blobs = Blobs.random(np.random.default_rng(3))
    made = items_of_blobs(blobs, RECIPE, np.random.default_rng(0), remesh)
    assert [entry.kind for entry in made] == ["even", "decimated", "stretched"]
    frames = []
    for entry in made:
        tensors = entry.item.tensors
        eigenvalues = np.linalg.eigvalsh(tensors)
        np.testing.assert_allclose(eigenvalues[:, :2], 1.0, atol=1e-4)  # the paper's metric: 1, 1, r^2
        frames.append(np.sqrt(eigenvalues[:, 2]).mean())
        assert entry.item.trusted.all()
    np.testing.assert_allclose(frames, frames[0], rtol=0.15)


@pytest.mark.slow
def test_round_and_flat_shapes_are_unsuitable():
    for shape in (sphere(3), box(n=8)):
        with pytest.raises(UnsuitableError, match="flat or round everywhere"):
            items_of_mesh(shape, Recipe(target=500, min_stretch=1.35), np.random.default_rng(0), remesh)


@pytest.mark.slow
def test_only_uneven_meshes_and_wrong_sizes_are_remeshed():
    good = sphere(3)
    assert even_mesh(good, Recipe(target=600), remesh) is good
    for recipe, mesh in (
        (Recipe(target=300), good),
        (Recipe(target=600), good.with_points(good.points * [1.0, 1.0, 0.3])),
        (Recipe(target=600), box(n=1)),
    ):
        made = even_mesh(mesh, recipe, remesh)
        assert made.n_points == recipe.target
        assert thickness(made.points[made.faces]).mean() > 0.3


@pytest.mark.slow
def test_the_same_seed_gives_the_same_items(made):
    again = items_of_mesh(ellipsoid((1.0, 0.5, 0.3), 3), RECIPE, np.random.default_rng(0), remesh)
    for first, second in zip(made, again, strict=True):
        np.testing.assert_array_equal(first.item.points, second.item.points)
        np.testing.assert_array_equal(first.item.extra, second.item.extra)


@pytest.mark.parametrize("wrong", [{"target": 10}, {"variants": ("melted",)}, {"evening": "iron"}])
def test_invalid_recipes_are_refused(wrong):
    with pytest.raises(OptionError):
        Recipe(**wrong)


@pytest.mark.slow
@pytest.mark.parametrize("surface", [box(n=3), torus()])
def test_evening_with_tetwild_keeps_the_shape_and_which_side_is_out(surface):
    pytest.importorskip("pytetwild")
    even = even_mesh(surface, Recipe(target=600, evening="tetwild"), remesh)
    assert even.n_points == 600
    assert even.area == pytest.approx(surface.area, rel=0.02)
    volumes = [trimesh.Trimesh(each.points, each.faces, process=False).volume for each in (even, surface)]
    assert volumes[0] == pytest.approx(volumes[1], rel=0.05)  # negative if turned inside out


def test_evening_with_a_missing_package_names_it(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(OptionError, match="pip install pytetwild"):
        even_mesh(sphere(1), Recipe(target=600, evening="tetwild"), remesh)
