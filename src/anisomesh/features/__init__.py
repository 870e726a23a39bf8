"""Creases and boundaries: detection, tracing into polylines, selection."""
