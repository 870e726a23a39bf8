"""The mesh files of Gmsh (MSH)."""
