"""``anisomesh info`` on meshes with known properties."""

import json

import numpy as np
import pytest

import anisomesh
from anisomesh.shapes.analytic import box
from conftest import torus_arrays, write_obj

SQUARE = "v 0 0 0\nv 3 0 0\nv 3 4 0\nv 0 4 0\n"


@pytest.fixture
def facts(run_cli):
    def read(path):
        process = run_cli("info", path, "--json")
        assert process.returncode == 0, process.stderr
        assert process.stderr == ""
        return json.loads(process.stdout)

    return read


def test_torus(facts, torus_obj):
    found = facts(torus_obj)
    assert (found["points"], found["faces"], found["edges"]) == (1152, 2304, 3456)
    assert found["genus"] == 1
    assert found["validity"] == {
        "closed": True,
        "boundary_loops": 0,
        "components": 1,
        "euler": 0,
        "nonmanifold_edges": 0,
        "nonmanifold_vertices": 0,
        "oriented": True,
    }
    assert found["prepare"] == {"changes": [], "points": 1152, "faces": 2304}
    assert found["area"] == pytest.approx(4 * np.pi**2 * 0.35, rel=0.02)
    assert np.ptp([found["bounding_box"]["min"], found["bounding_box"]["max"]], axis=0) == pytest.approx(
        [2.7, 2.7, 0.7]
    )


def test_open_rectangle(facts, tmp_path):
    (tmp_path / "square.obj").write_text(SQUARE + "f 1 2 3\nf 1 3 4\n")
    found = facts(tmp_path / "square.obj")
    assert (found["area"], found["bounding_box"]["diagonal"], found["genus"]) == (12.0, 5.0, 0)
    assert found["edge_length"] == {"min": 3.0, "mean": pytest.approx(19 / 5), "max": 5.0}
    assert found["validity"]["boundary_loops"] == 1
    assert not found["validity"]["closed"]


def test_three_faces_at_an_edge_and_an_unused_point(facts, tmp_path):
    (tmp_path / "book.obj").write_text(SQUARE + "v 0 0 5\nv 9 9 9\nf 1 2 3\nf 1 3 4\nf 1 3 5\n")
    found = facts(tmp_path / "book.obj")
    assert found["validity"]["nonmanifold_edges"] == 1
    assert found["genus"] is None
    assert len(found["prepare"]["changes"]) >= 2


def test_an_inverted_face_is_found(facts, tmp_path):
    points, faces = torus_arrays(12, 8)
    faces[5] = faces[5][::-1]
    found = facts(write_obj(tmp_path / "turned.obj", points, faces))
    assert not found["validity"]["oriented"]
    assert any("1 face" in change for change in found["prepare"]["changes"])


def test_text_and_two_components(run_cli, tmp_path):
    points, faces = torus_arrays(12, 8)
    points, faces = np.concatenate([points, points + 5.0]), np.concatenate([faces, faces + len(points)])
    process = run_cli("info", write_obj(tmp_path / "two.obj", points, faces))
    assert process.returncode == 0
    assert "closed, 2 components, Euler 0, manifold" in process.stdout
    assert "nothing to repair" in process.stdout


def test_what_the_file_carries_is_listed(run_cli, facts, tmp_path):
    surface = box((1.0, 2.0, 3.0), n=2)
    side = np.argmax(np.abs(surface.face_normals), axis=1)
    line = surface.edges[(surface.points[surface.edges][..., 1:] == 0.0).all(axis=(1, 2))]
    mesh = anisomesh.Mesh(
        surface=surface,
        point_data={"temperature": np.zeros(surface.n_points), "velocity": np.zeros((surface.n_points, 3))},
        face_data={"count": np.zeros(surface.n_faces, dtype=np.int32)},
        regions={"physical": anisomesh.Regions(side + 1, {2: "inlet"})},
        features=line,
        fixed_points=[0, 3],
        feature_regions={"physical": anisomesh.Regions(np.arange(len(line)), {1: "rim"})},
        fixed_point_regions={"physical": anisomesh.Regions(np.array([0, 8]), {8: "probe"})},
    )
    anisomesh.save(mesh, tmp_path / "in.vtu")
    found = facts(tmp_path / "in.vtu")
    areas = {region["label"]: region["area"] for region in found["regions"]["physical"]}
    assert areas == pytest.approx({1: 12.0, 2: 6.0, 3: 4.0})
    assert [region["name"] for region in found["regions"]["physical"]] == [None, "inlet", None]
    assert found["point_data"]["velocity"] == {"type": "float64", "components": 3}
    assert found["prescribed_edges"] == {"count": len(line), "length": pytest.approx(1.0)}
    assert (found["fixed_points"], found["unit"]) == (2, None)
    assert found["edge_regions"] == {"physical": [{"label": 1, "name": "rim", "edges": 1}]}
    assert found["point_regions"] == {"physical": [{"label": 8, "name": "probe", "points": 1}]}
    text = run_cli("info", tmp_path / "in.vtu").stdout
    for words in (
        "physical: 3 (1, inlet = 2, 3)",
        "temperature (float64), velocity (float64 x 3)",
        "count (int32)",
        f"{len(line)} edges of length 1",
        "2 points",
        "physical: 1 (rim = 1)",
        "physical: 1 (probe = 8)",
    ):
        assert words in text


@pytest.mark.parametrize(("suffix", "unit"), [("3mf", "millimeter"), ("glb", "meter"), ("obj", None)])
def test_the_unit_and_texture_coordinates_of_a_file(run_cli, facts, tmp_path, suffix, unit):
    surface = box(n=2)
    uv = np.random.default_rng(0).uniform(size=(surface.n_points, 2))
    mesh = anisomesh.Mesh(surface=surface, point_data={} if suffix == "3mf" else {"uv": uv})
    anisomesh.save(mesh, tmp_path / f"in.{suffix}")
    assert facts(tmp_path / f"in.{suffix}")["unit"] == unit
    text = run_cli("info", tmp_path / f"in.{suffix}").stdout
    assert ("texture coordinates" in text) == (suffix != "3mf")
    assert any(line.split() == ["unit", unit] for line in text.splitlines()) == (unit is not None)


def test_an_inch_is_an_inch(facts, tmp_path):
    anisomesh.save(anisomesh.Mesh(surface=box(n=1), materials={"unit": "inch"}), tmp_path / "in.3mf")
    assert facts(tmp_path / "in.3mf")["unit"] == "inch"
