"""What a mesh carries besides its geometry, and its transfer to another mesh of the same surface."""
