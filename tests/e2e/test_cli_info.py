"""``anisomesh info`` on meshes with known properties."""

import json

import numpy as np
import pytest

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
