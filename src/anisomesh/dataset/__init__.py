"""Data sets: meshes of a folder, and shapes made by code, as items that a network can learn from."""
