"""The OBJ files of Wavefront."""
