"""Graphs of meshes and their hierarchies: the input of the networks, without torch."""
