"""Mesh objects of PyVista, meshio and trimesh."""
