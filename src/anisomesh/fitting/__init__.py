"""Meshes fitted to a surface by local changes that lower error and improve triangles together."""
