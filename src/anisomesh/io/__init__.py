"""Files and other libraries: mesh formats, conversion, export of Voronoi diagrams."""
