"""What a sheet with thickness cannot be: refused before anything is made of it.

All raise GeometryError with the place, the value, the limit and a remedy.
"""

from __future__ import annotations

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry.chain import Chain
from devcad.geometry.classify import Shape
from devcad.geometry.layers import layer_gaps, layer_width

APART = 1e-6
"""Layers of neighbouring patches miss each other by more than this share of the thickness."""
STEEPEST_MITRE = np.radians(150.0)
"""A crease of a thick sheet beyond this has no sensible mitre (design.md, section 7)."""


def refuse_creases(chain: Chain, shapes: tuple[Shape, ...], distance: float) -> None:
    """Thick creases are mitred between planes up to 150 degrees that are wider than what the
    mitres take off a skin at ``distance``, else refused."""
    around = list(chain.joints) + ([chain.closing] if chain.closing else [])
    for k, joint in enumerate(around):
        if joint.smooth:
            continue
        after = (k + 1) % len(shapes)
        t = float(chain.patches[after].domain[0])
        angle = float(np.degrees(abs(joint.angle)))
        if not shapes[k].type == shapes[after].type == "plane":
            raise GeometryError(
                f"a crease of {angle:.4g} deg at t = {t:.6g} in a sheet with thickness, between "
                "faces that are not plane",
                value=angle,
                remedy="round it with corner_radius or bends.inside_radius, or give the part no "
                "thickness",
            )
        if abs(joint.angle) > STEEPEST_MITRE:
            raise GeometryError(
                f"a crease of {angle:.4g} deg at t = {t:.6g} in a sheet with thickness, "
                "limit 150 deg",
                value=angle,
                limit=150.0,
                remedy="round it with corner_radius",
            )
    for k in range(len(shapes)):
        width, taken, t = layer_width(chain, k, distance)
        if taken >= width:
            raise GeometryError(
                f"the mitres of the creases beside the plane at t = {t:.6g} take {taken:.4g} mm "
                f"off one of its skins, limit {width:.4g} mm, its width there: the skin would be "
                "turned inside out",
                value=taken,
                limit=width,
                remedy="use a thinner sheet, a wider plane between the creases, or round them with "
                "corner_radius"
                if width > 0.0
                else "keep the extent off the place where its rulings meet",
            )


def refuse_layers_apart(chain: Chain, layers: tuple[float, ...]) -> None:
    """The layers of neighbours meet along their ruling, unless one alone ends in an apex there."""
    for number, gap in enumerate(layer_gaps(chain, layers)):
        if gap > APART * (layers[-1] - layers[0]):
            raise GeometryError(
                f"regular: the layers of a thick sheet miss each other by {gap:.3g} mm at the "
                f"joint t = {chain.patches[number].domain[1]:.6g}, where an apex in the middle of "
                "the sheet ends on one side only",
                value=gap,
                limit=0.0,
                remedy="give the part no thickness",
            )


def refuse_thick_apex(shapes: tuple[Shape, ...], apex: tuple[bool, ...]) -> None:
    """A thick sheet ends at an apex only of a plane or a right circular cone, else refused."""
    for shape, reached in zip(shapes, apex, strict=True):
        if reached and shape.type != "plane" and shape.half_angle is None:
            raise GeometryError(
                "regular: the layers of a thick sheet end apart from one another at the apex of "
                "a cone that is not a right circular one",
                remedy="keep the sheet off the apex (a shorter extent, a rounded corner, trim), or "
                "give the part no thickness: the pattern of its middle is the same",
            )
