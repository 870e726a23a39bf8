"""Edges tagged by the user: mapped through repair; invalid edges are refused."""

import numpy as np
import pytest

from anisomesh.errors import MeshFileError, OptionError
from anisomesh.features.tagged import distance_to_crease_edges, tagged_edges
from anisomesh.io.text_tables import load_pairs, load_points
from anisomesh.mesh.surface import Surface
from anisomesh.repair.prepare import prepare
from anisomesh.shapes.analytic import open_patch


def grid(n=4):
    return open_patch(lambda x, y: 0.0 * x, n=n)


def row(surface, y=0.0):
    """Return the edges of a grid along a line of constant y, as pairs of points."""
    on = np.flatnonzero(np.abs(surface.points[:, 1] - y) < 1e-9)
    on = on[np.argsort(surface.points[on, 0])]
    return np.stack([on[:-1], on[1:]], axis=1)


def ends_of(surface, mask):
    """Return the places of both ends of the marked edges, each row sorted."""
    ends = surface.points[surface.edges[mask]].round(9)
    return sorted(sorted(map(tuple, pair)) for pair in ends.tolist())


def test_edges_are_found_in_either_order_of_their_ends():
    surface = grid()
    pairs = row(surface)
    for named in (pairs, pairs[:, ::-1], pairs[::-1]):
        found = tagged_edges(surface, named, surface, 0.0)
        assert sorted(map(tuple, np.sort(pairs, axis=1))) == sorted(map(tuple, surface.edges[found]))


def test_edges_are_found_again_in_a_soup_that_was_welded_and_renumbered():
    surface = grid()
    soup = Surface(surface.points[surface.faces[::-1].ravel()], np.arange(3 * surface.n_faces).reshape(-1, 3))
    wanted = tagged_edges(surface, row(surface), surface, 0.0)
    corners = soup.points[soup.edges]
    along = np.flatnonzero((np.abs(corners[:, :, 1]) < 1e-9).all(axis=1))
    prepared = prepare(soup).surface
    assert prepared.n_points == surface.n_points
    found = tagged_edges(soup, soup.edges[along], prepared, 0.0)
    assert ends_of(prepared, found) == ends_of(surface, wanted)


@pytest.mark.parametrize(
    ("pairs", "words"),
    [
        ([[0, 1, 2]], r"expected \(n, 2\)"),
        ([0, 1], r"expected \(n, 2\)"),
        ([["a", "b"]], "expected whole numbers"),
        ([[0, 25]], "0 to 24"),
        ([[-1, 0]], "0 to 24"),
        ([[0.5, 1.0]], "whole numbers"),
        ([[0, 1], [0, 24]], "1 of the 2 pairs"),
        ([[3, 3]], "not edges"),
    ],
)
def test_pairs_that_name_no_edge_are_refused(pairs, words):
    surface = grid()
    with pytest.raises(OptionError, match=words):
        tagged_edges(surface, pairs, surface, 0.0)


def test_no_pairs_mark_nothing():
    surface = grid()
    assert not tagged_edges(surface, np.zeros((0, 2)), surface, 0.0).any()


def test_a_file_of_pairs_may_have_remarks_and_empty_lines(tmp_path):
    path = tmp_path / "edges.txt"
    path.write_text("# edges\n0 1\n\n  2\t3  # a remark\n")
    assert load_pairs(path).tolist() == [[0, 1], [2, 3]]
    path.write_text("")
    assert load_pairs(path).shape == (0, 2)


@pytest.mark.parametrize("text", ["0 1 2\n", "0\n", "a b\n", "0 1.5\n", "-1 2\n", "0 " + "9" * 30, "\xff\xfe"])
def test_other_files_are_refused_with_the_line(tmp_path, text):
    path = tmp_path / "edges.txt"
    path.write_bytes(b"0 1\n" + text.encode("latin-1"))
    with pytest.raises(MeshFileError, match=r"edges.txt(, line 2|: cannot)"):
        load_pairs(path)
    with pytest.raises(MeshFileError, match="no such file"):
        load_pairs(tmp_path / "none.txt")


def test_the_boundary_of_a_mesh_follows_tagged_edges_on_the_boundary():
    surface, coarse = grid(8), grid(4)
    none = np.zeros((0, 2), dtype=np.int64)
    on_boundary = surface.edge_face_count == 1
    assert distance_to_crease_edges(surface, on_boundary, coarse, none) < 1e-12
    shifted = coarse.with_points(coarse.points + np.array([0.0, 0.0, 0.25]))
    assert distance_to_crease_edges(surface, on_boundary, shifted, none) == pytest.approx(0.25)
    assert distance_to_crease_edges(surface, np.ones_like(on_boundary), shifted, none) == np.inf


def test_distance_to_crease_edges_is_the_largest_one():
    surface, coarse = grid(8), grid(4)
    tagged = tagged_edges(surface, np.concatenate([row(surface), row(surface, 0.5)]), surface, 0.0)
    none = np.zeros((0, 2), dtype=np.int64)
    both = np.concatenate([row(coarse), row(coarse, 0.5)]).astype(np.int64)
    assert distance_to_crease_edges(surface, tagged, coarse, both) < 1e-12
    lifted = coarse.with_points(coarse.points + np.array([0.0, 0.0, 1e-3]))  # no edge lies on a line
    assert distance_to_crease_edges(surface, tagged, lifted, both) == pytest.approx(1e-3)
    assert distance_to_crease_edges(surface, tagged, lifted, both[:4]) == pytest.approx(0.5, abs=1e-5)
    assert distance_to_crease_edges(surface, tagged, lifted, both[1:]) == pytest.approx(0.5, abs=1e-5)
    assert distance_to_crease_edges(surface, tagged, lifted, none) == np.inf
    assert distance_to_crease_edges(surface, np.zeros_like(tagged), coarse, none) == 0.0


def test_edges_on_tagged_lines_count_even_if_none_is_known_to_be_on_a_crease():
    """A mesh that is the input, or one of a flat grid, was said to follow none of them."""
    surface = open_patch(lambda x, y: 0.0 * x, n=6)
    inside = surface.edge_face_count == 2
    level = surface.points[surface.edges][:, :, 1]
    tagged = inside & (np.ptp(level, axis=1) < 1e-12) & (np.abs(level[:, 0] - np.median(surface.points[:, 1])) < 1e-12)
    assert tagged.any()
    none = np.zeros((0, 2), dtype=np.int64)
    assert distance_to_crease_edges(surface, tagged, surface, none) < 1e-12
    across = surface.with_points(surface.points[:, [1, 0, 2]])  # the same square, with the other diagonals
    assert distance_to_crease_edges(surface, tagged, across, none) < 1e-12
    coarse = Surface(np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    assert np.isinf(distance_to_crease_edges(surface, tagged, coarse, none))


def test_a_file_of_points_may_begin_with_a_byte_order_mark(tmp_path):
    file = tmp_path / "points.txt"
    file.write_bytes(b"\xef\xbb\xbf0\r\n7\r\n")
    assert load_points(file).tolist() == [0, 7]
