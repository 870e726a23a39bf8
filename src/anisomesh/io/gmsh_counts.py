"""Whether the counts in a Gmsh file fit its size: the library that reads it makes room for what a file promises."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

_LEAST_NODE = 8  # bytes: a tag and three coordinates as text
_NODE_BYTES = 28  # in the binary of version 2: a tag and three coordinates
_FREE_TAG = 1_000_000  # the number of a node may be so large in any file
_NODES_OF_TYPE = dict(enumerate([2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13], start=1))


def check_counts(data: bytes) -> None:
    """Raise ValueError if the file promises more nodes or elements than it has bytes for.

    Looked at are the numbers of nodes of all versions, the tags of nodes in the text of version 2, the blocks of
    elements in its binary, and all blocks and the tags of nodes of version 4.1.
    """
    kind = data[: data.find(b"$EndMeshFormat")].split()
    if len(kind) < 4 or kind[0] != b"$MeshFormat":
        raise ValueError("it does not begin with $MeshFormat as a Gmsh file does")
    old, binary = kind[1].startswith(b"2"), kind[2] == b"1"
    nodes, elements = _section(data, b"Nodes"), _section(data, b"Elements")
    if old:
        line, _, rest = nodes.partition(b"\n")
        count = _whole(line)
    else:
        rest = nodes
        words = [nodes[8:16]] if binary else nodes.split(None, 2)[1:2]
        if not words or (binary and len(words[0]) < 8):
            raise ValueError("truncated: it does not say how many nodes it has")
        count = int.from_bytes(words[0], "little") if binary else _whole(words[0])
    if count * (_NODE_BYTES if old and binary else _LEAST_NODE) > len(data):
        raise ValueError(f"truncated or malformed: it promises {count} nodes in {len(data)} bytes")
    if old and binary:
        _check_blocks(elements)
    elif old:
        tags = np.array(rest.split()[::4], dtype=np.float64)
        _check_tags(tags, len(data))
    elif kind[1].startswith(b"4.1"):
        _check_node_blocks(_Numbers(nodes, binary), len(data))
        _check_element_blocks(_Numbers(elements, binary))


def _check_blocks(section: bytes) -> None:
    """Go through the blocks of elements of the binary of version 2."""
    line, _, body = section.partition(b"\n")
    left, place = _whole(line), 0
    while left > 0:
        header = np.frombuffer(body[place : place + 12], dtype="<i4")
        if len(header) < 3:
            raise ValueError(f"truncated: {left} elements are missing")
        kind, count, tags = header.tolist()
        size = 4 * count * (1 + tags + _NODES_OF_TYPE.get(kind, 1))
        place += 12 + size
        if count <= 0 or tags < 0 or place > len(body):
            raise ValueError(f"truncated or malformed: a block promises {count} elements in {len(body)} bytes")
        if kind not in _NODES_OF_TYPE:
            return  # of high order: its size, and so where the next block begins, is not known here
        left -= count


class _Numbers:
    """The whole and other numbers of a section of version 4.1, one after the other, from text or binary."""

    def __init__(self, section: bytes, binary: bool) -> None:
        self._items = section if binary else section.split()
        self._binary = binary
        self._place = 0

    def take(self, count: int, kind: str) -> npt.NDArray[Any]:
        """Return the next numbers (count,) of a NumPy type.

        Raises
        ------
        ValueError
            If there are not so many.
        """
        size = count * (np.dtype(kind).itemsize if self._binary else 1)
        begin, self._place = self._place, self._place + size
        if count < 0 or self._place > len(self._items):
            raise ValueError(f"truncated or malformed: a block promises {count} numbers")
        part = self._items[begin : self._place]
        if isinstance(part, bytes):
            return np.frombuffer(part, dtype=kind)
        return np.array(part, dtype=np.float64)


def _check_node_blocks(numbers: _Numbers, n_bytes: int) -> None:
    left = int(numbers.take(4, "<u8")[0])
    while left > 0:
        numbers.take(3, "<i4")
        count = int(numbers.take(1, "<u8")[0])
        _check_tags(numbers.take(count, "<u8"), n_bytes)
        numbers.take(3 * count, "<f8")
        left -= 1


def _check_element_blocks(numbers: _Numbers) -> None:
    left = int(numbers.take(4, "<u8")[0])
    while left > 0:
        kind = int(numbers.take(3, "<i4")[2])
        count = int(numbers.take(1, "<u8")[0])
        if kind not in _NODES_OF_TYPE:
            return  # of high order: its size, and so where the next block begins, is not known here
        numbers.take(count * (1 + _NODES_OF_TYPE[kind]), "<u8")
        left -= 1


def _check_tags(tags: npt.NDArray[Any], n_bytes: int) -> None:
    if len(tags) and not tags.max() <= max(n_bytes, _FREE_TAG):  # the library makes a table of so many rows
        raise ValueError(f"malformed: the number of a node is {tags.max():.0f} in {n_bytes} bytes")


def _section(data: bytes, name: bytes) -> bytes:
    """Return what is between the line that begins a section and the one that ends it."""
    first = data.find(b"$" + name)
    begin = data.find(b"\n", first) + 1
    end = data.find(b"$End" + name)
    if first < 0 or begin == 0 or end < begin:
        raise ValueError(f"truncated: it has no ${name.decode()} with an $End{name.decode()}")
    return data[begin:end]


def _whole(text: bytes) -> int:
    try:
        return int(text)
    except ValueError:
        raise ValueError(f"malformed: {text[:20].decode(errors='replace')!r} is no count") from None
