"""Reading of fields at the points of a mesh from files of any format."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.errors import MeshFileError
from anisomesh.io.carried import Array
from anisomesh.io.formats.medit.sections import PLANE
from anisomesh.io.formats.medit.solution import read_sol, sol_dimension
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.io.meshes import load_mesh

FieldKind = Literal["scalar", "vector", "tensor"]

_SOLUTIONS = (".sol", ".solb")  # of MEDIT
_FIELD_FORMATS = (*_SOLUTIONS, ".npy", *MESH_FORMATS)
_SPEC = re.compile(rf"(.*?(?:{'|'.join(map(re.escape, _FIELD_FORMATS))})):(.+)", re.IGNORECASE | re.DOTALL)
_KIND_OF_WIDTH: dict[int, FieldKind] = {1: "scalar", 2: "vector", 3: "vector", 9: "tensor"}  # of rows
_UPPER = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))  # VTK's order of symmetric tensors


@dataclass(frozen=True, kw_only=True, eq=False)
class PointField:
    """A field of a file.

    Attributes
    ----------
    path, name
        The file, and the name of the field in it.
    kind
        ``"scalar"``, ``"vector"`` or ``"tensor"``.
    values
        One row for each point, in the order of the file: (V,), (V, 2) or (V, 3), or (V, 3, 3), as float64.
    points
        The points (V, 3), None if the file has none.
    layout
        How rows were read, in words.
    """

    path: Path
    name: str
    kind: FieldKind
    values: npt.NDArray[np.float64]
    points: Points | None
    layout: str


def split_spec(spec: str | os.PathLike[str]) -> tuple[Path, str | None]:
    """Return the file and the name of the field, None if there is none, in ``FILE`` or ``FILE:NAME``."""
    text = os.fspath(spec)
    match = None if Path(text).exists() else _SPEC.fullmatch(text)
    return (Path(text), None) if match is None else (Path(match[1]), match[2])


def load_field(spec: str | os.PathLike[str], kinds: Collection[FieldKind] = ("scalar", "tensor")) -> PointField:
    """Read a field at the points of a mesh from a file.

    Parameters
    ----------
    spec
        ``FILE`` or ``FILE:NAME``. The file is a MEDIT solution (.sol or .solb), whose fields are called 1, 2, ...; an
        array of NumPy (.npy); or any mesh file with point data (.vtu, .vtp, .ply, .msh, .glb). The name may be left out
        if one field of real numbers is of the wanted kinds.
    kinds
        The wanted kinds.

    Returns
    -------
    PointField
        Values are not checked: they may be NaN, and matrices need not be symmetric.

    Raises
    ------
    MeshFileError
        If the file cannot be read, there is no field of this name, it is of another kind, or none is named and there
        is not exactly one of the wanted kinds. The message lists the fields.

    Notes
    -----
    Tensors have 9 components, row by row, or in VTU and VTP files 6 in VTK's order XX YY ZZ XY YZ XZ, and in MEDIT
    solutions 6 in the order m11 m12 m22 m13 m23 m33.
    """
    path, name = split_spec(spec)
    data, points = _data(path)
    if name is None:
        types = "iuf" if path.suffix.lower() == ".npy" else "f"  # integers of meshes are labels, as a rule
        suitable = [key for key, values in data.items() if values.dtype.kind in types and _kind(path, values) in kinds]
        if len(suitable) != 1:
            unnamed = (
                f"name one, as in {path.name}:NAME" if suitable else "it has no field that can be used without a name"
            )
            reason = "it cannot be used" if path.suffix.lower() == ".npy" else unnamed
            raise MeshFileError(f"{path}: {reason}; {_expected(kinds)}; {_listed(data)}")
        (name,) = suitable
    elif name not in data:
        raise MeshFileError(f"{path}: it has no field {name!r} at points; {_listed(data)}")
    values = data[name]
    kind = _kind(path, values)
    if kind is None or kind not in kinds:
        six = "; 6 components have a known order in VTU and VTP files only" if values.shape[1:] == (6,) else ""
        raise MeshFileError(f"{path}: the field {name!r} is {_shape(values)}; {_expected(kinds)}{six}")
    layout = "XX YY ZZ XY YZ XZ" if values.shape[1:] == (6,) else "row by row" if kind == "tensor" else ""
    if path.suffix.lower() in _SOLUTIONS and kind == "tensor":
        planar = sol_dimension(path.read_bytes()) == PLANE
        layout = "m11 m12 m22, and for m33 the mean of m11 and m22" if planar else "m11 m12 m22 m13 m23 m33"
    return PointField(path=path, name=name, kind=kind, values=_rows(values, kind), points=points, layout=layout)


def _data(path: Path) -> tuple[Mapping[str, Array], Points | None]:
    """Return the arrays at the points of a file by name, and its points if it has some."""
    suffix = path.suffix.lower()
    if suffix in MESH_FORMATS:
        mesh = load_mesh(path)
        return mesh.point_data, mesh.surface.points
    if suffix not in _FIELD_FORMATS:
        raise MeshFileError(
            f"{path}: unknown format {suffix or '(no extension)'}; expected one of .sol, .solb, .npy, "
            f"{', '.join(sorted(MESH_FORMATS))}, and :NAME behind it"
        )
    try:
        if suffix == ".npy":
            with path.open("rb") as file:
                return {"array": _array_of(file)}, None
        return {str(k): values for k, values in enumerate(read_sol(path.read_bytes()), start=1)}, None
    except OSError as error:
        raise MeshFileError(f"{path}: cannot be read: {error.strerror or error}") from error
    except (ValueError, EOFError) as error:
        raise MeshFileError(f"{path}: cannot be read as {suffix[1:].upper()}: {error}") from error


def _array_of(file: BinaryIO) -> Array:
    """Return the array in a NumPy file, or raise ValueError in words that do without NumPy's."""
    try:
        return np.asarray(np.lib.format.read_array(file, allow_pickle=False))
    except (ValueError, EOFError) as error:
        if "Object arrays" in str(error):
            raise ValueError("it holds Python objects; expected an array of numbers") from error
        raise ValueError("it was not written by numpy.save, or is truncated") from error


def _kind(path: Path, values: Array) -> FieldKind | None:
    """Return what kind of field an array of a file is, None for others."""
    if values.dtype.kind not in "iuf" or values.ndim == 0:
        return None
    if values.shape[1:] == (3, 3) or (values.shape[1:] == (6,) and path.suffix.lower() in (".vtu", ".vtp")):
        return "tensor"
    return _KIND_OF_WIDTH.get(1 if values.ndim == 1 else values.shape[1]) if values.ndim <= 2 else None


def _rows(values: Array, kind: FieldKind) -> npt.NDArray[np.float64]:
    """Return an array of a kind in its standard shape."""
    rows = values.astype(np.float64)
    if kind == "scalar":
        return rows.reshape(-1)
    if kind == "vector":
        return rows
    if rows.shape[1:] != (6,):
        return rows.reshape(-1, 3, 3)
    tensors = np.zeros((len(rows), 3, 3))
    for column, (i, j) in enumerate(_UPPER):
        tensors[:, i, j] = tensors[:, j, i] = rows[:, column]
    return tensors


def _expected(kinds: Collection[FieldKind]) -> str:
    words = {"scalar": "a number", "vector": "a vector", "tensor": "a 3x3 tensor (9 components)"}
    return f"expected {' or '.join(words[kind] for kind in kinds)} per point"


def _listed(data: Mapping[str, Array]) -> str:
    if not data:
        return "it has no field at points"
    return "it has " + ", ".join(f"{name!r} ({_shape(values)})" for name, values in data.items())


def _shape(values: Array) -> str:
    return f"{values.dtype} of shape {values.shape}"
