"""Transfer of attributes: exact where it can be, of second order elsewhere, and never across a seam."""

import dataclasses

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from anisomesh import Mesh, MeshError, MeshFileError, Regions, Surface, save, transfer_attributes
from anisomesh.attributes.blend import Blend, blend_skin
from anisomesh.io.objects.write import to_meshio, to_pyvista
from anisomesh.shapes.analytic import box, sphere

RNG = np.random.default_rng(5)


def turned(surface, seed=3):
    return surface.with_points(surface.points @ Rotation.random(random_state=seed).as_matrix().T)


def centres(surface):
    return surface.points[surface.faces].mean(axis=1)


def sides_of(surface):
    """The side of a box, 0 to 5, that each face is on."""
    return np.argmax(np.concatenate([surface.face_normals, -surface.face_normals], axis=1), axis=1)


def unrolled(surface):
    """Longitude and latitude (F, 3, 2) of the corners of a sphere, from 0 to 1, with a seam at longitude 0."""
    corners = surface.points[surface.faces]
    longitude = np.arctan2(corners[..., 1], corners[..., 0]) / (2.0 * np.pi) % 1.0
    middle = np.arctan2(*centres(surface)[:, 1::-1].T) / (2.0 * np.pi) % 1.0
    longitude += np.round(middle[:, None] - longitude)
    latitude = np.arcsin(np.clip(corners[..., 2] / np.linalg.norm(corners, axis=2), -1.0, 1.0)) / np.pi + 0.5
    return np.stack([longitude, latitude], axis=2)


def sphere_with_seam(n=6):
    """A sphere of meridians and parallels, so that a meridian is the seam."""
    rows, columns = 8 * n, 16 * n
    polar, around = np.linspace(0.0, np.pi, rows + 1)[1:-1], np.arange(columns) / columns * 2.0 * np.pi
    grid = np.stack(
        [
            np.outer(np.sin(polar), np.cos(around)),
            np.outer(np.sin(polar), np.sin(around)),
            np.outer(np.cos(polar), np.ones(columns)),
        ],
        axis=2,
    ).reshape(-1, 3)
    points = np.concatenate([grid, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
    i, j = np.meshgrid(np.arange(rows - 2), np.arange(columns), indexing="ij")
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = a + columns, b + columns
    k, m = np.arange(columns), (np.arange(columns) + 1) % columns
    last = (rows - 2) * columns
    faces = [np.stack([a, c, b], -1).reshape(-1, 3), np.stack([b, c, d], -1).reshape(-1, 3)]
    faces += [np.stack([np.full(columns, len(grid)), k, m], -1)]
    faces += [np.stack([np.full(columns, len(grid) + 1), last + m, last + k], -1)]
    return Surface(points, np.concatenate(faces))


def test_a_linear_field_is_exact_on_flat_faces():
    source, target = box((1.0, 0.7, 0.5), n=5), box((1.0, 0.7, 0.5), n=7)
    gradient = np.array([1.0, -2.0, 3.0])
    corners = source.points[source.faces]
    mesh = Mesh(
        surface=source,
        point_data={"t": source.points @ gradient, "v": source.points},
        corner_data={"c": corners @ gradient},
        face_data={"side": sides_of(source)},
        regions={"side": Regions(sides_of(source), {0: "right"})},
    )
    result = transfer_attributes(mesh, target)
    np.testing.assert_allclose(result.point_data["t"], target.points @ gradient, atol=1e-6)
    np.testing.assert_allclose(result.point_data["v"], target.points, atol=1e-6)
    np.testing.assert_allclose(result.corner_data["c"], target.points[target.faces] @ gradient, atol=1e-6)
    np.testing.assert_array_equal(result.face_data["side"], sides_of(target))
    np.testing.assert_array_equal(result.regions["side"].labels, sides_of(target))
    assert result.regions["side"].names == {0: "right"}


def test_a_linear_field_is_of_second_order_on_a_sphere():
    errors = []
    for level in (3, 4):
        source, target = sphere(level), turned(sphere(4))
        mesh = Mesh(
            surface=source, point_data={"x": source.points[:, 0]}, corner_data={"v": source.points[source.faces]}
        )
        result = transfer_attributes(mesh, target)
        errors.append(
            [
                np.abs(result.point_data["x"] - target.points[:, 0]).mean(),
                np.linalg.norm(result.corner_data["v"] - target.points[target.faces], axis=2).mean(),
            ]
        )
    ratio = np.divide(*errors)
    assert (ratio > 3.0).all()
    assert (ratio < 5.5).all()


def test_the_same_surface_has_everything_unchanged():
    surface = sphere(2)
    mesh = Mesh(
        surface=surface,
        point_data={"a": RNG.random(surface.n_points), "name": np.array([f"p{k}" for k in range(surface.n_points)])},
        face_data={"b": RNG.integers(0, 9, (surface.n_faces, 2))},
        corner_data={"c": RNG.random((surface.n_faces, 3, 2))},
        regions={"r": Regions(RNG.integers(0, 3, surface.n_faces))},
        features=surface.edges[:7],
        fixed_points=[3, 4],
        materials={"skin": object()},
    )
    result = transfer_attributes(mesh, Surface(surface.points, surface.faces))
    for data in ("point_data", "face_data", "corner_data"):
        for name, values in getattr(mesh, data).items():
            np.testing.assert_array_equal(getattr(result, data)[name], values)
    np.testing.assert_array_equal(result.regions["r"].labels, mesh.regions["r"].labels)
    np.testing.assert_array_equal(result.features, mesh.features)
    assert result.fixed_points.tolist() == [3, 4]
    assert result.materials == mesh.materials


def test_reordered_faces_have_everything_of_their_own():
    """The same surface, but not recognised as such: all values are found again, whichever charts there are."""
    surface = sphere(2)
    mesh = Mesh(
        surface=surface,
        point_data={"a": RNG.random(surface.n_points), "k": np.arange(surface.n_points)},
        face_data={"b": RNG.random(surface.n_faces), "k": np.arange(surface.n_faces)},
        corner_data={"c": RNG.random((surface.n_faces, 3, 2)), "uv": unrolled(surface)},
        features=surface.edges[::9],
        fixed_points=np.arange(0, surface.n_points, 5),
    )
    order = RNG.permutation(surface.n_faces)
    result = transfer_attributes(mesh, Surface(surface.points, surface.faces[order]))
    np.testing.assert_allclose(result.point_data["a"], mesh.point_data["a"], atol=1e-12)
    np.testing.assert_array_equal(result.point_data["k"], mesh.point_data["k"])
    for name in ("b", "k"):
        np.testing.assert_array_equal(result.face_data[name], mesh.face_data[name][order])
    for name in ("c", "uv"):
        np.testing.assert_allclose(result.corner_data[name], mesh.corner_data[name][order], atol=1e-9)
    assert set(map(tuple, result.features.tolist())) == set(map(tuple, mesh.features.tolist()))
    np.testing.assert_array_equal(result.fixed_points, mesh.fixed_points)


def test_the_order_of_the_faces_does_not_matter():
    source, target = box((1.0, 1.0, 0.4), n=4), box((1.0, 1.0, 0.4), n=6)
    mesh = Mesh(
        surface=source,
        point_data={"a": RNG.random(source.n_points), "k": np.arange(source.n_points)},
        face_data={"b": RNG.random(source.n_faces), "k": np.arange(source.n_faces) % 7},
        corner_data={"uv": RNG.random((source.n_faces, 3, 2)), "v": source.points[source.faces]},
        regions={"r": Regions(sides_of(source))},
    )
    order = RNG.permutation(source.n_faces)
    shuffled = Mesh(
        surface=Surface(source.points, source.faces[order]),
        point_data=mesh.point_data,
        face_data={name: values[order] for name, values in mesh.face_data.items()},
        corner_data={name: values[order] for name, values in mesh.corner_data.items()},
        regions={"r": Regions(mesh.regions["r"].labels[order])},
    )
    first, second = (transfer_attributes(each, target) for each in (mesh, shuffled))
    for data in ("point_data", "face_data", "corner_data"):
        for name, values in getattr(first, data).items():
            np.testing.assert_array_equal(getattr(second, data)[name], values)
    np.testing.assert_array_equal(first.regions["r"].labels, second.regions["r"].labels)


def test_whole_numbers_and_bools_are_not_interpolated():
    source, target = sphere(3), turned(sphere(3))
    number = RNG.choice([3, 1000], source.n_points)
    mesh = Mesh(surface=source, point_data={"k": number, "b": number > 10, "s": number.astype(str)})
    result = transfer_attributes(mesh, target)
    assert set(result.point_data["k"]) == {3, 1000}
    np.testing.assert_array_equal(result.point_data["b"], result.point_data["k"] > 10)
    np.testing.assert_array_equal(result.point_data["s"], result.point_data["k"].astype(str))
    assert [result.point_data[name].dtype for name in "kbs"] == [mesh.point_data[name].dtype for name in "kbs"]


def test_colours_of_bytes_are_interpolated_and_rounded():
    source, target = sphere(4), turned(sphere(4))
    colour = np.rint(255.0 * (0.5 + 0.5 * source.points)).astype(np.uint8)
    result = transfer_attributes(Mesh(surface=source, point_data={"color": colour}), target).point_data["color"]
    assert result.dtype == np.uint8
    assert np.abs(result - 255.0 * (0.5 + 0.5 * target.points)).max() < 1.5


def test_normals_and_tangents_keep_their_length():
    source, target = sphere(2), turned(sphere(3))
    tangent = np.cross(source.points, [0.0, 0.0, 1.0]) + 1e-3
    tangent = np.concatenate(
        [tangent / np.linalg.norm(tangent, axis=1)[:, None], np.ones((source.n_points, 1))], axis=1
    )
    mesh = Mesh(surface=source, point_data={"Normals": source.points.astype(np.float32), "TANGENT": tangent})
    result = transfer_attributes(mesh, target).point_data
    np.testing.assert_allclose(np.linalg.norm(result["Normals"], axis=1), 1.0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(result["TANGENT"][:, :3], axis=1), 1.0, atol=1e-12)
    assert set(result["TANGENT"][:, 3]) == {1.0}
    assert result["Normals"].dtype == np.float32


@pytest.mark.parametrize("values", [[5.0, np.nan, 2.0], [np.nan, 3.0 + 2.0j, np.nan], [np.nan, np.inf, np.nan]])
def test_a_value_between_missing_ones_is_the_mean_of_the_others(values):
    """Regression: it was the value of the nearest corner, and missing wherever that one was."""
    weights = np.concatenate([RNG.dirichlet(np.ones(3), 50), [[0.0, 0.5, 0.5], [1.0, 0.0, 0.0], [0.3, 0.0, 0.7]]])
    values = np.array(values)
    known = np.isfinite(values)
    corners = np.repeat(values[None, :], len(weights), axis=0)
    found = Blend("field", values).at(corners, weights, np.argmax(weights, axis=1))
    shares = weights[:, known]
    total = shares.sum(axis=1)
    expected = (shares @ values[known])[total > 0.0] / total[total > 0.0]
    np.testing.assert_allclose(found[total > 0.0], expected, rtol=1e-12)
    assert not np.isfinite(found[total == 0.0]).any()


def test_missing_values_and_directions_stay_local():
    source, target = sphere(2), turned(sphere(3))
    gone = source.points[:, 2] > 0.5
    measured, normals = source.points[:, 0].copy(), source.points.astype(np.float32)
    measured[gone], normals[gone] = np.nan, np.nan
    mesh = Mesh(surface=source, point_data={"measured": measured, "Normals": normals})
    result = transfer_attributes(mesh, target).point_data
    missing = np.isnan(result["measured"])
    assert missing.any()
    assert not missing[target.points[:, 2] < 0.5].any()
    assert np.abs(result["measured"] - target.points[:, 0])[~missing].max() < source.edge_lengths.max()
    np.testing.assert_array_equal(np.isnan(result["Normals"]).any(axis=1), missing)
    np.testing.assert_allclose(np.linalg.norm(result["Normals"][~missing], axis=1), 1.0, atol=1e-6)


def test_weights_of_joints_are_the_interpolated_ones_and_sum_to_one():
    source, target = sphere(3), turned(sphere(3))
    dense = RNG.random((source.n_points, 4)) ** 3
    dense /= dense.sum(axis=1, keepdims=True)
    joints = np.argsort(RNG.random(dense.shape), axis=1)
    shares = np.take_along_axis(dense, joints, axis=1).astype(np.float32)
    mesh = Mesh(
        surface=source,
        point_data={
            "JOINTS_0": joints.astype(np.uint16),
            "WEIGHTS_0": shares,
            "skin_weights": dense.astype(np.float32),
        },
    )
    result = transfer_attributes(mesh, target).point_data
    spread = np.zeros((target.n_points, 4))
    np.put_along_axis(spread, result["JOINTS_0"].astype(np.int64), result["WEIGHTS_0"], axis=1)
    np.testing.assert_allclose(spread, result["skin_weights"], atol=1e-6)
    for name in ("WEIGHTS_0", "skin_weights"):
        np.testing.assert_allclose(result[name].sum(axis=1), 1.0, atol=1e-6)
    assert result["JOINTS_0"].dtype == np.uint16


def test_of_many_joints_the_heaviest_stay():
    joints = np.arange(6).reshape(1, 3, 2)
    shares = np.array([[[0.9, 0.1], [0.6, 0.4], [0.5, 0.5]]])
    numbers, parts = blend_skin(joints, shares, np.array([[0.5, 0.3, 0.2]]))
    assert numbers.tolist() == [[0, 2]]
    np.testing.assert_allclose(parts, [[0.45 / 0.63, 0.18 / 0.63]])


def test_an_atlas_of_a_box_has_every_corner_on_its_own_chart():
    source, target = box((1.0, 1.0, 1.0), n=3), box((1.0, 1.0, 1.0), n=5)

    def atlas(surface):
        side, corners = sides_of(surface), surface.points[surface.faces]
        axes = np.array([[1, 2], [0, 2], [0, 1]])[side % 3]
        across = np.take_along_axis(corners, axes[:, None, :].repeat(3, axis=1), axis=2)
        return np.stack([(0.1 + side[:, None] + 0.8 * across[..., 0]) / 6.0, across[..., 1]], axis=2)

    result = transfer_attributes(Mesh(surface=source, corner_data={"uv": atlas(source)}), target)
    np.testing.assert_allclose(result.corner_data["uv"], atlas(target), atol=1e-9)


@pytest.mark.parametrize("off", [0.0, 0.03])
def test_no_face_reaches_across_a_seam(off):
    """The seam is inside one chart, and is followed by edges of the target or, turned by ``off``, is not."""
    source, target = sphere_with_seam(), sphere_with_seam(3)
    target = target.with_points(target.points @ Rotation.from_euler("z", off).as_matrix().T)
    result = transfer_attributes(Mesh(surface=source, corner_data={"uv": unrolled(source)}), target).corner_data["uv"]
    assert result[..., 0].min() > -1e-9
    assert result[..., 0].max() < 1.0 + 1e-9
    away = np.abs(target.points[target.faces][..., 2]).max(axis=1) < 0.99
    assert np.ptp(result[away, :, 0], axis=1).max() < 0.2
    apart = result[..., 0] - unrolled(target)[..., 0]
    apart -= np.round(apart)
    assert np.abs(apart[away]).max() < (1e-3 if off == 0.0 else 0.03)


def test_seams_in_point_data_become_corner_data():
    """As in a GLB file: a point is repeated for each side of a seam."""
    welded, target = sphere_with_seam(2), sphere_with_seam(3)
    uv = unrolled(welded).reshape(-1, 2)
    rows, number = np.unique(
        np.concatenate([welded.faces.reshape(-1, 1), uv.round(9)], axis=1), axis=0, return_inverse=True
    )
    source = Surface(welded.points[rows[:, 0].astype(int)], number.reshape(-1, 3))
    mesh = Mesh(surface=source, point_data={"uv": rows[:, 1:], "z": source.points[:, 2]})
    result = transfer_attributes(mesh, target)
    assert list(result.point_data) == ["z"]
    expected = transfer_attributes(Mesh(surface=welded, corner_data={"uv": unrolled(welded)}), target)
    np.testing.assert_allclose(result.corner_data["uv"], expected.corner_data["uv"], atol=1e-8)


def test_the_sides_of_a_thin_plate_are_not_mixed():
    """The target is off by more than half the thickness, so the other side is often nearer."""
    source, target = (box((1.0, 1.0, 0.01), n=n) for n in (12, 9))
    source, target = (each.with_points(each.points - [0.5, 0.5, 0.005]) for each in (source, target))
    moved = target.points + np.where(np.abs(target.points[:, :2]).max(axis=1) < 0.45, 0.008, 0.0)[:, None] * [0, 0, 1]
    target = target.with_points(moved)
    top = source.face_normals[:, 2] > 0.5
    mesh = Mesh(
        surface=source,
        face_data={"top": top, "t": top.astype(float)},
        point_data={"z": np.sign(source.points[:, 2])},
        corner_data={"c": np.sign(source.points[source.faces][..., 2]) + 2.0 * top[:, None]},
        regions={"top": Regions(top.astype(int))},
    )
    inner = np.abs(centres(target)[:, :2]).max(axis=1) < 0.4
    up = target.face_normals[:, 2] > 0.5
    for divided in (mesh, dataclasses.replace(mesh, regions={})):
        result = transfer_attributes(divided, target)
        np.testing.assert_array_equal(result.face_data["top"][inner], up[inner])
        np.testing.assert_array_equal(result.face_data["t"][inner], up[inner])
        np.testing.assert_allclose(result.corner_data["c"][inner], np.where(up, 3.0, -1.0)[inner, None].repeat(3, 1))
        points = np.unique(target.faces[inner])
        np.testing.assert_allclose(result.point_data["z"][points], np.sign(target.point_normals[points, 2]))


def test_a_soup_is_joined_where_its_points_coincide():
    welded, target = sphere(3), turned(sphere(3))
    soup = Surface(welded.points[welded.faces].reshape(-1, 3), np.arange(3 * welded.n_faces).reshape(-1, 3))
    corners = welded.points[welded.faces]
    first = transfer_attributes(Mesh(surface=welded, corner_data={"v": corners}), target)
    second = transfer_attributes(
        Mesh(surface=soup, corner_data={"v": corners}, point_data={"x": soup.points[:, 0]}), target
    )
    np.testing.assert_allclose(second.corner_data["v"], first.corner_data["v"], atol=1e-6)
    np.testing.assert_allclose(second.point_data["x"], target.points[:, 0], atol=0.01)


def test_charts_of_single_faces_stay_within_them():
    """As flat shading: the normals of the corners are the ones of the face."""
    source, target = sphere(3), turned(sphere(3))
    flat = source.face_normals[:, None, :].repeat(3, axis=1)
    result = transfer_attributes(Mesh(surface=source, corner_data={"normals": flat}), target).corner_data["normals"]
    np.testing.assert_allclose(result, result[:, :1].repeat(3, axis=1), atol=1e-15)
    assert (np.einsum("fx,fx->f", result[:, 0], target.face_normals) > 0.98).all()


def test_sources_and_targets_can_be_files_and_objects_of_libraries(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    source, target = Mesh(surface=sphere(2), point_data={"height": sphere(2).points[:, 2]}), turned(sphere(2))
    save(source, tmp_path / "source.ply")
    expected = transfer_attributes(source, target)
    for given in (tmp_path / "source.ply", to_meshio(source), to_pyvista(source)):
        result = transfer_attributes(given, trimesh.Trimesh(target.points, target.faces, process=False))
        np.testing.assert_array_equal(result.surface.faces, target.faces)
        np.testing.assert_allclose(result.point_data["height"], expected.point_data["height"], atol=1e-12)


def test_other_types_are_an_error():
    with pytest.raises(MeshError, match="cannot read a mesh from ndarray"):
        transfer_attributes(Mesh(surface=sphere(1)), sphere(1).points)
    with pytest.raises(MeshFileError, match="no such file; expected a mesh file"):
        transfer_attributes("nofile.ply", sphere(1))


def test_a_mesh_is_a_target_by_its_surface():
    source, target = Mesh(surface=sphere(2), point_data={"z": sphere(2).points[:, 2]}), turned(sphere(2))
    result = transfer_attributes(source, Mesh(surface=target, point_data={"z": np.zeros(target.n_points)}))
    expected = transfer_attributes(source, target)
    np.testing.assert_array_equal(result.point_data["z"], expected.point_data["z"])
    assert result.surface is target


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("seed", range(20))
def test_values_of_any_soup_come_from_the_source(seed):
    """Degenerate, non-manifold, repeated and unused: values are finite and within the range of the given ones."""
    rng = np.random.default_rng(seed)
    n, m = rng.integers(3, 40, 2)
    faces, others = (rng.integers(0, size, (rng.integers(1, 60), 3)) for size in (n, m))
    source = Surface(rng.random((n, 3)) * [1.0, 1.0, rng.choice([0.0, 1e-9, 1.0])], faces)
    mesh = Mesh(
        surface=source,
        point_data={"a": rng.random(n), "k": rng.integers(0, 9, n)},
        face_data={"b": rng.random((len(faces), 2, 2))},
        corner_data={"uv": rng.random((len(faces), 3, 2))},
        regions={"r": Regions(rng.integers(0, 3, len(faces))), "q": Regions(rng.integers(-1, 1, len(faces)))},
    )
    result = transfer_attributes(mesh, Surface(rng.random((m, 3)), others))
    for values in (result.point_data["a"], result.face_data["b"], result.corner_data["uv"]):
        assert values.min() >= 0.0
        assert values.max() <= 1.0 + 1e-12
    assert set(result.point_data["k"]) <= set(mesh.point_data["k"])
    pairs = [set(zip(*(each.regions[name].labels.tolist() for name in "rq"), strict=True)) for each in (result, mesh)]
    assert pairs[0] <= pairs[1]
