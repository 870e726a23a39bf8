"""Boundaries of a mesh that are found along the ones of its reference, and given the same vertices."""
