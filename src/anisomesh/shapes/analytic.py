"""Procedural shapes with vertices on analytic surfaces, in model units; closed ones have outward normals.

Vertices are on the surface up to rounding; area and volume converge to the closed forms with the square of the edge
length, and are exact for the box.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from anisomesh._arrays import Points
from anisomesh.errors import OptionError
from anisomesh.mesh import topology
from anisomesh.mesh.geometry import unit
from anisomesh.mesh.surface import Surface
from anisomesh.shapes import patches
from anisomesh.shapes.cad_part import CadFeatures, cad_features, cad_part

__all__ = [
    "SAMPLES",
    "CadFeatures",
    "box",
    "cad_features",
    "cad_part",
    "cylinder",
    "ellipsoid",
    "open_patch",
    "sample",
    "sphere",
    "torus",
    "trefoil_knot",
    "twisted_ring",
]

DEFAULT_SAMPLE = "part"

_MAX_ICOSAHEDRON_EDGE = 1.2  # between the edge, 1.05, and the diagonals, 1.70, of the icosahedron in the unit sphere


def sphere(subdivisions: int = 3, radius: float = 1.0) -> Surface:
    """Return a subdivided icosahedron of 20 * 4^subdivisions faces; all vertices are on the sphere."""
    golden = 0.5 * (1 + np.sqrt(5))
    corners = [(0.0, s, t * golden) for s in (-1, 1) for t in (-1, 1)]
    points = unit(np.array([np.roll(corner, k) for k in range(3) for corner in corners]))
    # Three points with edges between all of them are a face.
    near = np.linalg.norm(points[:, None] - points[None], axis=2) < _MAX_ICOSAHEDRON_EDGE
    i, j, k = np.nonzero(near[:, :, None] & near[None] & near[:, None])
    faces = np.stack([i, j, k], axis=1)[(i < j) & (j < k)]
    inward = np.linalg.det(points[faces]) < 0
    faces[inward] = faces[inward][:, ::-1]
    for _ in range(subdivisions):
        edges, face_edges = topology.edges_of(faces)
        middles = len(points) + face_edges
        points = np.concatenate([points, unit(points[edges[:, 0]] + points[edges[:, 1]])])
        a, b, c = faces.T
        p, q, r = middles.T
        faces = np.stack([a, r, q, r, b, p, q, p, c, p, q, r], axis=1).reshape(-1, 3)
    return Surface(radius * points, faces)


def ellipsoid(semi_axes: tuple[float, float, float] = (1.0, 0.5, 0.25), subdivisions: int = 4) -> Surface:
    """Return an ellipsoid around the origin, a scaled icosphere; all vertices are on the ellipsoid."""
    ball = sphere(subdivisions)
    return ball.with_points(ball.points * np.asarray(semi_axes))


def torus(major: float = 1.0, minor: float = 0.35, n_major: int = 72, n_minor: int = 24) -> Surface:
    """Return a torus around the z axis with all vertices on it; ``major`` is the radius of the centre circle."""
    _check_minimum(3, n_major=n_major, n_minor=n_minor)
    u, v = np.meshgrid(_angles(n_major), _angles(n_minor), indexing="ij")
    ring = major + minor * np.cos(v)
    points = np.stack([ring * np.cos(u), ring * np.sin(u), minor * np.sin(v)], axis=-1)
    return Surface(points.reshape(-1, 3), patches.grid_faces(n_major, n_minor, wrap_rows=True, wrap_columns=True))


def trefoil_knot(radius: float = 0.3, n_along: int = 300, n_around: int = 20) -> Surface:
    """Return a tube around a trefoil knot, about 6 wide; its sections are regular polygons on exact normal circles.

    Curvature is large around the tube and small along it.
    """
    _check_minimum(3, n_along=n_along, n_around=n_around)
    t, v = _angles(n_along), _angles(n_around)[:, None]

    def centre_line(order: int) -> Points:
        """Return the derivative of this order of (sin t + 2 sin 2t, cos t - 2 cos 2t, -sin 3t)."""
        one, two, three = ((1j * k) ** order * np.exp(1j * k * t) for k in (1, 2, 3))
        return np.stack([one.imag + 2 * two.imag, one.real - 2 * two.real, -three.imag], axis=-1)

    tangent = centre_line(1)
    binormal = unit(np.cross(tangent, centre_line(2)))
    normal = unit(np.cross(binormal, tangent))
    points = centre_line(0)[:, None] + radius * (np.cos(v) * normal[:, None] - np.sin(v) * binormal[:, None])
    return Surface(points.reshape(-1, 3), patches.grid_faces(n_along, n_around, wrap_rows=True, wrap_columns=True))


def cylinder(
    radius: float = 0.4, height: float = 2.0, n_around: int = 36, n_along: int = 28, closed: bool = True
) -> Surface:
    """Return a cylinder around the z axis from z = 0, with planar ends if ``closed``; the wall has its vertices on it.

    The ends have evenly sized triangles, the wall a grid of ``n_around`` times ``n_along`` cells.
    """
    _check_minimum(3, n_around=n_around)
    _check_minimum(1, n_along=n_along)
    circle = patches.circle(radius, n_around)
    levels = height * (np.arange(n_along + 1) / n_along)
    wall = np.concatenate([np.pad(circle, ((0, 0), (0, 1)), constant_values=z) for z in levels])
    parts = [(wall, patches.grid_faces(n_along + 1, n_around, wrap_columns=True)[:, ::-1])]
    if closed:
        flat, faces = patches.disk(radius, n_around)
        parts += [(flat, faces[:, ::-1]), (flat + np.array([0.0, 0.0, height]), faces)]
    points, faces, _ = patches.join_patches(parts)
    return Surface(points, faces)


def box(extent: tuple[float, float, float] = (1.0, 1.0, 1.0), n: int = 8) -> Surface:
    """Return the exact box [0, x] x [0, y] x [0, z]; each side is a grid of n x n cells."""
    _check_minimum(1, n=n)
    ticks = np.arange(n + 1) / n
    u, v = (table.ravel() for table in np.meshgrid(ticks, ticks, indexing="ij"))
    faces = patches.grid_faces(n + 1, n + 1)
    sides = []
    for axis in range(3):
        for level, oriented in ((0.0, faces[:, ::-1]), (1.0, faces)):
            points = np.empty((len(u), 3))
            points[:, axis], points[:, axis - 2], points[:, axis - 1] = level, u, v
            sides.append((points * np.asarray(extent), oriented))
    points, faces, _ = patches.join_patches(sides)
    return Surface(points, faces)


def open_patch(
    height: Callable[[npt.NDArray[np.float64], npt.NDArray[np.float64]], npt.NDArray[np.float64]],
    n: int = 40,
    half_width: float = 1.0,
) -> Surface:
    """Return the graph z = height(x, y) over a square around the origin: n x n cells, all vertices on the graph."""
    _check_minimum(1, n=n)
    ticks = half_width * (2 * np.arange(n + 1) / n - 1)
    x, y = (table.ravel() for table in np.meshgrid(ticks, ticks, indexing="ij"))
    return Surface(np.stack([x, y, height(x, y) + 0 * x], axis=1), patches.grid_faces(n + 1, n + 1))


def twisted_ring(
    major: float = 1.0,
    section: tuple[float, float] = (0.7, 0.3),
    half_turns: int = 3,
    n_major: int = 160,
    n_section: tuple[int, int] = (12, 5),
) -> Surface:
    """Return a twisted ring with a rectangular section and sharp edges; all vertices are on its ruled sides.

    Parameters
    ----------
    major
        Radius of the centre circle around the z axis.
    section
        Side lengths of the rectangle.
    half_turns
        Number of half turns of the section around the ring; an odd number joins opposite edges.
    n_major
        Number of cells along the ring, at least 3.
    n_section
        Number of cells on the sides of the rectangle.

    Notes
    -----
    By Pappus's theorem the volume is the area of the section times 2 pi major, for every twist.
    """
    _check_minimum(3, n_major=n_major)
    (width, depth), (n, m) = section, n_section
    across, along = np.arange(n) / n - 0.5, np.arange(m) / m - 0.5
    half = np.concatenate(
        [np.stack([width * across, 0 * across - depth / 2], 1), np.stack([0 * along + width / 2, depth * along], 1)]
    )
    outline = np.concatenate([half, -half])
    angle = _angles(n_major)[:, None]
    cosine, sine = np.cos(half_turns * angle / 2), np.sin(half_turns * angle / 2)
    x, z = cosine * outline[:, 0] - sine * outline[:, 1], sine * outline[:, 0] + cosine * outline[:, 1]
    points = np.stack([(major + x) * np.cos(angle), (major + x) * np.sin(angle), z], axis=-1).reshape(-1, 3)
    faces = patches.grid_faces(n_major + 1, len(outline), wrap_columns=True)
    # The row after the last is the first row, rotated by half an outline for odd half turns.
    number = np.arange((n_major + 1) * len(outline))
    number[-len(outline) :] = np.roll(np.arange(len(outline)), (half_turns % 2) * (n + m))
    return Surface(points, number[faces])


SAMPLES: dict[str, Callable[[], Surface]] = {
    "ring": twisted_ring,
    "part": lambda: cad_part(16),
    "ellipsoid": ellipsoid,
    "torus": torus,
    "knot": trefoil_knot,
    "cylinder": cylinder,
    "sphere": lambda: sphere(4),
    "waves": lambda: open_patch(lambda x, y: 0.15 * np.sin(6 * x + 2 * y) * np.exp(-(x**2) - y**2), 60),
}
"""Constructors of the named samples."""


def sample(name: str = DEFAULT_SAMPLE) -> Surface:
    """Return a procedural shape by its name in :data:`SAMPLES`; the default is a CAD part.

    Raises
    ------
    OptionError
        If the name is unknown.
    """
    if name not in SAMPLES:
        raise OptionError(f"sample {name!r} is unknown; expected one of {', '.join(SAMPLES)}")
    return SAMPLES[name]()


def _angles(n: int) -> npt.NDArray[np.float64]:
    """Return n angles (n,) over a full turn, from 0."""
    return 2 * np.pi * np.arange(n) / n


def _check_minimum(minimum: int, **counts: int) -> None:
    """Raise OptionError if a count is below the minimum."""
    for name, count in counts.items():
        if count < minimum:
            raise OptionError(f"{name} is {count}; expected at least {minimum}")
