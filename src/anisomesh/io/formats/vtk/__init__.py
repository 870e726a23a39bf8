"""The XML files of VTK: unstructured grids (VTU) and polygons (VTP)."""
