"""A mesh brought onto its anchors: places of vertices, and edges of its boundary."""
