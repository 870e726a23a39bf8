"""Whether the counts in a Gmsh file fit its size: the library that reads it makes room for what a file promises."""

from __future__ import annotations

import numpy as np

_LEAST_NODE = 8  # bytes: a tag and three coordinates as text
_NODE_BYTES = 28  # in the binary of version 2: a tag and three coordinates
_NODES_OF_TYPE = dict(enumerate([2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13], start=1))


def check_counts(data: bytes) -> None:
    """Raise ValueError if the file promises more nodes or elements than it has bytes for.

    Looked at are the numbers of nodes of all versions, the tags of nodes in the text of version 2, and the blocks of
    elements in its binary.
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
        if len(tags) and not tags.max() <= len(data):
            raise ValueError(f"malformed: the number of a node is {tags.max():.0f} in {len(data)} bytes")


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
