"""Euclidean embeddings of a surface in which straight lengths are lengths in a metric."""
