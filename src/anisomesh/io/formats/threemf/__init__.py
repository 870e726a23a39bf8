"""The 3MF format."""
