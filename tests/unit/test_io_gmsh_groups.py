"""Physical groups of Gmsh files that overlap, elements that a file repeats for each of them, and partitions."""

import logging
import struct

import numpy as np
import pytest

from anisomesh.io.formats.gmsh.groups import Block as ElementBlock
from anisomesh.io.formats.gmsh.groups import each_once, separate
from anisomesh.io.meshes import load_mesh, save

NODES_2 = "$Nodes\n5\n10 0 0 0\n20 1 0 0\n30 1 1 0\n40 0 1 0\n50 2 1 0\n$EndNodes\n"
HEAD_2 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
NAMES = '$PhysicalNames\n4\n1 3 "rim"\n2 5 "left"\n2 6 "right"\n2 9 "all"\n$EndPhysicalNames\n'
TRIANGLES = [(10, 20, 30), (10, 30, 40), (20, 50, 30)]
REPEATED = [(5, 1, 0), (5, 1, 1), (6, 2, 2), (9, 1, 0), (9, 1, 1), (9, 2, 2)]  # group, entity, triangle
ELEMENTS_2 = "".join(
    f"{k} 2 2 {group} {entity} {' '.join(map(str, TRIANGLES[face]))}\n"
    for k, (group, entity, face) in enumerate(REPEATED, 1)
)
ELEMENTS_2 = f"$Elements\n8\n{ELEMENTS_2}7 1 2 3 1 10 20\n8 1 2 4 1 10 20\n$EndElements\n"
NODES_4 = "$Nodes\n1 5 10 50\n2 1 0 5\n10\n20\n30\n40\n50\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 1 0\n$EndNodes\n"
ENTITIES = "$Entities\n0 1 2 0\n7 0 0 0 1 0 0 2 3 4 0\n1 0 0 0 1 1 0 2 5 9 0\n2 1 0 0 2 1 0 2 6 9 0\n$EndEntities\n"
ELEMENTS_4 = (
    "$Elements\n3 4 1 4\n2 1 2 2\n1 10 20 30\n2 10 30 40\n2 2 2 1\n3 20 50 30\n1 7 1 1\n4 10 20\n$EndElements\n"
)
HEAD_4 = HEAD_2.replace("2.2", "4.1")
VERSION_2, VERSION_4 = HEAD_2 + NAMES + NODES_2 + ELEMENTS_2, HEAD_4 + NAMES + ENTITIES + NODES_4 + ELEMENTS_4


def binary_version_2():
    nodes = b"".join(
        struct.pack("<i3d", 10 * (k + 1), *p)
        for k, p in enumerate([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 1, 0)])
    )
    blocks = [  # of one element, as Gmsh may write them
        struct.pack("<3i", 2, 1, 2) + struct.pack("<6i", k, group, entity, *TRIANGLES[face])
        for k, (group, entity, face) in enumerate(REPEATED, 1)
    ]
    blocks += [struct.pack("<3i", 1, 1, 2) + struct.pack("<5i", k, group, 1, 10, 20) for k, group in ((7, 3), (8, 4))]
    head = b"$MeshFormat\n2.2 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n" + NAMES.encode()
    nodes = b"$Nodes\n5\n" + nodes + b"\n$EndNodes\n"
    return head + nodes + b"$Elements\n8\n" + b"".join(blocks) + b"\n$EndElements\n"


def read(tmp_path, content):
    (tmp_path / "a.msh").write_bytes(content if isinstance(content, bytes) else content.encode())
    return load_mesh(tmp_path / "a.msh")


@pytest.mark.parametrize("content", [VERSION_2, binary_version_2(), VERSION_4], ids=["2.2", "2.2 binary", "4.1"])
def test_an_element_in_several_groups_is_one_face_and_no_group_is_lost(tmp_path, caplog, content):
    mesh = read(tmp_path, content)
    assert mesh.surface.n_faces == 3  # version 2 has one copy for each group
    assert mesh.regions["physical"].labels.tolist() == [5, 5, 6]
    assert mesh.regions["physical"].names == {5: "left", 6: "right"}
    assert mesh.regions["physical_2"].labels.tolist() == [9, 9, 9]
    assert mesh.regions["physical_2"].names == {9: "all"}
    assert mesh.feature_regions["physical"].labels.tolist() == [3]
    assert mesh.feature_regions["physical"].names == {3: "rim"}
    assert mesh.feature_regions["physical_2"].labels.tolist() == [4]
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def test_groups_that_overlap_survive_a_round_trip(tmp_path):
    mesh = read(tmp_path, VERSION_2)
    save(mesh, tmp_path / "b.msh")
    again = load_mesh(tmp_path / "b.msh")
    for name in ("physical", "physical_2"):
        assert again.regions[name].labels.tolist() == mesh.regions[name].labels.tolist()
        assert again.regions[name].names == mesh.regions[name].names


def test_a_face_that_is_twice_in_one_group_stays_twice(tmp_path):
    elements = "$Elements\n2\n1 2 2 5 1 10 20 30\n2 2 2 5 1 10 20 30\n$EndElements\n"
    assert read(tmp_path, HEAD_2 + NODES_2 + elements).surface.n_faces == 2


def test_coincident_faces_of_two_entities_stay_two(tmp_path):
    elements = "$Elements\n2\n1 2 2 5 1 10 20 30\n2 2 2 6 2 30 20 10\n$EndElements\n"
    assert read(tmp_path, HEAD_2 + NODES_2 + elements).surface.n_faces == 2


def test_elements_are_joined_as_a_dictionary_joins_them():
    rng = np.random.default_rng(3)
    nodes, entities, group = rng.integers(1, 5, (400, 3)), rng.integers(1, 3, 400), rng.integers(1, 4, 400)
    tags = np.column_stack([np.arange(400), entities])
    (found,), repeats = each_once([ElementBlock(2, nodes, np.arange(400), tags, group[:, None])])
    repeated, expected = set(), {}  # by nodes, entity and how often the group was there before
    for k in range(400):
        key = (*sorted(nodes[k].tolist()), int(entities[k]))
        copies = expected.setdefault(key, [])
        home = next((copy for copy in copies if group[k] not in copy[1]), None)
        if home is None:
            copies.append((k, [group[k]]))
        else:
            home[1].append(group[k])
            repeated.add((k, home[0]))
    rows = {first: set(groups) for copies in expected.values() for first, groups in copies}
    assert dict(zip(found.source.tolist(), ({*row} - {0} for row in found.groups.tolist()), strict=True)) == rows
    assert {tuple(pair) for pair in repeats.tolist()} == repeated
    assert len(repeats) == len(repeated) == 400 - len(rows)


@pytest.mark.parametrize("last", [5, 6, None])
def test_data_of_repeated_elements_that_differ_are_named(tmp_path, caplog, last):
    """Regression: they vanished without a line."""
    elements = "$Elements\n3\n1 2 2 1 1 10 20 30\n2 2 2 2 1 30 10 20\n3 2 2 1 1 10 30 40\n$EndElements\n"
    head = f"{HEAD_2}{NODES_2}{elements}"
    rows, at_nodes = {1: 5, 3: 7} | ({} if last is None else {2: last}), {1: "5 6 7", 3: "1 2 3"}
    if last is not None:
        at_nodes[2] = f"7 {last} {11 - last}"  # of the same nodes in another order
    data = "".join(f"{k} {value}\n" for k, value in rows.items())
    corners = "".join(f"{k} 3 {values}\n" for k, values in at_nodes.items())
    mesh = read(
        tmp_path,
        f'{head}$ElementData\n1\n"q"\n1\n0\n3\n0\n1\n{len(rows)}\n{data}$EndElementData\n'
        f'$ElementNodeData\n1\n"c"\n1\n0\n3\n0\n1\n{len(rows)}\n{corners}$EndElementNodeData\n',
    )
    assert mesh.face_data["q"].tolist() == [5, 7]
    said = [record.getMessage().partition(": ")[2] for record in caplog.records]
    lost = "left out data 'q' of 1 element(s) that repeat others, whose data differ"
    assert said == ([lost] if last == 6 else [])


@pytest.mark.parametrize("values", ["7 5 8", None])
def test_data_at_nodes_of_repeated_elements_that_differ_are_named(tmp_path, caplog, values):
    """Regression: they vanished without a line, also if only the second one has any."""
    elements = "$Elements\n3\n1 2 2 1 1 10 20 30\n2 2 2 2 1 30 10 20\n3 2 2 1 1 10 30 40\n$EndElements\n"
    rows = ["1 3 5 6 7", f"2 3 {values}"] if values else ["2 3 5 6 7", "3 3 1 2 3"]
    table = "\n".join(rows)
    data = f'$ElementNodeData\n1\n"c"\n1\n0\n3\n0\n1\n2\n{table}\n$EndElementNodeData\n'
    read(tmp_path, f"{HEAD_2}{NODES_2}{elements}{data}")
    assert "left out data 'c' of 1 element(s) that repeat others, whose data differ" in caplog.text


def test_each_group_is_in_one_division_as_a_whole():
    rng = np.random.default_rng(5)
    groups = rng.integers(0, 7, (60, 3))
    divisions, left_out = separate(groups)
    homes = [{int(label) for label in labels} - {0} for labels in divisions]
    assert sum(map(len, homes)) == len(set.union(*homes)) == 6
    assert left_out == []
    for labels in divisions:
        for label in {int(label) for label in labels} - {0}:
            np.testing.assert_array_equal(labels == label, (groups == label).any(axis=1))


def test_groups_that_overlap_too_many_others_are_named(tmp_path, caplog):
    tags = " ".join(map(str, range(1, 11)))
    entities = f"$Entities\n0 0 1 0\n1 0 0 0 1 1 0 10 {tags} 0\n$EndEntities\n"
    elements = "$Elements\n1 1 1 1\n2 1 2 1\n1 10 20 30\n$EndElements\n"
    mesh = read(tmp_path, HEAD_4 + entities + NODES_4 + elements)
    assert [regions.labels[0] for name, regions in mesh.regions.items()] == list(range(1, 9))
    assert "left out the physical group(s) 9, 10, which overlap too many others" in caplog.text


def test_parts_of_entities_have_the_groups_of_their_own_or_of_their_entity(tmp_path, caplog):
    parts = (
        "$PartitionedEntities\n2\n1\n99 1\n0 0 2 0\n"
        "10 2 1 1 1 0 0 0 1 1 0 0 0\n11 2 2 2 1 2 1 0 0 2 1 0 1 -7 1 4\n$EndPartitionedEntities\n"
    )
    elements = "$Elements\n2 3 1 3\n2 10 2 2\n1 10 20 30\n2 10 30 40\n2 11 2 1\n3 20 50 30\n$EndElements\n"
    mesh = read(tmp_path, HEAD_4 + ENTITIES + parts + NODES_4 + elements)
    assert mesh.regions["physical"].labels.tolist() == [5, 5, 7]
    assert mesh.regions["physical_2"].labels.tolist() == [9, 9, 0]
    assert "left out which partitions its elements are in" in caplog.text


def test_comments_may_be_in_front_and_have_the_names_of_sections(tmp_path, caplog):
    comments = "$Comments\nmade with $Nodes\n$Elements\n$EndComments\n"
    plain, commented = read(tmp_path, VERSION_2), read(tmp_path, comments + VERSION_2)
    np.testing.assert_array_equal(plain.surface.points, commented.surface.points)
    np.testing.assert_array_equal(plain.surface.faces, commented.surface.faces)
    assert caplog.text == ""


def test_sections_that_are_not_read_and_rows_behind_the_counts_are_named(tmp_path, caplog):
    behind = VERSION_2.replace("$EndElements", "9 2 2 5 1 10 20 50\n$EndElements").replace(
        "$EndNodes", "60 1\n$EndNodes"
    )
    assert read(tmp_path, behind + "$Foo\n1\n$EndFoo\n").surface.n_faces == 3
    said = [record.getMessage().partition(": ")[2] for record in caplog.records]
    assert said == [
        "left out 2 number(s) behind the nodes that it declares",
        "left out 8 number(s) behind the elements that it declares",
        "left out its sections Foo",
    ]


def test_lines_of_missing_nodes_are_named(tmp_path, caplog):
    assert len(read(tmp_path, VERSION_2.replace("8 1 2 4 1 10 20", "8 1 2 4 1 10 99")).features) == 1
    assert "left out 1 line(s) or point(s) of nodes that it does not have" in caplog.text
