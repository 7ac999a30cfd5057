"""STEP: exact faces where they exist, fitted ruled faces elsewhere, solids and sheet bodies.

Planes, circular cylinders and right circular cones become what they are, with lines and circles;
every other smooth patch becomes B-spline faces, straight along their rulings: the surface itself
where its edges are polynomials or, without thickness, arcs of conics, else a fit. All is measured
again on the file as a fresh reader sees it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from devcad.checks import Check, at_most
from devcad.errors import DevcadError
from devcad.export import Options, Written
from devcad.export._step_body import Body
from devcad.export._step_file import read_step, write_step
from devcad.export._step_plan import body
from devcad.export._step_proof import Proof, prove
from devcad.export._step_shape import shape_of
from devcad.export._step_strips import panel_size
from devcad.geometry.fit import FLOOR, TWIST_LIMIT
from devcad.part import Panel, Part

SHARE = 0.1  # of the job's tolerance
TOLERANCE = 1e-4  # mm, at most, unless the recipe says otherwise
VOLUME_LIMIT = 1e-5  # relative


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """Write ``part``.step into the folder and prove it on what reads back.

    One file in mm: a solid a panel with thickness, else a sheet body whose front is +n; several
    panels under one assembly named after the job. Equal input gives equal bytes.

    Returns:
        the file with its largest deviation in mm (0 where all faces and edges are exact) and, for
        every panel, the checks step-deviation, step-twist and, for a solid, volume.
    Raises:
        GeometryError: a fit is out of reach, or the panel's thickness has no closed form there.
        CheckFailed: the file does not read back as written (step-valid). FileError: not writable.
    """
    tolerance = options.step_tolerance or min(SHARE * part.tolerance, TOLERANCE)
    size = max(panel_size(p) for p in part.panels)
    bodies = [_body(p, tolerance, options.step_degree) for p in part.panels]
    path = folder / f"{part.name}.step"
    shapes = [(b.name, shape_of(b)) for b in bodies]
    write_step(path, part.name, shapes, part.colour, options.step_schema)
    proofs = prove(bodies, read_step(path), size)
    checks: list[Check] = []
    for panel, plan, proof in zip(part.panels, bodies, proofs, strict=True):
        checks += _checks(panel, plan, proof, tolerance)
    return [Written(path, "step", max(p.deviation for p in proofs), tuple(checks))]


def _body(panel: Panel, tolerance: float, degree: int) -> Body:
    """The body of a panel; failures are told with the panel's name."""
    try:
        return body(panel, tolerance, degree)
    except DevcadError as error:
        raise error.at(panel=panel.name) from None


def _checks(panel: Panel, plan: Body, proof: Proof, tolerance: float) -> list[Check]:
    """What is stated about one body."""
    reach = FLOOR * panel_size(panel)
    checks = [
        at_most(
            "step-deviation",
            panel.name,
            proof.deviation,
            tolerance,
            "mm",
            says=f"the STEP faces leave the true surface by {proof.deviation:.3g} mm",
            remedy=f"raise step.tolerance; no fit of this size comes within {reach:.2g} mm",
        ),
        at_most(
            "step-twist",
            panel.name,
            float(np.degrees(proof.twist)),
            float(np.degrees(TWIST_LIMIT)),
            "deg",
            says=f"the STEP faces twist by {np.degrees(proof.twist):.3g} deg along a ruling",
            remedy="lower step.tolerance",
        ),
    ]
    if plan.solid:
        share = abs(proof.volume / plan.volume - 1.0)
        checks.append(
            at_most(
                "volume",
                panel.name,
                share,
                VOLUME_LIMIT,
                "relative",
                says=f"the STEP solid's volume is off area x thickness by {share:.3g}",
                remedy="lower step.tolerance, or reduce the thickness",
            )
        )
    return checks
