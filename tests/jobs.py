"""Small jobs that the tests of what is shown share: each folds in its own way."""

from __future__ import annotations

import os
import tempfile
from functools import cache
from pathlib import Path

import devcad
from devcad.part import Part

JOBS = {
    "arc": 'kind = "cylinder"\nradius = 40\nsweep = 200\nlength = 30',
    "cone": 'kind = "cone"\napex = [0, 0, 50]\n[surface.directrix]\nkind = "circle"\nradius = 30\n',
    "helix": 'kind = "tangent"\nextent = [5, 30]\n'
    '[surface.curve]\nkind = "helix"\nradius = 20\npitch = 40\nturns = 0.6\n',
    "duct": 'kind = "cylinder"\ndirection = [0, 0, 1]\nlength = 50\n[surface.directrix]\n'
    'kind = "polyline"\npoints = [[0, 0, 0], [40, 0, 0], [40, 30, 0], [0, 30, 0]]\nclosed = true\n',
    "drilled": 'kind = "frustum"\nradius = 60\ntop_radius = 30\nheight = 50\nsweep = 150\n'
    '[[cutout]]\nshape = "circle"\ndiameter = 14\nat_surface = [0.4, 0.5]\n'
    '[[cutout]]\nshape = "rectangle"\nwidth = 12\nheight = 6\nat_surface = [0.7, 1.0]\n'
    "notch = true\n",
    "horn": 'kind = "tangent"\nextent = [5, 30]\n[surface.curve]\nkind = "helix"\nradius = 20\n'
    'pitch = 40\nturns = 0.5\n[[cutout]]\nshape = "circle"\ndiameter = 9\n'
    "at_surface = [0.5, 0.5]\n",
}

CREASED = {
    "annulus": 'kind = "curved-fold"\nfold = 60\nextent = [-20, 20]\n'
    'flat_crease = { kind = "circle", radius = 100, sweep = 120 }',
    "packet": 'kind = "curved-fold"\nfold = "-2*asin(sin(35*pi/180)/cos(t))*180/pi"\n'
    'ruling = "90 - t*180/pi"\nright_creases = ["300*(cos(t) - cos(40*pi/180))"]\n'
    'extent = [-10, 12]\n[surface.flat_crease]\nkind = "expression"\n'
    'x = "-150*(cos(t) - cos(40*pi/180))"\ny = "150*sin(t)"\nz = 0\n'
    't = ["-25*pi/180", "25*pi/180"]',
    "stuck": 'kind = "curved-fold"\nfold = "60 + 15*sin(2*t)"\nright_creases = [15]\n'
    'extent = [-15, 15]\nflat_crease = { kind = "circle", radius = 100, sweep = 60 }',
}
"""Sheets with curved creases: one cone beside another, two flaps beside a cylinder, and two
creases that have no motion with fixed rulings."""


@cache
def built(name: str, thickness: float = 0.0, tolerance: float = 0.05, head: str = "") -> Part:
    """The part of a job, with more lines at its ``head``; built once a session, as it cannot
    change."""
    head += f'name = "{name}"\nthickness = {thickness}\ntolerance = {tolerance}\n'
    text = f"{head}[surface]\n{(JOBS | CREASED)[name]}"
    handle, path = tempfile.mkstemp(suffix=".toml")
    os.close(handle)
    try:
        Path(path).write_text(text)
        return devcad.build(path)
    finally:
        Path(path).unlink()
