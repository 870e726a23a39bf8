"""Digests of a set of remeshes, to show that a change that should not change results does not.

    python benchmarks/digests.py record digests.json      before the change
    python benchmarks/digests.py check digests.json       after it; exits with 1 where a mesh differs

Floating-point results depend on the processor and on library versions, so record and check on one machine.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import anisomesh
from anisomesh import Surface
from anisomesh.denoise.noise import with_noise
from anisomesh.shapes import analytic as shapes
from anisomesh.shapes.analytic import cylinder, ellipsoid, open_patch, sphere, torus, twisted_ring
from anisomesh.shapes.parts import hollow_loft, sparse_parts


def saddle() -> Surface:
    """Return an open surface with curvatures of either sign."""
    return open_patch(lambda x, y: 0.4 * x**2 - 0.2 * y**2 + 0.1 * np.sin(4.0 * x))


def several(*surfaces: Surface) -> Surface:
    """Return surfaces side by side as one."""
    points, faces, n_points, place = [], [], 0, 0.0
    for surface in surfaces:
        low, high = surface.points[:, 0].min(), surface.points[:, 0].max()
        points.append(surface.points + np.array([place - low, 0.0, 0.0]))
        faces.append(surface.faces + n_points)
        n_points += surface.n_points
        place += high - low + 0.2
    return Surface(np.concatenate(points), np.concatenate(faces).astype(np.int32))


def crossing_boxes() -> Surface:
    """Return two boxes that intersect."""
    box = shapes.box()
    points = np.concatenate([box.points, 0.6 * box.points + [0.45, 0.1, 0.05]])
    return Surface(points, np.concatenate([box.faces, box.faces + box.n_points]).astype(np.int32))


def folded_sheet(folds: int = 5, gap: float = 0.02) -> Surface:
    """Return a thin closed sheet folded over itself: neighbouring layers are nearer than vertices of a remesh."""
    patch = open_patch(lambda x, y: 3.0 * gap * np.sin(folds * np.pi * x) * np.cos(3.0 * y), 24)
    flat = patch.points
    lower = flat - [0.0, 0.0, 0.5 * gap]
    top, rim = Surface(flat, patch.faces), Surface(flat, patch.faces).on_boundary
    n = len(flat)
    sides = [edge for edge in top.edges.tolist() if rim[edge].all()]
    directed = {(a, b) for face in patch.faces.tolist() for a, b in zip(face, face[1:] + face[:1], strict=True)}
    wall = []
    for a, b in sides:
        if top.edge_face_count[top.edges.tolist().index([a, b])] != 1:
            continue
        if (a, b) not in directed:
            a, b = b, a
        wall += [[b, a, a + n], [b, a + n, b + n]]
    faces = np.concatenate([patch.faces, patch.faces[:, ::-1] + n, np.array(wall)]).astype(np.int32)
    return Surface(np.concatenate([flat, lower]), faces)


def anisotropic_tensors(surface: Surface) -> np.ndarray:
    """Return a metric (V, 3, 3) that stretches triangles along x, more so at one end."""
    tensors = np.tile(np.eye(3), (surface.n_points, 1, 1))
    tensors[:, 1, 1] = tensors[:, 2, 2] = 1.0 + 8.0 * (surface.points[:, 0] - surface.points[:, 0].min())
    return tensors


def cases() -> dict[str, Callable[[], anisomesh.RemeshResult]]:
    """Return what is remeshed: closed, open, CAD, noisy, own metric, many components, hard to make valid."""
    outer = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    section = np.array([[0.6, 0.0], [1.0, 0.0], [1.0, 1.0], [0.6, 1.0]])
    ring, part, noisy = torus(), anisomesh.sample(), with_noise(torus(), 0.3, np.random.default_rng(1))
    direct = {"embedding": "direct"}
    return {
        "closed": lambda: anisomesh.remesh(ellipsoid(), n_vertices=600, **direct),
        "closed, twisted": lambda: anisomesh.remesh(twisted_ring(), n_vertices=500, **direct),
        "open": lambda: anisomesh.remesh(cylinder(), n_vertices=400, **direct),
        "open, approximation": lambda: anisomesh.remesh(saddle(), n_vertices=250, metric="approximation", **direct),
        "CAD": lambda: anisomesh.remesh(
            part, n_vertices=700, metric="approximation", final_sharpness=30.0, max_iterations=60, **direct
        ),
        "CAD, sparse": lambda: anisomesh.remesh(sparse_parts()["gear"], n_vertices=300, **direct),
        "CAD, hollow": lambda: anisomesh.remesh(hollow_loft(outer, section), n_vertices=300, **direct),
        "noisy": lambda: anisomesh.remesh(noisy, n_vertices=500, **direct),
        "noisy, hybrid": lambda: anisomesh.remesh(noisy, n_vertices=500, embedding="hybrid"),
        "noisy, paper": lambda: anisomesh.remesh(noisy, n_vertices=300, embedding="neural", weights="paper"),
        "own metric": lambda: anisomesh.remesh(ring, n_vertices=500, metric=anisotropic_tensors(ring), **direct),
        "plain CVT": lambda: anisomesh.remesh(ring, n_vertices=400, sharpness=1.0, metric="uniform", **direct),
        "components": lambda: anisomesh.remesh(
            several(sphere(), torus(), sparse_parts()["bracket"], saddle(), sphere(2, 0.05)), n_vertices=900, **direct
        ),
        "tagged": lambda: anisomesh.remesh(
            ring, n_vertices=400, features=np.stack([np.arange(24), np.roll(np.arange(24), -1)], axis=1), **direct
        ),
        "crossing": lambda: anisomesh.remesh(crossing_boxes(), n_vertices=300, **direct),
        "too few": lambda: anisomesh.remesh(several(*[sphere(2)] * 20), n_vertices=40, **direct),
        "folded": lambda: anisomesh.remesh(folded_sheet(), n_vertices=200, **direct),
        "max error": lambda: anisomesh.remesh(ellipsoid(), max_error=0.02, max_iterations=30, **direct),
    }


def digest(result: anisomesh.RemeshResult) -> str:
    """Return a digest of points, faces and diagram of a result."""
    arrays = (result.surface.points, result.surface.faces, result.diagram.sites, result.diagram.label)
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()[:24]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=["record", "check"])
    parser.add_argument("file", type=Path)
    parser.add_argument(
        "--data", type=Path, nargs="*", default=[], help="mesh files that are remeshed at a fifth as well"
    )
    arguments = parser.parse_args()
    work = cases()
    for path in arguments.data:
        work[path.name] = lambda path=path: anisomesh.remesh(anisomesh.load(path), ratio=0.2, embedding="direct")
    recorded = json.loads(arguments.file.read_text()) if arguments.action == "check" else {}
    found, different = {}, 0
    for name, run in work.items():
        start = time.perf_counter()
        result = run()
        found[name] = digest(result)
        mark = "" if arguments.action == "record" or recorded.get(name) == found[name] else "DIFFERENT"
        different += bool(mark)
        print(
            f"{name:24} {found[name]} {result.surface.n_points:6} {time.perf_counter() - start:6.1f} s {mark}",
            flush=True,
        )
    if arguments.action == "record":
        arguments.file.write_text(json.dumps(found, indent=1) + "\n")
    elif different:
        print(f"{different} of {len(found)} differ")
    return int(different > 0)


if __name__ == "__main__":
    sys.exit(main())
