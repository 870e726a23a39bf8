"""Cells as polygons: files can be read back and cover the surface."""

import meshio
import naive_rvd as naive
import numpy as np
import pytest
from delaunay_cases import dual_case

from anisomesh.errors import MeshFileError
from anisomesh.io.rvd import N_COLOURS, save_polygons
from anisomesh.shapes import analytic as shapes
from anisomesh.voronoi.polygons import cell_polygons


@pytest.fixture(scope="module")
def exported():
    """The cells of a diagram of a box embedded in 6-D, and their polygons in space."""
    surface = shapes.box((1.0, 0.7, 0.4), n=4)
    rng = np.random.default_rng(0)
    points = naive.embed(surface.points, 6, rng)
    cells, _ = dual_case(surface, naive.random_sites(points, surface.faces, 30, rng), points)
    return surface, cells, cell_polygons(cells, surface.points)


def area_of(loop):
    fan = np.cross(loop[1:-1] - loop[0], loop[2:] - loop[0])
    return 0.5 * np.linalg.norm(fan, axis=1).sum()


def read_obj(path):
    """Return points, loops of point numbers, and the group and material of each loop."""
    points, loops, groups, materials = [], [], [], []
    group = material = None
    for line in path.read_text().splitlines():
        word, *rest = line.split()
        if word == "v":
            points.append([float(x) for x in rest])
        elif word == "g":
            group = rest[0]
        elif word == "usemtl":
            material = rest[0]
        elif word == "f":
            loops.append([int(x) - 1 for x in rest])
            groups.append(group)
            materials.append(material)
    return np.array(points), loops, groups, materials


def test_polygons_lie_in_space_and_cover_the_surface(exported):
    surface, cells, mesh = exported
    loops = [mesh.points[a:b] for a, b in zip(mesh.offset[:-1], mesh.offset[1:], strict=True)]
    assert sum(map(area_of, loops)) == pytest.approx(surface.area, rel=1e-12)
    np.testing.assert_array_equal(np.unique(mesh.cell), np.arange(cells.n_components))
    assert mesh.colour.min() >= 0
    assert mesh.colour.max() < N_COLOURS
    for cell in range(cells.n_components):
        assert len(set(mesh.colour[mesh.cell == cell].tolist())) == 1


def test_vtu_reads_back(exported, tmp_path):
    surface, _, mesh = exported
    save_polygons(mesh, tmp_path / "cells.vtu")
    read = meshio.read(tmp_path / "cells.vtu")
    np.testing.assert_allclose(read.points, mesh.points, rtol=0, atol=1e-14)
    total, by_cell = 0.0, {}
    for block, cell, colour in zip(read.cells, read.cell_data["cell"], read.cell_data["colour"], strict=True):
        for loop, c, k in zip(block.data, cell, colour, strict=True):
            area = area_of(read.points[loop])
            total += area
            by_cell[int(c)] = by_cell.get(int(c), 0.0) + area
            assert k == mesh.colour[mesh.cell == c][0]
    assert total == pytest.approx(surface.area, rel=1e-10)
    assert sorted(by_cell) == np.unique(mesh.cell).tolist()


def test_obj_reads_back(exported, tmp_path):
    surface, _, mesh = exported
    save_polygons(mesh, str(tmp_path / "cells.OBJ"))
    points, loops, groups, materials = read_obj(tmp_path / "cells.OBJ")
    np.testing.assert_array_equal(points, mesh.points)
    assert sum(area_of(points[loop]) for loop in loops) == pytest.approx(surface.area, rel=1e-12)
    first = {int(a): p for p, a in enumerate(mesh.offset[:-1])}
    assert sorted(first[loop[0]] for loop in loops) == list(range(len(mesh.cell)))
    for loop, group, material in zip(loops, groups, materials, strict=True):
        p = first[loop[0]]
        assert loop == list(range(mesh.offset[p], mesh.offset[p + 1]))
        assert group == f"cell{mesh.cell[p]}"
        assert material == f"colour{mesh.colour[p]}"


@pytest.mark.parametrize("name", ["cells.stl", "cells"])
def test_other_suffixes_are_refused_and_nothing_is_written(exported, tmp_path, name):
    with pytest.raises(MeshFileError, match=r"\.vtu or \.obj"):
        save_polygons(exported[2], tmp_path / name)
    assert list(tmp_path.iterdir()) == []
