"""The flat blanks as STEP: what the cutter cuts, as bodies in the plane z = 0."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import accumulate
from pathlib import Path

import numpy as np

from devcad.checks import Check, at_most
from devcad.errors import DevcadError
from devcad.export import Options, Written
from devcad.export._step_blank import blank, flat_area
from devcad.export._step_body import Body
from devcad.export._step_file import read_step, write_step
from devcad.export._step_proof import Proof, prove
from devcad.export._step_shape import shape_of
from devcad.export.outline import approximate
from devcad.export.step import content, step_tolerance
from devcad.flatten.green import bounds
from devcad.flatten.pattern import Pattern
from devcad.geometry.edge import Edge
from devcad.geometry.fit import FLOOR
from devcad.geometry.taylor import Array
from devcad.part import Panel, Part

APART = 10.0  # mm between the boxes of neighbouring blanks
HAIR = 2e-5  # mm


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """Write ``part``-flat.step into the folder and prove it on what reads back.

    A body a panel from its pattern: with thickness a solid from z = 0 up to its front, else a
    plane face in z = 0 whose front looks up. The first lies in pattern coordinates, each further
    one 10 mm to the right of the one before; names and colour as in the part's own STEP file.
    Where the surface twists the name says -approximate, as with the other patterns.

    Returns:
        the file with its largest deviation from the pattern in mm and, for every panel, the checks
        step-deviation, and volume or, without thickness, area.
    Raises:
        GeometryError: a fit is out of reach. CheckFailed: the file does not read back as written
            (step-valid). FileError: not writable.
    """
    tolerance = step_tolerance(part, options)
    plans = blanks(part, tolerance, options.step_degree)
    bodies = [body for body, _ in plans]
    mark = "-approximate" if any(approximate(part, panel) for panel in part.panels) else ""
    path = folder / f"{part.name}{mark}-flat.step"
    shapes = [(body.name, shape_of(body)) for body in bodies]
    write_step(path, part.name, shapes, part.colour, options.step_schema)
    proofs = prove(bodies, read_step(path), max(_diagonal(panel) for panel in part.panels))
    checks: list[Check] = []
    for panel, (body, area), proof in zip(part.panels, plans, proofs, strict=True):
        checks.append(_close(panel, proof, tolerance))
        checks.append(content(body, proof, area, tolerance))
    return [Written(path, "step-flat", max(p.deviation for p in proofs), tuple(checks))]


def blanks(part: Part, tolerance: float, degree: int) -> list[tuple[Body, float]]:
    """The blanks of a part's panels side by side, each with its area in mm2, fitted within
    ``tolerance`` (mm).

    Raises:
        GeometryError: a fit is out of reach.
    """
    return [
        _blank(panel, shift, tolerance, degree)
        for panel, shift in zip(part.panels, shifts(part), strict=True)
    ]


def shifts(part: Part) -> list[float]:
    """How far each panel's blank is moved along x, mm: 0 for the first, and the boxes 10 mm
    apart."""
    boxes = [panel.pattern.bbox for panel in part.panels]
    widths = [box[2] - box[0] + APART for box in boxes[:-1]]
    starts = accumulate(widths, initial=boxes[0][0])
    return [start - box[0] for start, box in zip(starts, boxes, strict=True)]


def _blank(panel: Panel, shift: float, tolerance: float, degree: int) -> tuple[Body, float]:
    """The blank of a panel and its area; failures are told with the panel's name."""
    try:
        area = flat_area(panel.pattern)
        panel = replace(panel, pattern=_holes_kept_off(panel.pattern))
        return blank(panel, area, shift, tolerance, degree), area
    except DevcadError as error:
        raise error.at(panel=panel.name) from None


def _holes_kept_off(pattern: Pattern) -> Pattern:
    """The pattern with each hole that touches the first or last ruling, where a tube was cut open,
    moved off it by a hair: kernels take edges as near for one."""
    rulings = [edge for edge in pattern.outline if edge.name in ("start", "end")]
    holes = list(pattern.holes)
    for ruling in rulings:
        start, end = ruling.curve(ruling.u[[0, -1]])[0]
        along = (end - start) / np.linalg.norm(end - start)
        inward = np.array([-along[1], along[0]])
        turn = np.stack([along, inward])
        for k, hole in enumerate(holes):
            near = bounds(tuple(_carried(edge, turn, -turn @ start) for edge in hole))[1]
            if -HAIR < near < HAIR:
                step = (HAIR - near) * inward
                holes[k] = tuple(_carried(edge, np.eye(2), step) for edge in hole)
    return replace(pattern, holes=tuple(holes))


def _carried(edge: Edge, turn: Array, shift: Array) -> Edge:
    """An edge turned and then moved."""

    def curve(u: Array) -> tuple[Array, Array]:
        points, slopes = edge.curve(u)
        return points @ turn.T + shift, slopes @ turn.T

    return replace(edge, curve=curve)


def _diagonal(panel: Panel) -> float:
    x0, y0, x1, y1 = panel.pattern.bbox
    return math.hypot(x1 - x0, y1 - y0)


def _close(panel: Panel, proof: Proof, tolerance: float) -> Check:
    """That the blank's edges are the pattern's."""
    reach = FLOOR * _diagonal(panel)
    return at_most(
        "step-deviation",
        panel.name,
        proof.deviation,
        tolerance,
        "mm",
        says=f"the flat blank leaves the pattern by {proof.deviation:.3g} mm",
        remedy=f"raise step.tolerance; no fit of this size comes within {reach:.2g} mm",
    )
