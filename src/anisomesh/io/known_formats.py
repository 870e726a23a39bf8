"""The formats of mesh files by their extensions."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable
from pathlib import Path

from anisomesh.attributes.model import Mesh
from anisomesh.errors import MeshFileError
from anisomesh.io.formats.gltf.read import read_glb
from anisomesh.io.formats.gltf.write import glb_bytes
from anisomesh.io.formats.gmsh.read import read_msh
from anisomesh.io.formats.gmsh.write import msh_bytes
from anisomesh.io.formats.medit.read import read_medit
from anisomesh.io.formats.medit.write import medit_bytes, meditb_bytes
from anisomesh.io.formats.obj.read import read_obj
from anisomesh.io.formats.obj.write import obj_bytes
from anisomesh.io.formats.off import off_bytes, read_off
from anisomesh.io.formats.ply.read import read_ply
from anisomesh.io.formats.ply.write import ply_bytes
from anisomesh.io.formats.stl import is_binary_stl, read_stl, stl_bytes
from anisomesh.io.formats.threemf.read import read_3mf
from anisomesh.io.formats.threemf.write import threemf_bytes
from anisomesh.io.formats.vtk.read import read_vtp, read_vtu
from anisomesh.io.formats.vtk.write import vtp_mesh_bytes, vtu_mesh_bytes
from anisomesh.io.formats.words import BYTE_ORDER_MARK
from anisomesh.io.holding.losses import Losses
from anisomesh.io.polygons import PolygonSoup

READERS: dict[str, Callable[[bytes], PolygonSoup]] = {
    ".obj": read_obj,
    ".off": read_off,
    ".ply": read_ply,
    ".stl": read_stl,
    ".glb": read_glb,
    ".3mf": read_3mf,
    ".vtu": read_vtu,
    ".vtp": read_vtp,
    ".msh": read_msh,
    ".mesh": read_medit,
    ".meshb": read_medit,
}
WRITERS: dict[str, Callable[[Mesh, Losses], bytes]] = {
    ".obj": obj_bytes,
    ".off": off_bytes,
    ".ply": ply_bytes,
    ".stl": stl_bytes,
    ".glb": glb_bytes,
    ".3mf": threemf_bytes,
    ".vtu": vtu_mesh_bytes,
    ".vtp": vtp_mesh_bytes,
    ".msh": msh_bytes,
    ".mesh": medit_bytes,
    ".meshb": meditb_bytes,
}
TEXT_FORMATS = (".obj", ".off", ".ply", ".msh", ".mesh")
"""Extensions of formats of text, which may begin with a byte order mark; text STL is found by its reader."""

MESH_FORMATS = tuple(READERS)
"""Extensions of files that are read and written, in lower case with the dot."""

_COMMENTS = rb"(?:\s|#[^\r\n]*[\r\n])*"
_BEGINNINGS = (  # what a file begins with, the extensions that it may have, and what it is called in messages
    (rb"ply\s", (".ply",), "a PLY file"),
    (rb"\s*\$(MeshFormat|Comments)\b", (".msh",), "a Gmsh file (MSH)"),
    (rb"glTF", (".glb",), "a GLB file"),
    (rb"PK\x03\x04", (".3mf",), "a 3MF file or another archive"),
    (_COMMENTS + rb"MeshVersionFormatted|\x01\0\0\0[\x01-\x04]\0\0\0", (".mesh", ".meshb"), "a MEDIT file"),
    (_COMMENTS + rb"(ST)?C?N?OFF[\s\d]", (".off",), "an OFF file"),
    (rb"(?s)\s*solid\b.*?\bfacet\s+normal\b", (".stl",), "a text STL file"),
    (rb"\s*(<\?xml[^>]*>\s*)?<VTKFile", (".vtu", ".vtp"), "a VTK file (VTU or VTP)"),
    (rb"# vtk DataFile", (), "a legacy VTK file (.vtk); save it as VTU or VTP"),
    (rb"\s*<(!DOCTYPE )?html\b", (), "a web page"),
    (_COMMENTS + rb"(mtllib\s|[go]\s|v\s+[-+.\d])", (".obj",), "an OBJ file"),
)


def mistaken_format(data: bytes, suffix: str) -> str:
    """Return what a file that cannot be read in a format seems to be instead, empty if that is not known."""
    if suffix in (*TEXT_FORMATS, ".stl") and data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "text in UTF-16; save it in UTF-8"
    for beginning, suffixes, name in _BEGINNINGS:
        if suffix not in suffixes and re.match(beginning, data.removeprefix(BYTE_ORDER_MARK), re.IGNORECASE):
            return f"{name}; give it the extension {suffixes[0]}" if suffixes else name
    return "a binary STL file; give it the extension .stl" if suffix != ".stl" and is_binary_stl(data) else ""


def known_suffix(path: str | Path, file_format: str | None, *, is_stream: bool = False) -> str:
    """Return the extension of the format in lower case, or raise MeshFileError if it is unknown.

    The message says how the format of a stream is given.
    """
    expected = ", ".join(sorted(MESH_FORMATS))
    if file_format is not None:
        suffix = "." + file_format.lower().removeprefix(".") if isinstance(file_format, str) else ""
        if suffix not in MESH_FORMATS:
            raise MeshFileError(f"{path}: unknown format {file_format!r}; expected one of {expected}")
        return suffix
    if is_stream and not Path(path).suffix:
        raise MeshFileError(f"{path}: has no name that ends in a format; give file_format, one of {expected}")
    suffix = Path(path).suffix.lower()
    if suffix not in MESH_FORMATS:
        raise MeshFileError(
            f"{path}: unknown format {Path(path).suffix or '(no extension)'}; expected one of {expected}"
        )
    return suffix
