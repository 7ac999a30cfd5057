"""The bend lines of a blank: where each runs, how far it bends, and when."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from devcad.flatten.bending import Bend, BendLine, Rulings, Sheet, sheet
from devcad.flatten.blank import Blank, flat_chain
from devcad.flatten.neutral import end_radii
from devcad.flatten.pattern import Line
from devcad.geometry.patch import Frame
from devcad.geometry.taylor import Array
from devcad.shop.springback import ELASTIC, loaded_radius


def bend_lines(
    smooth: Sheet,
    made: Sequence[Bend],
    thickness: float,
    inside: float | None,
    flow: float | None,
) -> tuple[BendLine, ...]:
    """The bends of a panel in their order along it: those that are ``made`` for its smooth bending,
    its creases, and its patches that are bends already.

    The order of bending is from the first ruling to the middle of the panel, then from the last
    one back to it: what is bent stays on one side of the tool and the flat rest on the gauge, and
    a tube closes last.

    Args:
        inside: the inside radius of the bends in mm, None where it is that of the smooth part.
        flow: sigma / (E T) in 1/mm where bends are over-bent, else None.
    """
    every = sorted(
        [*((b.patch, b.t, b.angle, 0) for b in made), *_creases(smooth), *_ready(smooth)]
    )
    order = bending_order(len(every))
    out = []
    for k, (patch, t, angle, kind) in enumerate(every):
        at = Rulings(np.array([patch]), np.array([t]))
        jet = smooth.flat.patches[patch].jet([t], 0)
        ends = [jet.c0[0, 0] + v[0, 0] * jet.e[0, 0] for v in (jet.v_from, jet.v_to)]
        datum = smooth.along(at)[0].tolist()
        ready = smooth.middle.patches[patch].inside_radius
        radii = np.full(2, np.inf)
        if kind == 0:
            radii = end_radii(_frame(smooth, patch, t))[:, 0]
        if kind == 0 and inside is not None:
            radii = np.full(2, inside + 0.5 * thickness)
        elif kind == 2 and ready is not None:
            radii = np.full(2, ready + 0.5 * thickness)
        layer = "BEND_UP" if angle > 0.0 else "BEND_DOWN"
        shown = None
        if np.isfinite(radii).all():
            low, high = np.maximum(radii - 0.5 * thickness, 0.0).tolist()
            shown = low, high
        line = Line(layer, ends[0][:2], ends[1][:2], angle, shown, order[k])
        out.append(BendLine(line, (datum[0], datum[1]), over_bent(angle, radii, flow)))
    return tuple(out)


def folds(blank: Blank, thickness: float) -> tuple[BendLine, ...]:
    """The bends of a panel that is rolled between them: creases, and patches that are one bend."""
    flat = flat_chain(blank.middle, [d.series for d in blank.developments], blank.fibres)
    return bend_lines(sheet(blank.middle, flat, blank.developments), (), thickness, None, None)


def bending_order(count: int) -> list[int]:
    """The place of each of ``count`` bends in the order of bending, from 1: the first half from the
    start on, the others from the end back."""
    half = (count + 1) // 2
    return [*range(1, half + 1), *range(count, half, -1)]


def over_bent(angle: float, radii: Array, flow: float | None) -> float:
    """The angle to bend to so that ``angle`` is left: as much more as the radius under load is
    smaller, half way between the middle's ``radii`` (2,); the angle itself where no set is taken
    or nothing is known of the material or the radius."""
    radius = 0.5 * float(radii.sum())
    if flow is None or not np.isfinite(radius) or radius * flow >= ELASTIC:
        return angle
    return angle * radius / float(loaded_radius(np.array([radius]), flow)[0])


def _creases(smooth: Sheet) -> list[tuple[int, float, float, int]]:
    """The creases of the job as patch, t, angle and the kind 1."""
    return [
        (k + 1, smooth.flat.patches[k + 1].domain[0], joint.angle, 1)
        for k, joint in enumerate(smooth.middle.joints)
        if not joint.smooth
    ]


def _ready(smooth: Sheet) -> list[tuple[int, float, float, int]]:
    """The patches that are one bend already, on the ruling in the middle, with the kind 2."""
    return [
        (
            k,
            0.5 * (patch.domain[0] + patch.domain[1]),
            float(smooth.turned[k](np.array(patch.domain[1:]))[0, 0]),
            2,
        )
        for k, patch in enumerate(smooth.middle.patches)
        if patch.inside_radius is not None
    ]


def _frame(smooth: Sheet, patch: int, t: float) -> Frame:
    low, high = smooth.middle.patches[patch].domain
    inside = np.clip(t, np.nextafter(low, high), np.nextafter(high, low))
    return smooth.middle.patches[patch].frame([inside])
