"""Remesh a part with everything that it carries: the regions of its faces, data, and texture coordinates.

The part is a plate whose top has a load region, with a straight border in the middle of a flat face, a temperature at
its points, and texture coordinates at the corners of its faces, one chart for each side.
"""

import numpy as np

import anisomesh
from anisomesh.shapes.analytic import box


def carried(surface: anisomesh.Surface) -> anisomesh.Mesh:
    """Return a plate with regions, a temperature and texture coordinates."""
    corners = surface.points[surface.faces]
    middle = corners.mean(axis=1)
    side = np.abs(surface.face_normals).argmax(axis=1) + 3 * (surface.face_normals.sum(axis=1) > 0)
    labels = np.where((side == 5) & (middle[:, 0] > 1.0), 6, side)
    axes = np.array([[1, 2], [0, 2], [0, 1]])[side % 3]
    along = np.take_along_axis(corners, axes[:, None].repeat(3, axis=1), axis=2)
    uv = np.stack([(side[:, None] + 0.4 * along[..., 0]) / 6.0, along[..., 1]], axis=2)
    return anisomesh.Mesh(
        surface=surface,
        point_data={"temperature": 20.0 + surface.points @ [1.0, 2.0, 3.0]},
        corner_data={"uv": uv},
        regions={"group": anisomesh.Regions(labels, {6: "load"})},
    )


def main(n_vertices: int = 300) -> anisomesh.RemeshResult:
    given = carried(box((2.0, 1.0, 0.2), n=8))
    result = anisomesh.remesh(given, n_vertices=n_vertices)
    mesh = result.mesh
    load = mesh.regions["group"].labels == 6
    error = np.abs(mesh.point_data["temperature"] - (20.0 + mesh.surface.points @ [1.0, 2.0, 3.0])).max()
    uv = np.abs(mesh.corner_data["uv"] - carried(mesh.surface).corner_data["uv"]).max()
    print(f"load region: {load.sum()} faces, area {mesh.surface.face_areas[load].sum():.6f} (1 before)")
    print(f"temperature: off by {error:.0e} at most; texture coordinates: by {uv:.0e}")
    return result


if __name__ == "__main__":
    main()
