"""The command info: what a mesh file has."""
