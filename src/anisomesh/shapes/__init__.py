"""Shapes made by code: analytic surfaces, machine parts, lofts, implicit surfaces."""
