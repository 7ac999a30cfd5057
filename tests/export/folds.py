"""Sheets folded along curved creases, as jobs, for the exporters' tests."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import devcad
from devcad.part import Part

RADIUS, ALPHA, SWEEP = 60.0, 30.0, 90.0
"""The crease of the annulus in the pattern in mm, half its fold angle and its sector in degrees."""
REACH = (15.0, 20.0)

JOBS = {
    "annulus": f"flat_crease = {{ kind = 'circle', radius = {RADIUS}, sweep = {SWEEP} }}\n"
    f"fold = {2.0 * ALPHA}\nextent = [-{REACH[0]}, {REACH[1]}]\ngroove = 2\n",
    "ring": "crease = { kind = 'circle', radius = 50 }\nangle = 30\nextent = [-15, 20]\n",
    "wave": "crease = { kind = 'circle', radius = 50, sweep = 100 }\n"
    "angle = '30 + 10*sin(t)'\nextent = [-15, 20]\n",
    "wreath": "crease = { kind = 'circle', radius = 50 }\nangle = '30 + 5*sin(t)'\n"
    "extent = [-8, 10]\n",
    "helix": "crease = { kind = 'helix', radius = 50, pitch = 60, turns = 0.5 }\n"
    "angle = 40\nextent = [-8, 10]\n",
    "parabola": "flat_crease = { kind = 'expression', x = 't', y = 't**2/100', z = '0', "
    "t = [-40, 40] }\nfold = 50\nextent = [-8, 9]\n",
    "pleats": "flat_crease = { kind = 'expression', x = 't', y = 't**2/100', z = '0', "
    "t = [-40, 40] }\nfold = 50\nleft_creases = ['-8']\nright_creases = ['9 + t/50']\n"
    "extent = [-6, 7]\n",
    # on a cylinder of radius 50, whose normal is the angle's: the other side is no exact surface
    "label": "crease = { kind = 'expression', x = '50*cos(t)', y = '50*sin(t)', z = '60*t**2', "
    "t = [-0.5, 0.6] }\nextent = [-7, 9]\n"
    "angle = 'acos(120/sqrt(120**2 + (120*t)**2 + 50**2))*180/pi'\n",
    "vault": "crease = { kind = 'ellipse', radii = [60, 40], sweep = 120 }\n"
    "angle = 'atan(50*sqrt((40*cos(t))**2 + (60*sin(t))**2)/(60*40))*180/pi'\n"
    "extent = ['-0.3*sqrt((60*cos(t))**2 + (40*sin(t))**2 + 50**2)', "
    "'0.3*sqrt((60*cos(t))**2 + (40*sin(t))**2 + 50**2)']\n",
    "bends": "flat_crease = { kind = 'chain', curves = ["
    "{ kind = 'circle', radius = 50, sweep = 40 }, "
    "{ kind = 'circle', radius = 20, center = [22.98133329356934, 19.28362829059618, 0], "
    "start = 40, sweep = 70 }] }\nfold = 60\nextent = [-7, 9]\n",
}

HOLE = 6.0
"""The diameter of the two holes in the drilled annulus, one on either side of its crease, mm."""
JOBS["drilled"] = JOBS["annulus"] + "".join(
    f"[[cutout]]\nshape = 'circle'\ndiameter = {HOLE}\nat = {at}\n" for at in ([12, 20], [-50, 52])
)


@cache
def folded(name: str, thickness: float = 0.0) -> Part:
    """The part of a job; built once a session, as it cannot change."""
    head = f'name = "{name}"\nthickness = {thickness}\n[surface]\nkind = "curved-fold"\n'
    with TemporaryDirectory() as folder:
        job = Path(folder) / f"{name}.toml"
        job.write_text(head + JOBS[name])
        return devcad.build(job)
