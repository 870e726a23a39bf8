"""Local operations on a mesh that stands for a reference surface: collapse, flip, split, removal of inverted and intersecting triangles."""
