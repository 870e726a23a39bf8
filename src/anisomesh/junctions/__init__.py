"""Non-manifold junctions: cut into sheets before a remesh, and joined again after it."""
