"""Levels of detail: each is as a remesh with as many vertices, and their files are written together."""

import functools
import json
import struct
from itertools import pairwise
from pathlib import Path

import junction_shapes
import numpy as np
import pytest

import anisomesh
from anisomesh import Levels, Mesh, Regions, Surface
from anisomesh.errors import MeshFileError, OptionError, TimeLimitError
from anisomesh.io.atomic import atomic_paths
from anisomesh.levels.files import level_paths, save_meshes
from anisomesh.mesh.distance import surface_distance
from anisomesh.metric.sources import Curvature
from anisomesh.shapes.analytic import box, cad_part, cylinder, torus

COUNTS = (600, 250, 80)
RING, PART = torus(n_major=48, n_minor=24), cad_part(8)
QUICK = {"max_iterations": 20, "embedding": "direct"}


@functools.cache
def ring_levels():
    return anisomesh.remesh_levels(RING, n_vertices=[250, 600, 80], **QUICK)


def assert_sound(result, n):
    faults = result.validity
    assert result.surface.n_points == n
    assert faults.faults == faults.nonmanifold_edges == faults.nonmanifold_vertices == 0
    assert faults.euler == faults.euler_input


def test_levels_go_from_fine_to_coarse_and_are_sound():
    levels = ring_levels()
    assert len(levels) == 3
    for level, n in zip(levels, COUNTS, strict=True):
        assert_sound(level, n)
        assert level.vertices_asked == n
        assert set(level.seconds) >= {"embed", "cvt", "dual", "fit", "total"}
    errors = [surface_distance(RING, level.surface, 20_000) for level in levels]
    assert all(fine.rms < coarse.rms and fine.hausdorff < coarse.hausdorff for fine, coarse in pairwise(errors))
    assert "prepare" not in levels[1].seconds


def test_the_finest_level_is_a_remesh():
    alone = anisomesh.remesh(RING, n_vertices=600, **QUICK)
    assert np.array_equal(alone.surface.points, ring_levels()[0].surface.points)
    assert np.array_equal(alone.surface.faces, ring_levels()[0].surface.faces)


def test_levels_do_not_depend_on_the_number_of_threads():
    single = anisomesh.remesh_levels(RING, n_vertices=COUNTS, threads=1, **QUICK)
    for one, two in zip(single, ring_levels(), strict=True):
        assert np.array_equal(one.surface.points, two.surface.points)
        assert np.array_equal(one.surface.faces, two.surface.faces)


@pytest.mark.slow
@pytest.mark.parametrize(("surface", "factor", "seeds"), [(RING, 1.15, [0]), (PART, 1.5, [0, 1])], ids=["ring", "part"])
def test_levels_are_about_as_good_as_remeshes_of_their_counts(surface, factor, seeds):
    """On a part the distance depends on which corners have a vertex, and varies as much between seeds."""
    shares = []
    for seed in seeds:
        options = {"embedding": "direct", "seed": seed}
        level = anisomesh.remesh_levels(surface, n_vertices=[500, 250], **options)[1]
        alone = anisomesh.remesh(surface, n_vertices=level.vertices_asked, **options)
        found, expected = (anisomesh.evaluate(surface, x.surface, samples=20_000) for x in (level, alone))
        assert_sound(level, alone.surface.n_points)
        assert found.shape.g_mean > 0.95 * expected.shape.g_mean
        shares.append(found.distance.rms / expected.distance.rms)
    assert np.mean(shares) < factor


def test_the_metric_is_computed_once():
    class Counted:
        calls = 0

        def __call__(self, surface):
            self.calls += 1
            return Curvature()(surface)

    alone, several = Counted(), Counted()
    anisomesh.remesh(RING, n_vertices=200, metric=alone, max_iterations=1)
    anisomesh.remesh_levels(RING, n_vertices=[200, 100, 50], metric=several, max_iterations=1)
    assert several.calls == alone.calls


def test_ratios_are_shares_of_the_input():
    levels = anisomesh.remesh_levels(RING, ratios=[0.1, 0.2], **QUICK)
    assert [level.surface.n_points for level in levels] == [round(0.2 * RING.n_points), round(0.1 * RING.n_points)]
    assert levels.report()["levels"][1]["vertices"] == levels[1].surface.n_points
    assert [level.surface.n_points for level in levels[:1]] == [230]
    assert "230, 115 vertices" in repr(levels)


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({}, "either as n_vertices or as ratios"),
        ({"ratios": [0.5], "n_vertices": [100]}, "either as n_vertices or as ratios"),
        ({"ratios": []}, "ratios is empty"),
        ({"ratios": 0.5}, "expected a list"),
        ({"ratios": [0.5, -1.0]}, r"ratios\[1\] = -1"),
        ({"n_vertices": [100, 3]}, r"n_vertices\[1\]"),
        ({"n_vertices": [100, 50, 100]}, "two levels have 100 vertices"),
        ({"ratios": [0.002, 0.003]}, "two levels have 4 vertices"),
        ({"n_vertices": [100, 50], "edge_length": 0.2}, "edge_length says how many"),
        ({"ratios": [0.3], "max_error": 0.1}, "max_error says how many"),
        ({"n_vertices": [100, 50], "ratio": 0.1}, "ratio says how many"),
        ({"n_vertices": [100, 20], "keep_points": np.arange(30)}, "20 vertices are asked for"),
    ],
)
def test_what_is_not_possible_is_said_before_any_work(how, message):
    stages = []
    with pytest.raises(OptionError, match=message):
        anisomesh.remesh_levels(RING, on_step=lambda step: stages.append(step.stage), **how)
    assert set(stages) <= {"prepare"}


def test_every_level_keeps_points_and_locked_regions_and_carries_data():
    plate = box((2.0, 1.0, 0.4), n=8)
    middle = plate.points[plate.faces].mean(axis=1)
    labels = np.where(middle[:, 0] > 0.9, 2, 1)
    mesh = Mesh(
        surface=plate,
        point_data={"height": plate.points[:, 2].copy()},
        regions={"group": Regions(labels, {1: "body", 2: "end"})},
    )
    kept = np.flatnonzero((plate.points[:, 0] < 0.0) & (np.abs(plate.points[:, 1]) < 1e-9))[:4]
    stays = np.unique(plate.faces[labels == 2])
    counts = [len(stays) + more for more in (150, 60)]
    levels = anisomesh.remesh_levels(mesh, n_vertices=counts, lock="end", keep_points=kept, **QUICK)
    for level, n in zip(levels, counts, strict=True):
        assert level.surface.n_points == n
        found = {tuple(point) for point in level.surface.points.tolist()}
        assert {tuple(point) for point in plate.points[np.union1d(stays, kept)].tolist()} <= found
        assert np.count_nonzero(level.mesh.regions["group"].labels == 2) == np.count_nonzero(labels == 2)
        assert np.abs(level.mesh.point_data["height"] - level.surface.points[:, 2]).max() < 1e-6


def test_sheets_are_joined_at_every_level():
    book = Surface(*junction_shapes.book(3))
    for level, n in zip(anisomesh.remesh_levels(book, n_vertices=[200, 90], **QUICK), (200, 90), strict=True):
        assert level.validity.nonmanifold_edges > 0
        assert level.validity.faults == 0
        assert abs(level.surface.n_points - n) <= 0.05 * n


def test_a_level_that_follows_other_lines_than_the_finest_is_measured_by_itself():
    middle = RING.points[RING.faces].mean(axis=1)
    around = np.arctan2(middle[:, 1], middle[:, 0])
    mesh = Mesh(surface=RING, regions={"sectors": Regions(np.floor((around + np.pi) / np.pi * 6.0).astype(int))})
    how = {"max_iterations": 2, "lloyd_iterations": 2, "embedding": "direct", "fit": False}
    fine, coarse = anisomesh.remesh_levels(mesh, n_vertices=[1000, 60], **how)
    assert not any("do not follow" in text for text in fine.warnings)
    assert any("do not follow all borders" in text for text in coarse.warnings)
    assert "prepare" in coarse.seconds


def test_every_level_has_its_share_of_the_time():
    levels = anisomesh.remesh_levels(RING, n_vertices=[300, 100], time_limit=500.0, **QUICK)
    assert not any("time limit" in text for level in levels for text in level.warnings)


def test_a_time_limit_that_is_too_short_is_named_as_it_was_given():
    with pytest.raises(TimeLimitError, match=r"level 0 has its share of the time limit of 0.001 s"):
        anisomesh.remesh_levels(RING, n_vertices=[300, 100], time_limit=1e-3)


def glb_document(path):
    content = Path(path).read_bytes()
    (size,) = struct.unpack("<I", content[12:16])
    return json.loads(content[20 : 20 + size])


def cubes(*subdivisions):
    return [Mesh(surface=box((1.0, 1.0, 1.0), n=n)) for n in subdivisions]


def test_glb_has_the_coarser_levels_in_an_extension(tmp_path, caplog):
    path = tmp_path / "out.glb"
    assert save_meshes(cubes(8, 4, 2), path) == [path]
    document = glb_document(path)
    (root,) = document["scenes"][0]["nodes"]
    finest = document["nodes"][root]
    coarser = finest["extensions"]["MSFT_lod"]["ids"]
    assert document["extensionsUsed"] == ["MSFT_lod"]
    assert "extensionsRequired" not in document
    counts = [
        document["accessors"][document["meshes"][document["nodes"][k]["mesh"]]["primitives"][0]["indices"]]["count"]
        for k in (root, *coarser)
    ]
    assert counts == [3 * mesh.surface.n_faces for mesh in cubes(8, 4, 2)]
    coverage = finest["extras"]["MSFT_screencoverage"]
    assert len(coverage) == 3
    assert coverage[-1] == 0.0 < coverage[1] < coverage[0] < 1.0
    assert anisomesh.load(path).n_faces == cubes(8)[0].surface.n_faces
    assert caplog.text.count("coarser ones left out (MSFT_lod): 2") == 1


def test_levels_with_regions_and_materials_are_groups_of_nodes_in_glb(tmp_path):
    meshes = []
    for mesh in cubes(4, 2):
        side = np.abs(mesh.surface.face_normals).argmax(axis=1)
        regions = {
            "node": Regions(side, {0: "x", 1: "y", 2: "z"}),
            "material": Regions(side % 2, {0: "red", 1: "blue"}),
        }
        meshes.append(Mesh(surface=mesh.surface, regions=regions))
    path = tmp_path / "out.glb"
    save_meshes(meshes, path)
    document = glb_document(path)
    assert [each["name"] for each in document["materials"]] == ["red", "blue"]
    (root,) = document["scenes"][0]["nodes"]
    (other,) = document["nodes"][root]["extensions"]["MSFT_lod"]["ids"]
    for node in (root, other):
        names = [document["nodes"][child]["name"] for child in document["nodes"][node]["children"]]
        assert names == ["x", "y", "z"]
    found = anisomesh.load_mesh(path)
    assert found.surface.n_faces == meshes[0].surface.n_faces
    assert sorted(found.regions["node"].names.values()) == ["x", "y", "z"]


def test_one_level_in_glb_is_a_plain_file(tmp_path):
    save_meshes(cubes(3), tmp_path / "levels.glb")
    anisomesh.save(cubes(3)[0], tmp_path / "plain.glb")
    assert (tmp_path / "levels.glb").read_bytes() == (tmp_path / "plain.glb").read_bytes()


def test_levels_in_other_formats_are_files_beside_each_other(tmp_path):
    paths = ring_levels().save(tmp_path / "ring.v2.ply")
    assert [path.name for path in paths] == [f"ring.v2.lod{k}.ply" for k in range(3)]
    assert [anisomesh.load(path).n_points for path in paths] == list(COUNTS)
    assert sorted(tmp_path.iterdir()) == paths
    assert level_paths("a.b", 2, "obj") == [Path("a.lod0.b"), Path("a.lod1.b")]


@pytest.mark.parametrize("fault", [OSError("disk full"), KeyboardInterrupt()], ids=["error", "interrupt"])
@pytest.mark.parametrize("at", [1, 2, 3])
def test_all_files_are_replaced_or_none(tmp_path, monkeypatch, fault, at):
    paths = [tmp_path / name for name in ("a.txt", "b.txt", "c.txt")]
    paths[0].write_text("old a")
    paths[2].write_text("old c")
    replace, calls = Path.replace, []

    def failing(new, target):
        calls.append(target)
        if len(calls) == at:
            raise fault
        return replace(new, target)

    monkeypatch.setattr(Path, "replace", failing)
    with pytest.raises((MeshFileError, KeyboardInterrupt)), atomic_paths(paths) as temporaries:
        for temporary in temporaries:
            temporary.write_text("new")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.txt": "old a", "c.txt": "old c"}


def test_files_are_replaced_together(tmp_path):
    paths = [tmp_path / "a.txt", tmp_path / "b.txt"]
    paths[0].write_text("old")
    with atomic_paths(paths) as temporaries:
        for temporary in temporaries:
            temporary.write_text("new")
        assert paths[0].read_text() == "old"
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.txt": "new", "b.txt": "new"}


def test_the_command_writes_levels_a_table_and_a_report(run_cli, torus_obj, tmp_path):
    out, report = tmp_path / "out.ply", tmp_path / "report.json"
    words = ["remesh", torus_obj, "--ratios", "0.2", "10%", "-o", out, "--report", report, "--embedding", "direct"]
    (tmp_path / "out.lod2.ply").write_text("old")
    done = run_cli(*words, "--max-iterations", 5)
    assert done.returncode == 0, done.stderr
    assert "out.lod2.ply and coarser levels are of an earlier run" in " ".join(done.stderr.split())
    (tmp_path / "out.lod2.ply").unlink()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out.lod0.ply", "out.lod1.ply", "report.json"]
    facts = json.loads(report.read_text())
    assert [level["vertices"] for level in facts["levels"]] == [230, 115]
    assert facts["levels"][0]["rms"] < facts["levels"][1]["rms"]
    assert all(0.5 < level["quality"] <= 1.0 for level in facts["levels"])
    header, first, second = (line.split() for line in done.stdout.splitlines()[:3])
    assert header == ["level", "vertices", "faces", "G", "RMS", "HD", "seconds"]
    assert (first[:2], second[:2]) == (["0", "230"], ["1", "115"])


def test_levels_in_one_file_may_replace_the_input(run_cli, tmp_path):
    file = tmp_path / "ring.glb"
    anisomesh.save(RING, file)
    words = ["-n", 100, "-n", 50, "-o", file, "--embedding", "direct", "--max-iterations", 2, "--quiet"]
    assert run_cli("remesh", file, *words).returncode == 0
    assert anisomesh.load(file).n_points == 100


def test_the_command_makes_names_and_replaces_only_what_is_named(run_cli, torus_obj, tmp_path):
    source = tmp_path / "ring.obj"
    source.write_bytes(torus_obj.read_bytes())
    (tmp_path / "ring_remeshed.lod1.obj").write_text("mine")
    done = run_cli("remesh", source, "-n", 100, "-n", 50, "--quiet")
    assert done.returncode == 2
    assert "ring_remeshed.lod1.obj exists" in done.stderr
    assert (tmp_path / "ring_remeshed.lod1.obj").read_text() == "mine"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["-n", 100, "--ratios", "0.5"], "give one of"),
        (["--ratios", "0.5", "0.2", "--max-error", "0.1"], "give one of"),
        (["--ratios", "0.5", "0.2", "--rvd", "cells.vtu"], "--rvd writes what belongs to one mesh"),
        (["--ratios", "0.5", "0.2", "--save-metric", "m.sol"], "--save-metric writes what belongs to one mesh"),
        (["--ratios", "0.5", "0", "-o", "out.ply"], "not a positive finite number"),
        (["--ratios", "0.5", "0.2", "-o", "-", "--output-format", "ply"], "do not go to standard output"),
    ],
)
def test_the_command_says_what_does_not_go_with_levels(run_cli, torus_obj, tmp_path, words, message):
    words = [*words] if "-o" in words else [*words, "-o", tmp_path / "out.ply"]
    done = run_cli("remesh", torus_obj, *words, cwd=tmp_path)
    assert done.returncode == 2
    assert message in " ".join(done.stderr.split())
    assert list(tmp_path.iterdir()) == []


def test_an_interrupt_while_levels_are_written_leaves_no_half_set(run_cli, torus_obj, tmp_path, monkeypatch):
    write, calls = Path.write_bytes, []

    def interrupted(path, content):
        calls.append(path)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", interrupted)
    words = ["-n", 100, "-n", 50, "-o", tmp_path / "out.ply", "--embedding", "direct", "--max-iterations", 2, "--quiet"]
    assert run_cli("remesh", torus_obj, *words).returncode == 130
    assert list(tmp_path.iterdir()) == []


def test_an_open_surface_keeps_its_boundary_at_every_level():
    levels = anisomesh.remesh_levels(cylinder(closed=False), n_vertices=[200, 80], **QUICK)
    assert isinstance(levels, Levels)
    for level in levels:
        assert_sound(level, level.vertices_asked)
        assert level.validity.boundary_loops == 2
