"""Meshing: triangles along the rulings, open sheets and watertight solids."""
