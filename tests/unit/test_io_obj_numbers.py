"""The quick way of reading the numbers of OBJ files gives the same as the slow one, which comments lead to."""

import io

import numpy as np
import pytest

from anisomesh.errors import MeshFileError
from anisomesh.io.formats.words import quick_table
from anisomesh.io.meshes import load_mesh

RNG = np.random.default_rng(0)
POINTS = RNG.normal(size=(9, 3)) * 10.0 ** RNG.integers(-9, 9, (9, 3))
CORNERS = ["{0}", "{0}/{0}", "{0}//{0}", "{0}/{0}/{0}", "-{0}/-{0}", "+{0}"]


def obj(corner, *, comment="", tail=""):
    faces = [RNG.permutation(9)[:size] + 1 for size in (3, 4, 5, 3)] if not tail else [np.array([1, 2, 3])]
    lines = ["v {!r} {!r}\t{!r}".format(*row) + comment for row in POINTS.tolist()]
    lines += ["vt {!r} {!r}".format(*row) + comment for row in POINTS[:, :2].tolist()]
    lines += ["\tvn {!r} {!r} {!r}".format(*row) + comment for row in POINTS.tolist()]
    lines += [" f\t" + "  ".join(corner.format(k) for k in face.tolist()) + comment for face in faces]
    return "\n".join([*lines, tail]).encode()


def read(text):
    return load_mesh(io.BytesIO(text), file_format="obj")


@pytest.mark.parametrize("corner", CORNERS)
def test_both_ways_give_the_same(corner, monkeypatch):
    text = obj(corner)
    monkeypatch.setattr("anisomesh.io.formats.words.LINES_AT_ONCE", 2)
    monkeypatch.setattr("anisomesh.io.formats.obj.attributes.LINES_AT_ONCE", 3)
    quick, slow = read(text), read(text.replace(b"\n", b" # v f 1/2\n"))
    np.testing.assert_array_equal(quick.surface.points, POINTS)
    np.testing.assert_array_equal(quick.surface.faces, slow.surface.faces)
    assert set(quick.corner_data) == set(slow.corner_data)
    for name, values in quick.corner_data.items():
        np.testing.assert_array_equal(values, slow.corner_data[name])
    assert len(quick.corner_data) == corner.count("{0}") - 1


@pytest.mark.parametrize("tail", ["f 1/1 2 3", "f 1/1/ 2/2/ 3/3/", "f 1 2 3 # 4", "f 1//1 2/2 3/3"])
def test_corners_that_are_written_in_another_way(tail):
    assert len(read(obj("{0}", tail=tail)).surface.faces) == 2


@pytest.mark.parametrize(
    "tail", ["f 1 2 1.5", "f 1 2f 3", "f 1 2 a", "f 1 2 3-4", "v 1 2 3v\nf 1 2 3", "v 1 2 3-4x\nf 1 2 3", "v 1 2\n"]
)
def test_malformed_numbers_are_refused_with_their_line(tail):
    with pytest.raises(MeshFileError, match="line 29 should give"):
        read(obj("{0}", tail=tail))


@pytest.mark.parametrize("line", [b"1 2 3", b"1 2", b"1 2 3 4", b"1 x 3", b"1-2 3 ", b"", b"nan inf 1e9"])
def test_tables_have_a_row_for_each_line(line):
    table = quick_table([b"1 2 3", line, b"4 5 6"], np.arange(3))
    if line in (b"1 2 3", b"nan inf 1e9"):
        np.testing.assert_array_equal(table[1], np.array(line.split(), dtype=float))
    else:
        assert table is None
