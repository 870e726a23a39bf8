"""Plausibility of the counts in a Gmsh file: meshio allocates arrays of the declared sizes before it reads them.

Format: https://gmsh.info/doc/texinfo/gmsh.html#File-formats.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

_MIN_TEXT_NODE_BYTES = 8  # a tag and three coordinates, of one digit each, with separators
_BINARY_NODE_BYTES = 28  # binary version 2: int32 tag and three float64
_MAX_SPARSE_TAG = 1_000_000  # node tags up to this are accepted in files of any size: a table of 8 MB
_NODES_OF_TYPE = dict(enumerate([2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13], start=1))  # Gmsh


def check_counts(data: bytes) -> None:
    """Check that a Gmsh file is large enough for the nodes and elements that it declares.

    Checked are the number of nodes (all versions), the node tags (text of version 2, version 4.1) and the blocks of
    elements (binary of version 2, version 4.1).

    Raises
    ------
    ValueError
        If a section is missing or a count is too large or not a number.
    """
    header = data[: data.find(b"$EndMeshFormat")].split()
    if len(header) < 4 or header[0] != b"$MeshFormat":
        raise ValueError("it does not begin with $MeshFormat as a Gmsh file does")
    version, binary = header[1], header[2] == b"1"
    version_2 = version.startswith(b"2")
    nodes, elements = _section(data, b"Nodes"), _section(data, b"Elements")
    count = _node_count(nodes, version_2, binary)
    if count * (_BINARY_NODE_BYTES if version_2 and binary else _MIN_TEXT_NODE_BYTES) > len(data):
        raise ValueError(f"truncated or malformed: it declares {count} nodes in {len(data)} bytes")
    if version_2 and binary:
        _check_binary_element_blocks(elements)
    elif version_2:
        _check_tags(np.array(nodes.partition(b"\n")[2].split()[::4], dtype=np.float64), len(data))
    elif version.startswith(b"4.1"):
        _check_node_blocks(_NumberStream(nodes, binary), len(data))
        _check_element_blocks(_NumberStream(elements, binary))


def _node_count(nodes: bytes, version_2: bool, binary: bool) -> int:
    if version_2:
        return _integer(nodes.partition(b"\n")[0])
    words = [nodes[8:16]] if binary else nodes.split(None, 2)[1:2]
    if not words or (binary and len(words[0]) < 8):
        raise ValueError("truncated: it does not say how many nodes it has")
    return int.from_bytes(words[0], "little") if binary else _integer(words[0])


def _check_binary_element_blocks(section: bytes) -> None:
    """Walk through the element blocks of a binary file of version 2."""
    line, _, body = section.partition(b"\n")
    left, position = _integer(line), 0
    while left > 0:
        header = np.frombuffer(body[position : position + 12], dtype="<i4")
        if len(header) < 3:
            raise ValueError(f"truncated: {left} elements are missing")
        kind, count, tags = header.tolist()
        position += 12 + 4 * count * (1 + tags + _NODES_OF_TYPE.get(kind, 1))
        if count <= 0 or tags < 0 or position > len(body):
            raise ValueError(f"truncated or malformed: a block declares {count} elements in {len(body)} bytes")
        if kind not in _NODES_OF_TYPE:
            return  # a higher-order type of unknown size: the next block cannot be found
        left -= count


class _NumberStream:
    """The numbers of a section of version 4.1, read one after the other from text or binary."""

    def __init__(self, section: bytes, binary: bool) -> None:
        self._items = section if binary else section.split()
        self._binary = binary
        self._position = 0

    def take(self, count: int, kind: str) -> npt.NDArray[Any]:
        """Return the next numbers (count,), of NumPy type ``kind`` in a binary file; ValueError if there are fewer."""
        start = self._position
        self._position += count * (np.dtype(kind).itemsize if self._binary else 1)
        if count < 0 or self._position > len(self._items):
            raise ValueError(f"truncated or malformed: a block declares {count} numbers")
        items = self._items[start : self._position]
        if isinstance(items, bytes):
            return np.frombuffer(items, dtype=kind)
        return np.array(items, dtype=np.float64)


def _check_node_blocks(numbers: _NumberStream, n_bytes: int) -> None:
    for _ in range(int(numbers.take(4, "<u8")[0])):
        numbers.take(3, "<i4")
        count = int(numbers.take(1, "<u8")[0])
        _check_tags(numbers.take(count, "<u8"), n_bytes)
        numbers.take(3 * count, "<f8")


def _check_element_blocks(numbers: _NumberStream) -> None:
    for _ in range(int(numbers.take(4, "<u8")[0])):
        kind = int(numbers.take(3, "<i4")[2])
        count = int(numbers.take(1, "<u8")[0])
        if kind not in _NODES_OF_TYPE:
            return  # a higher-order type of unknown size: the next block cannot be found
        numbers.take(count * (1 + _NODES_OF_TYPE[kind]), "<u8")


def _check_tags(tags: npt.NDArray[Any], n_bytes: int) -> None:
    limit = max(n_bytes, _MAX_SPARSE_TAG)
    if len(tags) and not tags.max() <= limit:  # meshio allocates a table of this size
        raise ValueError(
            f"malformed: the number of a node is {tags.max():.0f}; expected at most {limit}; renumber nodes"
        )


def _section(data: bytes, name: bytes) -> bytes:
    """Return the content of a section, without its first and last line."""
    first = data.find(b"$" + name)
    begin = data.find(b"\n", first) + 1
    end = data.find(b"$End" + name)
    if first < 0 or begin == 0 or end < begin:
        raise ValueError(f"truncated: it has no ${name.decode()} with an $End{name.decode()}")
    return data[begin:end]


def _integer(text: bytes) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"malformed: {text[:20].decode(errors='replace')!r} is not a count") from None
