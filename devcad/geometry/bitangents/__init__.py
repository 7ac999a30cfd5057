"""Planes that touch a curve twice, or two curves: all pairs of points, branch by branch."""
