"""The motion of mechanisms: a figure (SVG) and a table (CSV), a pair for each mechanism."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from devcad.errors import JobError
from devcad.export import Options, Written
from devcad.export.binary import opened, torn
from devcad.export.csvfile import Cell, write_table
from devcad.export.motionfigure import figure
from devcad.geometry.taylor import Array
from devcad.part import Part
from devcad.simulate.motion import Motion, Track, motion, track

STEPS = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01)
"""Degrees from one row of a table to the next: the first that gives 60 rows."""
ROWS = 60


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """JOB-motion.svg and JOB-motion.csv; of several mechanisms JOB-motion-1.svg, ...

    The table holds the turn of the input, the angles of the links in degrees, the joints in mm in
    the mechanism's own cross-section, and the least and the largest radial distance of its moving
    links from the cylinder. The figure is a picture, not to scale for cutting.

    Raises:
        JobError: a part without a mechanism that moves with one degree of freedom.
        CheckFailed: csv-readback; FileError: the file cannot be written.
    """
    found = [motion(linkage) for linkage in part.linkages]
    moving = [one for one in found if one.drive is not None]
    if not moving:
        why = found[0].notes[0] if found else "this part is none"
        raise JobError(
            f"motion draws mechanisms of one degree of freedom: {why}",
            value="motion",
            remedy='leave motion out of the formats, or use kind = "cylindrical-mechanism" with '
            "four links, or with six, eight, ... that repeat after every second one",
        )
    out = []
    for k, one in enumerate(moving, start=1):
        mark = "-motion" if len(moving) == 1 else f"-motion-{k}"
        out += [
            _picture(part, one, folder / f"{part.name}{mark}.svg"),
            _table(one, folder / f"{part.name}{mark}.csv"),
        ]
    return out


def _picture(part: Part, found: Motion, path: Path) -> Written:
    text = figure(found, part.name).encode("ascii")
    with opened(path, "wb") as stream:
        stream.write(text)
    with opened(path, "rb") as stream:
        read = stream.read()
    if read != text or ElementTree.fromstring(read).tag != "{http://www.w3.org/2000/svg}svg":
        raise torn("svg-readback", path, "it does not hold the figure")
    return Written(path, "motion", 0.0, note="a picture, not for cutting")


def _table(found: Motion, path: Path) -> Written:
    seen = track(found, stations(found))
    header = ["turn_deg", *_angles(found, seen)[0]]
    for k in range(len(found.arcs)):
        header += [f"joint{k}_x", f"joint{k}_y"]
    header += ["radial_least", "radial_largest"]
    values = _angles(found, seen)[1]
    joints = np.stack([seen.joints.real, seen.joints.imag], axis=2).reshape(len(seen.turn), -1)
    columns = np.column_stack([np.degrees(seen.turn), values, joints, seen.low, seen.high])
    rows: list[list[Cell]] = [list(row) for row in (columns + 0.0).tolist()]
    return write_table(path, "motion", header, rows)


def _angles(found: Motion, seen: Track) -> tuple[list[str], Array]:
    """Names and columns of the links' angles in degrees: of a four-bar from its ground line, of a
    ring against the conformal pose."""
    if seen.angles is None or seen.transmission is None:
        names = [f"link{link.name}_deg" for link in found.linkage.links]
        return names, np.degrees(seen.turns)
    columns = np.column_stack([seen.angles[:, [0, 2, 1]], seen.transmission])
    return ["input_deg", "output_deg", "coupler_deg", "transmission_deg"], np.degrees(columns)


def stations(found: Motion) -> Array:
    """Turns of the input (m,) in radians: both ends of what can be shown, the conformal pose, and
    whole steps between them."""
    low, high = (math.degrees(x) for x in found.stretch())
    step = next((s for s in STEPS if (high - low) / s >= ROWS), STEPS[-1])
    inner = np.arange(math.ceil(low / step), math.floor(high / step) + 1) * step
    apart = (inner - low > 1e-3 * step) & (high - inner > 1e-3 * step)
    every = np.concatenate([[low], inner[apart], [0.0], [high]])
    return np.asarray(np.radians(np.unique(every)))
