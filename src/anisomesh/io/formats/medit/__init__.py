"""The text files of MEDIT (.mesh)."""
