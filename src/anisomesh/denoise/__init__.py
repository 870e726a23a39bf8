"""Removal of noise by filters, without a network."""
