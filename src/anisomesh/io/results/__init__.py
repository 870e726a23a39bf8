"""Rows and pages of results."""
