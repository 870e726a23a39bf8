"""Readers and writers of file formats: bytes in, a polygon soup out, and the other way."""
