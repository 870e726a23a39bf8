"""The STL format, binary and text: unconnected triangles."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator

import numpy as np

from anisomesh._arrays import Points
from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.carried import Carried
from anisomesh.io.formats.region_names import divide, in_words, region_texts
from anisomesh.io.formats.words import BYTE_ORDER_MARK, format_rows, parsed_reals, text_of, with_line_feeds
from anisomesh.io.holding.divisions import by_label, main_division
from anisomesh.io.holding.losses import Losses
from anisomesh.io.polygons import PolygonSoup
from anisomesh.mesh.geometry import face_cross, unit
from anisomesh.mesh.weld import coincident

logger = logging.getLogger(__name__)

SOLID, ATTRIBUTE = "solid", "attribute"
"""Names of the division into solids, and of the two bytes per triangle as face data."""

_HEADER_BYTES = 84  # of a binary file: 80 of text and the number of triangles
_TEXT = re.compile(rb"\s*solid.*?\bfacet\s+normal\b", re.DOTALL | re.IGNORECASE)
_FACET = re.compile(rb"\bfacet\s+normal\b")
_SOLID = re.compile(rb"solid\b")
_BEGIN_OF_FACET = rb"\bfacet\s+normal(?:\s+\S+){3}\s+outer\b"
_SOLID_NAME = re.compile(rb"[^\n]*?(?=" + _BEGIN_OF_FACET + rb"|\n|\Z)")  # the first facet may begin on its line
_END_OF_FACET = re.compile(rb"\bendfacet\b", re.IGNORECASE)
_FACET_AND_END = re.compile(rb"(\bendloop\s+endfacet)[ \t]+(?=endsolid\b)", re.IGNORECASE)
_END_AND_SOLID = re.compile(
    rb"^([ \t]*endsolid\b[^\n]*?)[ \t](?=solid\b[^\n]*?(?:\n\s*)?" + _BEGIN_OF_FACET + rb")",
    re.IGNORECASE | re.MULTILINE,
)
_END_IN_NAME = re.compile(r"(?<=end)(?=solid)", re.IGNORECASE)
_FACET_IN_NAME = re.compile(r"(?<=\bfacet) (?=normal( \S+){3} outer\b)", re.IGNORECASE)
_FACET_LINES = "facet normal %r %r %r\n outer loop\n" + 3 * "  vertex %r %r %r\n" + " endloop\nendfacet\n"
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(data: bytes) -> PolygonSoup:
    """Read an STL file and weld corners with equal coordinates, which is logged.

    Notes
    -----
    A file is text if it begins with "solid" and has a facet, unless its size fits its number of triangles: headers of
    binary files can begin with "solid" as well. Bytes behind the triangles of a binary file are left out, with a
    remark, unless they are triangles that the file does not count. Solids of text are a division; the two bytes per
    triangle of binary files are face data.
    """
    declared, end = _declared(data)
    remarks: list[str] = []
    carried = Carried()
    if len(data) != end and _TEXT.match(data.removeprefix(BYTE_ORDER_MARK)):
        text = _in_lines(data.removeprefix(BYTE_ORDER_MARK))
        words = bytearray(text.lower())
        solids = list(_take_names(words))
        corners = _text_corners(words, remarks)
        with carried.optional("its solids"):
            _divide(carried, words, [(at, text[name]) for at, name in solids])
    elif declared < 0:
        raise ValueError(f"truncated: {len(data)} bytes; a binary STL file has at least {_HEADER_BYTES}")
    elif len(data) < end or (data[end:].strip(b"\0") and (len(data) - end) % _TRIANGLE.itemsize == 0):
        raise ValueError(
            f"truncated or malformed: it declares {declared} triangles, that is {end} bytes, but has {len(data)}"
        )
    else:
        if len(data) > end:
            remarks.append(f"left out {len(data) - end} byte(s) behind the {declared} triangles that it declares")
        rows = np.frombuffer(data, dtype=_TRIANGLE, offset=_HEADER_BYTES, count=declared)
        corners = rows["corners"].astype(np.float64).reshape(-1, 3)
        if rows["attribute"].any():
            carried.cell_data[ATTRIBUTE] = rows["attribute"].copy()
    points, inverse = np.unique(coincident(corners), return_inverse=True)
    logger.info("STL stores no connectivity: welded %d corners into %d points", len(corners), len(points))
    return PolygonSoup.from_array(corners[points], inverse.reshape(-1, 3), remarks=remarks, carried=carried)


def _declared(data: bytes) -> tuple[int, int]:
    """Return how many triangles a binary file declares, -1 if it is too short, and the size that fits them."""
    declared = int.from_bytes(data[80:84], "little") if len(data) >= _HEADER_BYTES else -1
    return declared, _HEADER_BYTES + declared * _TRIANGLE.itemsize


def is_binary_stl(data: bytes) -> bool:
    """Return whether the size of a file is the one of a binary STL file with as many triangles as it declares."""
    declared, end = _declared(data)
    return declared > 0 and len(data) == end


def _in_lines(data: bytes) -> bytes:
    """Return a text whose solids begin on lines of their own, which any white space may separate in the file."""
    text = with_line_feeds(data)
    if text.count(b"\n") < text.lower().count(b"endfacet"):
        text = _END_OF_FACET.sub(b"endfacet\n", text)
    return _END_AND_SOLID.sub(rb"\1\n", _FACET_AND_END.sub(rb"\1\n", text))


def _take_names(words: bytearray) -> Iterator[tuple[int, slice]]:
    """Put blanks for the names of solids, in which any word may be; yield where solids begin and their names are."""
    for match in _SOLID.finditer(bytes(words)):
        begin = bytes(words[words.rfind(b"\n", 0, match.start()) + 1 : match.start()]).strip()
        name = _SOLID_NAME.match(words, match.end())
        if begin in (b"", b"end") and name is not None:
            words[name.start() : name.end()] = b" " * len(name[0])
            if not begin:
                yield match.start(), slice(*name.span())


def _divide(carried: Carried, words: bytearray, solids: list[tuple[int, bytes]]) -> None:
    """Add the solids, numbered from 1, if there are several or one has a name; where they begin and names are given."""
    texts = [" ".join(text_of(name).split()) for _, name in solids]
    facets = np.array([match.start() for match in _FACET.finditer(words)])
    labels = np.searchsorted(np.array([at for at, _ in solids]), facets)
    if any(texts) or len(solids) > 1:
        divide(carried, SOLID, labels, texts, range(1, len(solids) + 1))


def _text_corners(text: bytearray, remarks: list[str]) -> Points:
    n_facets, n_closed = len(re.findall(rb"\bfacet\s+normal\b", text)), len(re.findall(rb"\bendfacet\b", text))
    found = re.findall(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", text)
    has_end = re.search(rb"\bendsolid\b", text) is not None
    if n_facets != n_closed or len(found) != 3 * n_facets or not (has_end or text.rstrip().endswith(b"endfacet")):
        raise ValueError(
            f"truncated: {n_facets} facets are opened, {n_closed} closed, with {len(found)} corners; expected 3 for "
            "each facet and a closing endsolid"
        )
    if not has_end:
        remarks.append(f"it has no endsolid after its {n_facets} facets; check that none is missing")
    return parsed_reals([word for row in found for word in row]).reshape(-1, 3)


def stl_bytes(mesh: Mesh, losses: Losses) -> bytes:
    """Return the content of an STL file.

    Notes
    -----
    A mesh with regions becomes a text file with a solid for each region of one division, in float64. Without regions it
    becomes a binary file, in float32.
    """
    points, faces = mesh.surface.points, mesh.surface.faces
    found = main_division(mesh.regions, SOLID)
    attribute = mesh.face_data.get(ATTRIBUTE)
    is_held = found is None and attribute is not None and attribute.ndim == 1 and attribute.dtype == np.uint16
    losses.add("point data", *mesh.point_data)
    losses.add("face data", *(name for name in mesh.face_data if name != ATTRIBUTE or not is_held))
    losses.add("corner data", *mesh.corner_data)
    losses.add("regions", *(name for name in mesh.regions if found is None or name != found[0]))
    losses.add("materials", *mesh.materials)
    losses.features(mesh)
    if found is not None:
        texts = region_texts(found[1], losses, _written)
        return _text(mesh, found[1], texts).encode("utf-8", errors="replace")
    rows = np.zeros(len(faces), dtype=_TRIANGLE)
    with np.errstate(over="ignore"):
        rows["corners"] = points[faces]
    if not np.isfinite(rows["corners"]).all():
        raise ValueError("coordinates beyond 3.4e38 do not fit the float32 of STL; use PLY instead")
    rows["normal"] = unit(face_cross(points, faces))
    if is_held and attribute is not None:
        rows["attribute"] = attribute
    return b"binary STL".ljust(_HEADER_BYTES - 4) + len(faces).to_bytes(4, "little") + rows.tobytes()


def _written(name: str) -> str:
    """Return the name of a solid without what would be read as its end or as a facet."""
    return _FACET_IN_NAME.sub("_", _END_IN_NAME.sub("_", in_words(name)))


def _text(mesh: Mesh, solids: Regions, texts: dict[int, str]) -> str:
    """Return a text file with a solid for each region, in the order of their labels."""
    points, faces = mesh.surface.points, mesh.surface.faces
    table = np.concatenate([unit(face_cross(points, faces)), points[faces].reshape(-1, 9)], axis=1)
    parts = []
    for (label,), chosen in by_label(solids.labels):
        rows = format_rows(_FACET_LINES, table[chosen])
        at_end = "" if SOLID in texts[label].lower() else f" {texts[label]}"  # where some would see another begin
        parts.append(f"solid {texts[label]}\n{rows}endsolid{at_end}\n")
    return "".join(parts)
