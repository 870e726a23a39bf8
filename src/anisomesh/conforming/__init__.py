"""Boundaries of a mesh that are given the same vertices."""
