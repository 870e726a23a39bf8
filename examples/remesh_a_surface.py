"""Remesh a surface, look at the report, write the mesh and a picture coloured by the stretch of the triangles.

Run it with the file to remesh, or without one for a knotted tube (extra: picture):

    python examples/remesh_a_surface.py bunny.obj
"""

import sys
from pathlib import Path

import anisomesh
from anisomesh.viz import side_by_side, stretch_colouring


def main(source: Path | None, folder: Path, n_vertices: int = 800) -> anisomesh.RemeshResult:
    surface = anisomesh.sample("knot") if source is None else anisomesh.load(source)
    result = anisomesh.remesh(surface, n_vertices=n_vertices)

    report = result.report()
    print(f"{surface.n_points:,} -> {report['vertices']:,} vertices in {report['seconds']['total']:.1f} s")
    print(f"triangles are stretched {report['stretch']['mean']:.1f} times on average")
    for warning in report["warnings"]:
        print("warning:", warning)

    anisomesh.save(result.surface, folder / "remeshed.ply")
    side_by_side(surface, result.surface, folder / "remeshed.png", values=stretch_colouring(result.surface))
    return result


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None, Path.cwd())
