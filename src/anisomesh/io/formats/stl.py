"""The STL format, binary and text: unconnected triangles."""

from __future__ import annotations

import logging
import re

import numpy as np

from anisomesh._arrays import Faces, Points
from anisomesh.io.formats.words import BYTE_ORDER_MARK
from anisomesh.io.polygons import PolygonSoup
from anisomesh.mesh.geometry import face_cross, unit
from anisomesh.mesh.weld import coincident

logger = logging.getLogger(__name__)

_HEADER_BYTES = 84  # of a binary file: 80 of text and the number of triangles
_TEXT = re.compile(rb"\s*solid.*?\bfacet\s+normal\b", re.DOTALL | re.IGNORECASE)
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(data: bytes) -> PolygonSoup:
    """Read an STL file and weld corners with equal coordinates, which is logged.

    Notes
    -----
    A file is text if it begins with "solid" and has a facet, unless its size fits its number of triangles: headers of
    binary files can begin with "solid" as well. Bytes behind the triangles of a binary file are left out, with a
    remark, unless they are triangles that the file does not count.
    """
    declared = int.from_bytes(data[80:84], "little") if len(data) >= _HEADER_BYTES else -1
    end = _HEADER_BYTES + declared * _TRIANGLE.itemsize
    remarks: list[str] = []
    if len(data) != end and _TEXT.match(data.removeprefix(BYTE_ORDER_MARK)):
        corners = _text_corners(data.lower(), remarks)
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
    points, inverse = np.unique(coincident(corners), return_inverse=True)
    logger.info("STL stores no connectivity: welded %d corners into %d points", len(corners), len(points))
    return PolygonSoup.from_array(corners[points], inverse.reshape(-1, 3), remarks=remarks)


def stl_bytes(points: Points, faces: Faces) -> bytes:
    """Return the content of a binary STL file; coordinates are rounded to float32."""
    rows = np.zeros(len(faces), dtype=_TRIANGLE)
    with np.errstate(over="ignore"):
        rows["corners"] = points[faces]
    if not np.isfinite(rows["corners"]).all():
        raise ValueError("coordinates beyond 3.4e38 do not fit the float32 of STL; use PLY instead")
    rows["normal"] = unit(face_cross(points, faces))
    return b"binary STL".ljust(_HEADER_BYTES - 4) + len(faces).to_bytes(4, "little") + rows.tobytes()


def _text_corners(text: bytes, remarks: list[str]) -> Points:
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
    return np.array([list(map(float, row)) for row in found], dtype=np.float64).reshape(-1, 3)
