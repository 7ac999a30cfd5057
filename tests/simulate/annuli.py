"""A folded annulus put together by hand from two cones, and how round a line of points is.

Flat, the crease has the radius 100; folded by 2 alpha it has 100 cos(alpha), and the sides are
cones whose rulings rise by alpha on both sides (Fuchs and Tabachnikov, More on paperfolding).
"""

from __future__ import annotations

import math
import os
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

import devcad
from devcad.part import Fold, Panel

RADIUS, WIDTH, SWEEP = 100.0, 20.0, 90.0


def cone(alpha: float, side: int) -> Panel:
    """One side of the crease: right (1) or left (-1), rising towards +z away from it."""
    c, s = math.cos(alpha), side * math.sin(alpha)
    extent = [0.0, WIDTH] if side > 0 else [-WIDTH, 0.0]
    text = (
        f'name = "side"\n[surface]\nkind = "ruled"\nextent = {extent}\n'
        f'direction = ["{c!r}*cos(t)", "{c!r}*sin(t)", "{s!r}"]\n'
        f'[surface.curve]\nkind = "circle"\nradius = {RADIUS * c!r}\nsweep = {SWEEP / c!r}\n'
    )
    return panel_of(text)


@cache
def strip() -> Panel:
    """A flat strip, 20 wide, 120 long from its start to its end."""
    return panel_of('name = "strip"\n[surface]\nkind = "plane"\nwidth = 20\nheight = 120\n')


def panel_of(text: str) -> Panel:
    """The only panel of a job."""
    handle, path = tempfile.mkstemp(suffix=".toml")
    os.close(handle)
    try:
        Path(path).write_text(text)
        return devcad.build(path).panels[0]
    finally:
        Path(path).unlink()


@cache
def annulus(alpha: float) -> Panel:
    """The folded sheet: its right flank first, the left one hanging on its base."""
    right, left = cone(alpha, 1), cone(alpha, -1)
    left = replace(left, rulings=right.rulings)
    return replace(right, name="annulus", flanks=(right, left), folds=(Fold(0, 1, "base"),))


def radius_of(points: np.ndarray) -> float:
    """The radius of the circle in the plane of best fit that the points are nearest to."""
    away = points - points.mean(axis=0)
    flat = away @ np.linalg.svd(away)[2][:2].T
    rows = np.column_stack([2.0 * flat, np.ones(len(flat))])
    x, y, rest = np.linalg.lstsq(rows, (flat**2).sum(axis=1), rcond=None)[0]
    return float(np.sqrt(rest + x * x + y * y))
