"""The header of a PLY file: its elements and their properties."""

from __future__ import annotations

import re
from dataclasses import dataclass

from anisomesh.io.formats.words import text_of

PLY_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("int64", "longlong"), "i8"),
    **dict.fromkeys(("uint64", "ulonglong"), "u8"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_BYTE_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
REGIONS = "regions"
"""First word of comments that make a property of faces a division: its name, a label, and the name of the label."""

EDGE_REGIONS = "edge_regions"
"""First word of comments that do so for a property of edges."""

NAME = "name"
"""First word of comments that give data a name that is not one word: the element, the property, and the name."""

TEXTURE_FILE = "TextureFile"
"""First word of comments that name a texture."""


@dataclass(frozen=True)
class Property:
    """A property: its name, its NumPy type and, if it is a list, the type of its size."""

    name: str
    type: str
    count_type: str | None = None


@dataclass(frozen=True)
class Element:
    """An element: its name, how many rows it has, and their properties."""

    name: str
    count: int
    properties: tuple[Property, ...]


@dataclass(frozen=True)
class Header:
    """A header: byte order (empty for text), elements, comments, and the position of the body."""

    order: str
    elements: list[Element]
    comments: list[str]
    start: int


def read_header(data: bytes) -> Header:
    """Return the header; ValueError if it is malformed."""
    first = re.match(rb"ply[ \t]*(\r\n|\n|\r)", data)
    if first is None:
        raise ValueError("it does not begin with the line ply")
    end_of_line = b"\r" if first[1] == b"\r" else b"\n"
    end = re.search(rb"[\r\n][ \t]*end_header[^\r\n]*(?:\r(?=\n))?" + end_of_line, data)
    if end is None:
        raise ValueError("truncated: the header has no end_header line")
    order: str | None = None
    elements: list[Element] = []
    comments: list[str] = []
    for line in map(text_of, data[: end.start()].splitlines()[1:]):
        match line.split():
            case ["format", name, *_]:
                order = _BYTE_ORDERS.get(name)
            case ["element", name, count] if count.isdigit():
                elements.append(Element(name, int(count), ()))
            case ["property", "list", count_type, kind, name] if elements and {count_type, kind} <= PLY_TYPES.keys():
                prop = Property(name, PLY_TYPES[kind], PLY_TYPES[count_type])
                elements[-1] = _with_property(elements[-1], prop)
            case ["property", kind, name] if elements and kind in PLY_TYPES:
                elements[-1] = _with_property(elements[-1], Property(name, PLY_TYPES[kind]))
            case ["comment", *_]:
                comments.append(line.strip().removeprefix("comment").strip())
            case [] | ["obj_info", *_]:
                pass
            case _:
                raise ValueError(f"the header line {line[:60]!r} is malformed; expected element or property")
    if order is None:
        raise ValueError(f"the header names no known format; expected one of {', '.join(_BYTE_ORDERS)}")
    return Header(order, elements, comments, end.end())


def _with_property(element: Element, prop: Property) -> Element:
    if any(known.name == prop.name for known in element.properties):
        raise ValueError(f"the header declares the property {prop.name} of {element.name} twice")
    return Element(element.name, element.count, (*element.properties, prop))
