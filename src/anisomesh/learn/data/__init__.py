"""Data sets: items, and building them from meshes."""
