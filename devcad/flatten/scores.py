"""Curved creases in the pattern: how the sheet folds along them, in numbers."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from devcad.flatten.development import Development
from devcad.geometry.classify import panels
from devcad.geometry.creasing import Crease, heading
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

COLUMNS = ("t", "s", "x", "y", "fold_deg", "left_ruling_deg", "right_ruling_deg")
"""What is told of a place on a crease."""
TOLD = 33
"""Places along a crease at which the report tells its fold angle."""
PIECES = 64
"""Steps of a panel of the patch."""
GAUSS = 12
"""Nodes of the quadrature of a crease's length between two of them."""


def told(
    along: Sequence[Crease], developments: Sequence[Development]
) -> tuple[dict[str, float], ...]:
    """The fold angle along a crease, at even steps of its length.

    Every row has its parameter t, the length s up to there in mm, the place x, y in the pattern,
    the angle fold_deg in degrees, positive towards the front, and left_ruling_deg and
    right_ruling_deg from the crease to the rulings on either side. ``developments`` are those of
    the flank whose base curve the crease is.
    """
    knots = [fine(crease.child) for crease in along]
    steps = [_arcs(c.child, t[:-1], t[1:]) for c, t in zip(along, knots, strict=True)]
    lengths = [np.append(0.0, np.cumsum(step)) for step in steps]
    ends = np.cumsum([0.0, *(float(length[-1]) for length in lengths)])
    wanted = np.linspace(0.0, ends[-1], TOLD)
    patch = np.clip(np.searchsorted(ends, wanted, side="right") - 1, 0, len(along) - 1)
    out: list[dict[str, float]] = []
    for k, (crease, development) in enumerate(zip(along, developments, strict=True)):
        t = np.interp(wanted[patch == k] - ends[k], lengths[k], knots[k])
        j = np.clip(np.searchsorted(knots[k], t, side="right") - 1, 0, len(knots[k]) - 2)
        s = ends[k] + lengths[k][j] + _arcs(crease.child, knots[k][j], t)
        x, y = development.origin(t).T
        low, high = crease.child.domain
        inside = np.clip(t, np.nextafter(low, high), np.nextafter(high, low))
        columns = t, s, x, y, np.degrees(crease.fold_angle(inside)), *_rulings(crease, inside)
        out += [dict(zip(COLUMNS, row, strict=True)) for row in np.column_stack(columns).tolist()]
    return tuple(out)


def _rulings(crease: Crease, t: Array) -> tuple[Array, Array]:
    """The angles in degrees from a crease's tangent to the left and to the right ruling."""
    jet = crease.parent.jet(t, 1)
    v, slope = (jet.v_from if crease.side == "base" else jet.v_to)[:2]
    child = np.degrees(heading(crease.child.frame(t), 0.0 * t))
    parent = np.degrees(heading(crease.parent.frame(t), v, slope))
    left, right = (child, parent) if crease.side == "base" else (parent, child)
    return 180.0 - left, right


def fine(patch: Patch) -> Array:
    """Parameters of a patch, breaks and ends included, between which little happens."""
    pieces = [np.linspace(a, b, PIECES + 1) for a, b in pairwise(panels(patch))]
    return np.unique(np.concatenate(pieces))


def _arcs(patch: Patch, low: Array, high: Array) -> Array:
    """The lengths of the base curve from each of low (n,) to high (n,)."""
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
    half = 0.5 * (high - low)
    t = (low + half)[:, None] + half[:, None] * nodes
    speed = np.linalg.norm(patch.jet(t.ravel(), 1).c0[1], axis=1).reshape(t.shape)
    return np.asarray(half * (speed @ weights))
