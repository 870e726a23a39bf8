"""Fields at the points of a mesh, in files: sizes, metrics, solutions."""
