"""build123d objects from parts and patterns, and patches and patterns from build123d faces.

build123d takes seconds to load; it does so when the first object for it is made, and not for
reading faces, which may just as well be the kernel's own (``TopoDS_Face``).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from devcad.errors import GeometryError, JobError
from devcad.export import Options, Written, writer
from devcad.flatten.joining import unrolled
from devcad.flatten.pattern import Pattern
from devcad.flatten.sheetlines import creases
from devcad.geometry.chain import Chain
from devcad.geometry.patch import Patch
from devcad.mesh.mesh import Mesh
from devcad.part import Panel, Part

GAP = 1e-3  # mm
"""Neighbouring edges of a face's border that are less apart are taken to meet."""
DRAWINGS = ("dxf", "svg")


def to_build123d(part: Part, *, tolerance: float | None = None, degree: int = 5) -> Any:
    """The part as a build123d Compound named after it, a child a panel with its name and colour.

    A panel is a Solid with thickness (with curved creases one for every flank); else a Face where
    one face is all of it, or a Shell, its front outside. Faces and edges are those of the STEP
    file: exact where CAD has them, splines straight along the rulings elsewhere.

    Args:
        tolerance: the largest distance of fitted faces in mm; default as for STEP.
        degree: of fitted faces, 5 or 3.
    Raises:
        GeometryError: a fit is out of reach, or the panel's thickness has no closed form there.
    """
    from devcad.export.step import bodies, step_tolerance

    wanted = step_tolerance(part, Options()) if tolerance is None else tolerance
    return _compound(part, bodies(part, wanted, degree)[0])


def flat_to_build123d(part: Part, *, tolerance: float | None = None, degree: int = 5) -> Any:
    """The part's flat patterns as a build123d Compound: a child a panel with its name and colour.

    Each lies with its front up, a Face in z = 0, or a Solid from z = 0 with the part's thickness;
    the first in pattern coordinates, each further one 10 mm to the right of the one before.
    Arguments and errors as for :func:`to_build123d`.
    """
    from devcad.export.step import step_tolerance
    from devcad.export.stepflat import blanks

    wanted = step_tolerance(part, Options()) if tolerance is None else tolerance
    return _compound(part, [body for body, _ in blanks(part, wanted, degree)])


def _compound(part: Part, bodies: Sequence[Any]) -> Any:
    """Bodies of the STEP export as children of a compound."""
    from build123d import Color, Compound, Shape

    from devcad.export._step_shape import shape_of

    children = []
    for body in bodies:
        shape = Shape.cast(shape_of(body))
        faces = shape.faces()
        if not body.solid and len(faces) == 1:
            shape = faces[0]
        shape.label, shape.color = body.name, Color(*part.colour)
        children.append(shape)
    return Compound(label=part.name, children=children)


def from_build123d(face: Any) -> Patch:
    """The patch that covers a build123d Face or a TopoDS_Face, +n where the face looks to.

    The face lies on a plane, a circular cylinder or cone, an extrusion, a straight line turned
    about an axis, a B-spline or Bezier surface whose lines along one parameter are straight, or
    a parallel of these. The patch covers its border: v from 0, the face's holes filled.

    Raises:
        GeometryError: another kind of surface, one that twists by more than 0.01 degree along a
            straight line or is crossed by its regression curve, or a crease within the face.
        JobError: not one face.
    """
    from devcad.importers.face import sheets

    found = sheets(_wrapped(face))
    if len(found) != 1:
        raise JobError(
            f"one face makes a patch, here are {len(found)}",
            value=len(found),
            limit=1,
            remedy="take one of its faces()",
        )
    patch = found[0].patch
    at, angle = creases(patch)
    if at.size:
        degrees = float(np.degrees(np.abs(angle).max()))
        raise GeometryError(
            f"the face has a crease of {degrees:.4g} deg at its parameter {at[0]:.6g}",
            value=degrees,
            limit=0.01,
            remedy="split it there, or take its pattern alone with unroll",
        )
    return patch


def unroll(face: Any, *, tolerance: float = GAP) -> Pattern:
    """The exact pattern of a build123d Face or a TopoDS_Face, its front up, with its holes.

    For the kinds of surface see :func:`from_build123d`. The first straight line is +x, seen with
    the outward normal towards the viewer. A whole cylinder or cone opens at its seam. Several
    faces (a Shell, or a list) are laid side by side where they share straight edges: one pattern,
    open where a ring comes back to its first face; where they meet under an angle stands a bend.

    Args:
        tolerance: the largest gap in mm between neighbouring edges of a border that is closed.
    Returns:
        the pattern: ``area`` is the net area in mm2 (the surface's own, checked to 1e-9),
        ``outline`` counterclockwise, ``holes`` clockwise, every edge callable.
    Raises:
        GeometryError: as for :func:`from_build123d`, or the border is open by more than the
            tolerance, or the faces do not hang together, or their pattern covers itself.
    """
    from devcad.importers.face import sheets

    return unrolled(sheets(_wrapped(face)), tolerance)


def _wrapped(face: Any) -> Any:
    """The kernel's shape in a build123d object, or those in a list of them."""
    if isinstance(face, (list, tuple)):
        return [getattr(each, "wrapped", each) for each in face]
    return getattr(face, "wrapped", face)


def export_pattern(
    pattern: Pattern,
    path: str | Path,
    *,
    tolerance: float = 0.05,
    options: Options | None = None,
) -> Written:
    """Write a pattern to a .dxf or .svg file, read it back and prove it, as an export of a part.

    Args:
        tolerance: ten times the largest distance in mm of the drawing from the pattern.
        options: the recipe's keys for DXF; R12 files get -mm at the end of their name.
    Raises:
        JobError: another suffix. CheckFailed, FileError: as for an export.
    """
    path = Path(path)
    format = path.suffix.removeprefix(".").lower()
    if format not in DRAWINGS:
        raise JobError(
            f"a pattern cannot be written to {path.name!r}",
            value=path.suffix,
            limit=", ".join(DRAWINGS),
            remedy="end its name in .dxf or .svg",
        )
    carrier = Part(path.stem, (_panel(path.stem, pattern),), 0.0, tolerance, ())
    (written,) = writer(format)(carrier, path.parent, options or Options())
    return written


def _panel(name: str, pattern: Pattern) -> Panel:
    """A panel of which only the pattern is known: enough for a drawing."""
    none = np.zeros((0, 3))
    corners = none.astype(np.int32)
    mesh = Mesh(none, none, none[:, :2], corners, corners[:, 0], False, 0.0)
    return Panel(name, "face", Chain(()), (), 0.0, (), mesh, pattern)
