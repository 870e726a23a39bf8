"""Measures of a remesh: triangle shapes, validity, distances to the input, preserved features."""
