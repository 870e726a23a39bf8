"""Remesh a surface, look at the report, write the mesh and a picture.

Run it with the file to remesh, or without for a built-in sample (extra: picture):

    python examples/remesh_a_surface.py bunny.obj
"""

import sys
from pathlib import Path

import anisomesh


def main(source: Path | None, folder: Path, n_vertices: int = 1000) -> anisomesh.RemeshResult:
    surface = anisomesh.sample() if source is None else anisomesh.load(source)
    result = anisomesh.remesh(surface, n_vertices=n_vertices)

    report = result.report()
    print(f"{surface.n_points:,} -> {report['vertices']:,} vertices in {report['seconds']['total']:.1f} s")
    print(f"triangles are stretched {report['stretch']['mean']:.1f} times on average")
    for warning in report["warnings"]:
        print("warning:", warning)

    anisomesh.save(result.surface, folder / "remeshed.ply")
    anisomesh.side_by_side(surface, result.surface, folder / "remeshed.png")
    return result


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None, Path.cwd())
