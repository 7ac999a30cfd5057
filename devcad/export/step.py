"""STEP: exact faces where they exist, fitted ruled faces elsewhere, solids and sheet bodies.

Planes, circular cylinders and right circular cones become what they are, with lines and circles;
every other smooth patch becomes B-spline faces, straight along their rulings: the surface itself
where its edges are polynomials or, without thickness, arcs of conics, else a fit. All is measured
again on the file as a fresh reader sees it.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from devcad.checks import Check, at_most
from devcad.errors import DevcadError, GeometryError
from devcad.export import Options, Written
from devcad.export._step_body import Body
from devcad.export._step_file import read_step, write_step
from devcad.export._step_plan import body
from devcad.export._step_proof import Proof, prove
from devcad.export._step_seams import SEWN, coinciding, shared
from devcad.export._step_shape import shape_of
from devcad.export._step_strips import panel_size
from devcad.geometry.fit import FLOOR, TWIST_LIMIT
from devcad.geometry.layers import drawn
from devcad.part import Panel, Part

SHARE = 0.1  # of the job's tolerance
TOLERANCE = 1e-4  # mm, at most, unless the recipe says otherwise
CONTENT_LIMIT = 1e-5  # relative, of volume and area


def write(part: Part, folder: Path, options: Options) -> list[Written]:
    """Write ``part``.step into the folder and prove it on what reads back.

    One file in mm: a solid a panel with thickness, else a sheet body whose front is +n; several
    panels under one assembly named after the job. A sheet folded along curved creases is one
    sheet body whose faces share the creases as edges; with thickness its flanks are solids for
    themselves, PANEL-1, PANEL-2, ... Equal input gives equal bytes.

    Returns:
        the file with its largest deviation in mm (0 where all faces and edges are exact) and, for
        every panel, the checks step-deviation, step-twist, and volume or, for a sheet, area; for
        every seam of sheets step-seam.
    Raises:
        GeometryError: a fit is out of reach, or the panel's thickness has no closed form there.
        CheckFailed: the file does not read back as written (step-valid). FileError: not writable.
    """
    return [written(part, folder / f"{part.name}.step", "step", options)]


def written(part: Part, path: Path, format: str, options: Options) -> Written:
    """Write the part's bodies to one file of that format and prove it; as :func:`write`."""
    tolerance = step_tolerance(part, options)
    size = max(panel_size(p) for p in part.panels)
    plans, checks = bodies(part, tolerance, options.step_degree)
    shapes = [(b.name, shape_of(b)) for b in plans]
    chains = [one for panel in part.panels for one in panel.chains]
    many = any(p.cuts or p.bends or drawn(p.chain, p.thickness) for p in chains)
    write_step(path, part.name, shapes, part.colour, options.step_schema, sparing=many)
    proofs = prove(plans, read_step(path), size)
    proven = zip(plans, proofs, strict=True)
    for panel in part.panels:
        each = [_checks(one, *next(proven), tolerance) for one in _sheets(panel)]
        worst = [max(same, key=lambda check: check.value) for same in zip(*each, strict=True)]
        checks += [replace(check, panel=panel.name) for check in worst]
    return Written(path, format, max(p.deviation for p in proofs), tuple(checks))


def bodies(part: Part, tolerance: float, degree: int) -> tuple[list[Body], list[Check]]:
    """The bodies of a part's panels, fitted within ``tolerance`` (mm), and for every seam the
    check step-seam; of a thick sheet with curved creases a body for every flank.

    Raises:
        GeometryError: as :func:`write`.
    """
    part = replace(part, panels=tuple(one for panel in part.panels for one in _sheets(panel)))
    seams = coinciding(part)
    meeting = {k for seam in seams for k in seam.panels}
    planned = [_body(p, tolerance, degree, sewn=k in meeting) for k, p in enumerate(part.panels)]
    return shared(planned, seams, tolerance)


def _sheets(panel: Panel) -> tuple[Panel, ...]:
    """What becomes a body: the panel, or the flanks that grooves part in a thick sheet."""
    if not (panel.folds and panel.thickness):
        return (panel,)
    return tuple(
        replace(flank, name=f"{panel.name}-{number}")
        for number, flank in enumerate(panel.flanks, start=1)
    )


def step_tolerance(part: Part, options: Options) -> float:
    """How closely faces and edges are fitted, mm."""
    return options.step_tolerance or min(SHARE * part.tolerance, TOLERANCE)


def _body(panel: Panel, tolerance: float, degree: int, *, sewn: bool = False) -> Body:
    """The body of a panel; failures are told with the panel's name. One that is to be ``sewn`` to
    others is fitted more closely, if it can be."""
    if sewn and tolerance > SEWN:
        with suppress(GeometryError):
            return body(panel, SEWN, degree)
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
    checks.append(content(plan, proof, panel.area, tolerance))
    return checks


def content(plan: Body, proof: Proof, area: float, tolerance: float) -> Check:
    """That a solid has its volume, a sheet body its ``area``: this within 1e-5 at the default
    tolerance and in proportion where a coarser fit is asked for."""
    if plan.solid:
        share, limit = abs(proof.volume / plan.volume - 1.0), CONTENT_LIMIT
        name, of = "volume", "the STEP solid's volume is off area x thickness"
        remedy = "lower step.tolerance, or reduce the thickness"
    else:
        share, limit = abs(proof.area / area - 1.0), CONTENT_LIMIT * max(1.0, tolerance / TOLERANCE)
        name, of, remedy = (
            "area",
            "the STEP sheet's area is off the panel's",
            "lower step.tolerance",
        )
    says = f"{of} by {share:.3g}"
    return at_most(name, plan.name, share, limit, "relative", says=says, remedy=remedy)
