"""The Voronoi diagram in d dimensions, restricted to an embedded surface, and its cells."""
