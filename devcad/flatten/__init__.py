"""Flattening: the isometric development of patches and its outline as lines and arcs."""
