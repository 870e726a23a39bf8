"""Triangle meshes: data, connectivity, files, repair, subdivision, samples."""
