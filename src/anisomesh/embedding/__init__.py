"""Euclidean embeddings in which the distances of a metric are straight lengths."""
