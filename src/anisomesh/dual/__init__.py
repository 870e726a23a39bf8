"""From the Voronoi diagram to a triangle mesh: cell components, dual triangles, defects, refinement."""
