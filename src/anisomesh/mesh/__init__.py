"""Triangle meshes: data, connectivity, geometry, closest points, intersections, subdivision, validity."""
