"""What each file format keeps of a mesh: write it, read it, compare.

python benchmarks/formats.py            print the table of docs/reference/formats.md
python benchmarks/formats.py --update   put it there
"""

from __future__ import annotations

import argparse
import io
import logging
import sys
from pathlib import Path

import numpy as np

from anisomesh.attributes.model import Mesh, Regions
from anisomesh.io.known_formats import MESH_FORMATS
from anisomesh.io.meshes import load_mesh, save
from anisomesh.shapes.analytic import box

PAGE = Path(__file__).parents[1] / "docs/reference/formats.md"
BEGIN, END = "<!-- begin: python benchmarks/formats.py -->", "<!-- end -->"
EXACT, ROUNDED, NAMES, LOST = "yes", "float32", "names", "-"

SURFACE = box(n=3)
RNG = np.random.default_rng(0)
N_POINTS, N_FACES = SURFACE.n_points, SURFACE.n_faces


def regions(name: str, *, named: bool, seed: int = 1) -> Mesh:
    """Return a mesh with a division into three regions."""
    labels = np.sort(np.random.default_rng(seed).integers(0, 3, N_FACES))[::-1] * 4 + 1
    names = {1: "first part", 5: "inlet", 9: "Wand"} if named else {}
    return Mesh(surface=SURFACE, regions={name: Regions(labels, names)})


def point(name: str, values: np.ndarray) -> Mesh:
    """Return a mesh with point data."""
    return Mesh(surface=SURFACE, point_data={name: values})


def face(name: str, values: np.ndarray) -> Mesh:
    """Return a mesh with face data."""
    return Mesh(surface=SURFACE, face_data={name: values})


def corner(name: str, values: np.ndarray) -> Mesh:
    """Return a mesh with corner data."""
    return Mesh(surface=SURFACE, corner_data={name: values})


def unit_vectors(*shape: int) -> np.ndarray:
    """Return random unit vectors."""
    vectors = RNG.normal(size=(*shape, 3))
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def marked_edges(names: dict[int, str]) -> Mesh:
    """Return a mesh with regions of its feature edges."""
    features = SURFACE.edges[::7]
    return Mesh(
        surface=SURFACE,
        features=features,
        feature_regions={"physical": Regions(np.arange(len(features)) % 3 + 3, names)},
    )


def marked_points(names: dict[int, str]) -> Mesh:
    """Return a mesh with regions of its fixed points."""
    fixed = np.arange(0, N_POINTS, 5)
    return Mesh(
        surface=SURFACE,
        fixed_points=fixed,
        fixed_point_regions={"physical": Regions(np.arange(len(fixed)) % 4 + 2, names)},
    )


MESHES = {
    "numbers at points": point("height", RNG.normal(size=N_POINTS)),
    "vectors at points": point("velocity", RNG.normal(size=(N_POINTS, 3))),
    "integers at points": point("count", RNG.integers(-100, 100, N_POINTS)),
    "strings at points": point("label", np.array([f"point {k}" for k in range(N_POINTS)])),
    "colours at points": point("color", RNG.integers(0, 256, (N_POINTS, 3), dtype=np.uint8)),
    "normals at points": point("normal", unit_vectors(N_POINTS)),
    "texture coordinates at points": point("uv", RNG.uniform(size=(N_POINTS, 2))),
    "texture coordinates at corners": corner("uv", RNG.uniform(size=(N_FACES, 3, 2))),
    "normals at corners": corner("normal", unit_vectors(N_FACES, 3)),
    "colours at corners": corner("color", RNG.integers(0, 256, (N_FACES, 3, 4), dtype=np.uint8)),
    "numbers at corners": corner("weight", RNG.normal(size=(N_FACES, 3))),
    "numbers at faces": face("pressure", RNG.normal(size=N_FACES)),
    "vectors at faces": face("flux", RNG.normal(size=(N_FACES, 3))),
    "integers at faces": face("count", RNG.integers(-100, 100, N_FACES)),
    "regions": regions("region", named=False),
    "regions with names": regions("group", named=True),
    "a second division into regions": Mesh(
        surface=SURFACE, regions={**regions("group", named=True).regions, **regions("part", named=True, seed=2).regions}
    ),
    "feature edges": Mesh(surface=SURFACE, features=SURFACE.edges[::7]),
    "fixed points": Mesh(surface=SURFACE, fixed_points=np.arange(0, N_POINTS, 5)),
    "fixed faces": Mesh(surface=SURFACE, fixed_faces=np.arange(0, N_FACES, 5)),
    "regions of feature edges": marked_edges({}),
    "regions of feature edges with names": marked_edges({3: "inlet", 4: "tip", 5: "outer rim"}),
    "regions of fixed points with names": marked_points({3: "inlet", 5: "outer rim"}),
}


def marked_regions(mesh: Mesh) -> list[dict[bytes, tuple[int, str]]]:
    """Return labels and names by place of the features of a mesh, and of its fixed points, that are in a region."""
    result = []
    for rows, divisions in ((mesh.features, mesh.feature_regions), (mesh.fixed_points, mesh.fixed_point_regions)):
        found = {}
        for division in divisions.values():
            for row, label in zip(rows, division.labels.tolist(), strict=True):
                if label:
                    found[place(mesh, row)] = (label, division.names.get(label, ""))
        result.append(found)
    return result


def marked_kept(mesh: Mesh, read: Mesh) -> str:
    """Return how well the regions of features and fixed points were kept, whatever their divisions are called."""
    given, found = marked_regions(mesh), marked_regions(read)
    if given == found:
        return EXACT
    numbers = [[{key: label for key, (label, _) in part.items()} for part in both] for both in (given, found)]
    if numbers[0] == numbers[1]:
        return "numbers"
    names = [[{key: name for key, (_, name) in part.items()} for part in both] for both in (given, found)]
    return NAMES if names[0] == names[1] and any(name for part in names[0] for name in part.values()) else LOST


def by_corner(mesh: Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the coordinates of each corner and the following two (3 F, 9), and face and corner, in order of these."""
    turns = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])
    places = mesh.surface.points.astype(np.float32)[mesh.surface.faces[:, turns]].reshape(-1, 9)
    order = np.lexsort(places.T)
    return places[order], order // 3, order % 3


def values_at_corners(mesh: Mesh, name: str) -> np.ndarray | None:
    """Return data by name at each corner in an order that does not depend on the file."""
    _, faces, corners = by_corner(mesh)
    if name in mesh.corner_data:
        return mesh.corner_data[name][faces, corners]
    if name in mesh.point_data:
        return mesh.point_data[name][mesh.surface.faces[faces, corners]]
    if name in mesh.face_data:
        return mesh.face_data[name][faces]
    return None


def values_kept(values: np.ndarray, read: np.ndarray | None) -> str:
    """Return how well values were kept."""
    if read is not None and values.ndim == 2 and read.shape == (len(values), 4) and values.shape[1] == 3:
        read = read[:, :3] if (read[:, 3] == 255).all() else None  # opaque colours
    if read is None or read.shape != values.shape:
        return LOST
    if values.dtype.kind == "U":
        return EXACT if (values == read).all() else LOST
    if values.dtype == np.uint8 and read.dtype.kind == "f" and read.max() <= 1.0:
        read = 255.0 * read  # colours as shares
    if np.array_equal(values, read.astype(values.dtype) if read.dtype.kind == "f" else read):
        return EXACT
    close = np.allclose(values, read.astype(np.float64), rtol=1e-6, atol=1e-6)
    return ROUNDED if close else LOST


def regions_kept(mesh: Mesh, read: Mesh) -> str:
    """Return how well all divisions were kept, whatever they are called."""
    _, faces, _ = by_corner(mesh)
    _, faces_read, _ = by_corner(read)
    results = []
    for division in mesh.regions.values():
        labels = division.labels[faces]
        best = LOST
        for other in read.regions.values():
            labels_read = other.labels[faces_read]
            one_to_one = len(np.unique(np.stack([labels, labels_read]), axis=1).T) == len(np.unique(labels))
            if not one_to_one or len(np.unique(labels_read)) < len(np.unique(labels)):
                continue
            texts = [[of.names.get(k, "") for k in at] for of, at in ((division, labels), (other, labels_read))]
            has_names = not division.names or texts[0] == texts[1]
            has_numbers = (labels == labels_read).all()
            found = EXACT if has_numbers and has_names else "numbers" if has_numbers else NAMES if has_names else LOST
            best = min(best, found, key=[EXACT, NAMES, "numbers", LOST].index)
        results.append(best)
    return max(results, key=[EXACT, NAMES, "numbers", LOST].index)


def places(mesh: Mesh, points: np.ndarray) -> set[bytes]:
    """Return the coordinates of points, edges or faces."""
    return {place(mesh, row) for row in points}


def place(mesh: Mesh, row: np.ndarray) -> bytes:
    """Return the coordinates of a point, an edge or a face."""
    found = mesh.surface.points.astype(np.float32)[row].reshape(-1, 3)
    return found[np.lexsort(found.T)].tobytes()


def kept(mesh: Mesh, read: Mesh) -> str:
    """Return how well a file has kept everything that a mesh carries."""
    if mesh.feature_regions or mesh.fixed_point_regions:
        return marked_kept(mesh, read)
    results = []
    for data in (mesh.point_data, mesh.face_data, mesh.corner_data):
        results += [values_kept(values_at_corners(mesh, name), values_at_corners(read, name)) for name in data]
    if mesh.regions:
        results.append(regions_kept(mesh, read))
    for name in ("features", "fixed_points"):
        given, found = getattr(mesh, name), getattr(read, name)
        if len(given):
            results.append(EXACT if places(mesh, given) == places(read, found) else LOST)
    if len(mesh.fixed_faces):
        given, found = (
            places(mesh, mesh.surface.faces[mesh.fixed_faces]),
            places(read, read.surface.faces[read.fixed_faces]),
        )
        results.append(EXACT if given == found else LOST)
    return results[0]


class Warnings(logging.Handler):
    """Collects the warnings of the log."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Take a warning."""
        self.lines.append(record.getMessage())


def round_trip(mesh: Mesh, suffix: str) -> tuple[Mesh, list[str]]:
    """Return a mesh that was written and read, and the warnings."""
    handler, logger = Warnings(), logging.getLogger("anisomesh")
    logger.addHandler(handler)
    propagate, logger.propagate = logger.propagate, False
    try:
        stream = io.BytesIO()
        save(mesh, stream, file_format=suffix)
        return load_mesh(io.BytesIO(stream.getvalue()), file_format=suffix), handler.lines
    finally:
        logger.removeHandler(handler)
        logger.propagate = propagate


def table() -> str:
    """Return the table in Markdown."""
    suffixes = [suffix for suffix in MESH_FORMATS if suffix != ".meshb"]  # which holds what .mesh holds
    names = ["MEDIT" if suffix == ".mesh" else suffix[1:].upper() for suffix in suffixes]
    lines = ["| | " + " | ".join(names) + " |", "|---" * (len(names) + 1) + "|"]
    for kind, mesh in MESHES.items():
        cells = [kept(mesh, round_trip(mesh, suffix)[0]) for suffix in suffixes]
        lines.append(f"| {kind} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Print or update the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--update", action="store_true")
    text = table()
    if parser.parse_args().update:
        page = PAGE.read_text(encoding="utf-8")
        head, rest = page.split(BEGIN)
        PAGE.write_text(f"{head}{BEGIN}\n{text}\n{END}{rest.split(END)[1]}", encoding="utf-8")
    else:
        sys.stdout.write(text + "\n")


if __name__ == "__main__":
    main()
