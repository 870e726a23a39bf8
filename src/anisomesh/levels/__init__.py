"""Levels of detail: one mesh with several numbers of vertices."""
