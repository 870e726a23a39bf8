"""Words by which results show themselves in shells and notebooks."""

from __future__ import annotations

from anisomesh.mesh.validity import Validity


def faults(validity: Validity) -> list[str]:
    """Return what is wrong with a remesh, such as ``"3 inverted triangles"``; nothing if it is valid.

    Its topology is wrong where it differs from the topology of the input; non-manifold edges and points are wrong where
    the input has none. Intersections that the input has too are not counted.
    """
    topology = (
        ("boundary loops", validity.boundary_loops, validity.boundary_loops_input),
        ("components", validity.components, validity.components_input),
        ("Euler characteristic", validity.euler, validity.euler_input),
    )
    defects = (
        ("duplicate triangle", validity.duplicate_faces),
        ("non-manifold edge", 0 if validity.nonmanifold_edges_input else validity.nonmanifold_edges),
        ("non-manifold point", 0 if validity.nonmanifold_edges_input else validity.nonmanifold_vertices),
        ("flat triangle", validity.flat),
        ("inverted triangle", validity.inverted),
        ("intersecting pair", validity.new_intersections),
    )
    return [
        *(f"{name} {count} instead of {expected}" for name, count, expected in topology if count != expected),
        *([] if validity.oriented else ["not oriented"]),
        *(f"{count:,} {name}{'s' if count > 1 else ''}" for name, count in defects if count),
    ]


def soundness(validity: Validity) -> str:
    """Return the faults of a remesh in one line, or ``"valid"``."""
    return ", ".join(faults(validity)) or "valid"
