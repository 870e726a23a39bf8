"""Centroidal Voronoi tessellation of the embedded surface: sites, their diagram, its energy, its minimum."""
