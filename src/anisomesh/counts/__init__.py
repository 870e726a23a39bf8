"""The number of vertices that a distance or a length of edges takes."""
