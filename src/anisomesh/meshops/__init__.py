"""Local operations on a mesh that approximates a reference surface; its topology never changes."""
