"""What formats can hold of a mesh."""
