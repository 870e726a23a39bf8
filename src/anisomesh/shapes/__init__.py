"""Procedural shapes: analytic surfaces, CAD parts, lofts, implicit surfaces."""
