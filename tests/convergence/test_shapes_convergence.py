"""Area and volume of the procedural shapes approach their closed forms at second order."""

from math import pi

import numpy as np
import pytest
from scipy.special import ellipeinc, ellipkinc

from anisomesh.shapes import analytic as shapes
from anisomesh.shapes import cad_part as cad


def volume(surface):
    a, b, c = (surface.points[surface.faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def ellipsoid_area(a, b, c):
    """Area for a > b > c by incomplete elliptic integrals."""
    phi = np.arccos(c / a)
    k2 = a**2 * (b**2 - c**2) / (b**2 * (a**2 - c**2))
    return (
        2
        * pi
        * (c**2 + a * b / np.sin(phi) * (ellipeinc(phi, k2) * np.sin(phi) ** 2 + ellipkinc(phi, k2) * np.cos(phi) ** 2))
    )


def ring_area(major, width, depth, half_turns):
    """Area of the four twisted sides by a fine midpoint rule over the exact parametrisation."""
    n = 800
    t = 2 * pi * (np.arange(n) + 0.5) / n
    total = 0.0
    for length, offset, shift in ((width, depth / 2, 0.0), (depth, width / 2, pi / 2)):
        s = length * ((np.arange(n) + 0.5) / n - 0.5)
        for sign in (1, -1):
            u, v = np.meshgrid(t, s, indexing="ij")
            angle = half_turns * u / 2 + shift
            x, z = np.cos(angle) * v - np.sin(angle) * sign * offset, np.sin(angle) * v + np.cos(angle) * sign * offset
            rate = half_turns / 2
            # |d_u x d_v| with d_v a unit vector of the section: the part of d_u across it.
            across = -np.sin(angle) * (-rate * z) + np.cos(angle) * rate * x
            total += np.sqrt((major + x) ** 2 + across**2).sum() * (2 * pi / n) * (length / n)
    return total


CASES = {
    "sphere": (shapes.sphere, (1, 2, 3), 4 * pi, 4 * pi / 3),
    "ellipsoid": (
        lambda k: shapes.ellipsoid((1, 0.6, 0.3), k),
        (2, 3, 4),
        ellipsoid_area(1, 0.6, 0.3),
        4 * pi * 0.18 / 3,
    ),
    "torus": (lambda n: shapes.torus(1, 0.4, 2 * n, n), (12, 24, 48), 4 * pi**2 * 0.4, 2 * pi**2 * 0.16),
    "cylinder": (lambda n: shapes.cylinder(0.5, 2, n, 3), (12, 24, 48), 2 * pi + 0.5 * pi, 0.5 * pi),
    "open cylinder": (lambda n: shapes.cylinder(0.5, 2, n, 3, closed=False), (12, 24, 48), 2 * pi, None),
    "ring": (
        lambda n: shapes.twisted_ring(1, (0.7, 0.3), 3, 8 * n, (n, n)),
        (6, 12, 24),
        ring_area(1, 0.7, 0.3, 3),
        0.21 * 2 * pi,
    ),
    "waves": (
        lambda n: shapes.open_patch(lambda x, y: 0.5 * (x * x + y * y), n),
        (8, 16, 32),
        # Integral of sqrt(1 + x^2 + y^2) over the square of half width 1.
        4 * (np.sqrt(3) / 3 + 2 * np.log((1 + np.sqrt(3)) / np.sqrt(2)) * 2 / 3 - pi / 18),
        None,
    ),
}


def order(errors):
    return np.log2(np.abs(errors[:-1]) / np.abs(errors[1:]))


@pytest.mark.parametrize("name", CASES)
def test_area_and_volume_converge_at_second_order(name):
    make, levels, area, exact_volume = CASES[name]
    made = [make(level) for level in levels]
    assert order(np.array([s.area for s in made]) - area).min() > 1.8
    if exact_volume is not None:
        errors = np.array([volume(s) for s in made]) - exact_volume
        assert np.abs(errors[-1]) < 0.02 * exact_volume
        assert order(errors).min() > 1.8


def test_volume_of_the_part_converges():
    # The circles have a multiple of four points, so the order is seen where that multiple doubles exactly.
    errors = np.array([volume(shapes.cad_part(n)) for n in (25, 50, 100)]) - cad.VOLUME
    assert np.abs(errors).max() < 1e-3
    assert order(errors).mean() == pytest.approx(2, abs=0.3)


@pytest.mark.parametrize("extent", [(1, 1, 1), (2, 0.5, 3)])
def test_box_is_exact(extent):
    a, b, c = extent
    made = shapes.box(extent, n=5)
    assert volume(made) == pytest.approx(a * b * c, rel=1e-13)
    assert made.area == pytest.approx(2 * (a * b + b * c + c * a), rel=1e-13)
