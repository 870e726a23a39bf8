"""From the restricted Voronoi diagram to a triangle mesh: dual, topology control, vertex placement."""
