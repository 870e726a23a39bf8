"""Measures of a remesh: shape of the triangles, validity, distance to the input."""
