"""Strips of plane quads between two polylines: what `translational` and `pq-strip` share.

Ruling j of a strip goes from lower[j] along way[j]; quad j lies between the rulings j and
j + 1 and is one patch: a plane with two straight rails. A quad may be a triangle, a fan about a
point of a polyline or a tip at an end of the strip. Source: geometry.md, section 11.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from devcad.errors import GeometryError, LimitError
from devcad.geometry import taylor
from devcad.geometry.constructions.base import Built, BuiltPanel, Figure
from devcad.geometry.constructions.planar import corners, planarity
from devcad.geometry.curve import COINCIDENT, size
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array

CONVEX = 1e-9
"""The sine of a corner that counts as none."""
MAX_QUADS = 5_000
"""Quads of a job: beyond, the checks of so many faces take longer than anyone waits."""
MOVED = (
    "the given quads are plane but for the figure planarity_defect; the points were moved by at "
    "most the figure points_moved_by to make every quad exactly plane"
)
"""What the report says of a net that was made plane."""


@dataclass(frozen=True, slots=True)
class Strip:
    """n quads: the rulings from ``lower`` along ``way``, (n + 1, 3) each, at ``t`` (n + 1,)."""

    lower: Array
    way: Array
    t: Array

    @property
    def upper(self) -> Array:
        """The other ends of the rulings, (n + 1, 3)."""
        return self.lower + self.way


def require_few(quads: int) -> None:
    """Raise a LimitError where there are more quads than MAX_QUADS."""
    if quads > MAX_QUADS:
        raise LimitError(
            f"{quads} quads are too many, limit {MAX_QUADS}",
            value=quads,
            limit=MAX_QUADS,
            remedy="make several jobs of them",
        )


def panels(strips: Sequence[Strip], given: Sequence[Strip] = (), moved: float = 0.0) -> Built:
    """One panel for each strip, with the planarity defect of the strip as it was ``given`` and
    the distance by which its points were ``moved``, if they were.

    Raises:
        GeometryError: a quad has no area, is not convex, or is a triangle in the wrong place.
    """
    reach = size(np.concatenate([np.concatenate([s.lower, s.upper]) for s in strips]))
    defects = [float(planarity(_corners(strip)).max()) for strip in given or strips]
    return Built(
        tuple(
            _panel(number, _snapped(strip, COINCIDENT * reach), defect, moved)
            for number, (strip, defect) in enumerate(zip(strips, defects, strict=True), start=1)
        )
    )


def _panel(number: int, strip: Strip, defect: float, moved: float) -> BuiltPanel:
    _require_sound(number, strip)
    patches = tuple(_quad(strip, j) for j in range(len(strip.t) - 1))
    figures = {"planarity_defect": Figure(defect)}
    if not moved:
        return BuiltPanel(patches, _returns(strip), figures=figures)
    figures["points_moved_by"] = Figure(moved)
    return BuiltPanel(patches, _returns(strip), figures=figures, notes=(MOVED,))


def _snapped(strip: Strip, limit: float) -> Strip:
    """The strip with neighbours that coincide within the limit made equal, so that a triangle
    is exactly one."""
    lower, upper = strip.lower.copy(), strip.upper
    way = strip.way.copy()
    for points in (lower, upper):
        for j in np.flatnonzero(_lengths(np.diff(points, axis=0)) <= limit):
            points[j + 1] = points[j]
    moved = (lower != strip.lower).any(axis=1) | (upper != strip.upper).any(axis=1)
    way[moved] = (upper - lower)[moved]
    way[_lengths(way) <= limit] = 0.0
    return replace(strip, lower=lower, way=way)


def _require_sound(number: int, strip: Strip) -> None:
    """Raise a GeometryError at the first quad that is no convex quad and no triangle that a
    chain of faces can hold."""
    quads = _corners(strip)
    none = _lengths(np.roll(quads, -1, axis=0) - quads) == 0.0  # lower, end, upper, start
    halves = (none[1, :-1].any(), none[3, 1:].any())
    # a side of no length has no direction: only the corners away from it count
    sines = np.where(none | np.roll(none, 1, axis=0), np.inf, _corner_sines(quads))
    bad = (none.sum(axis=0) > 1) | ~(sines.min(axis=0) > CONVEX)
    if bad.any():
        j = int(np.argmax(bad))
        worst = float(sines[:, j].min())
        raise GeometryError(
            f"strip {number}, quad {j + 1} (t = {strip.t[j]:.6g} to {strip.t[j + 1]:.6g}): it is "
            "not convex, or three of its corners lie on one line",
            value=worst if np.isfinite(worst) else 0.0,
            limit=CONVEX,
            remedy="let both polylines run the same way, and let neither rulings nor sides cross",
        )
    if any(halves):
        j = 1 + int(np.argmax(none[1, :-1]))
        raise GeometryError(
            f"strip {number}: its polylines meet at t = {strip.t[j]:.6g}, in its middle, where "
            "nothing holds the two halves together",
            value=float(strip.t[j]),
            remedy="end the strip there and begin another",
        )
    if none[1, -1] and none[3, 0] and _returns(strip):
        raise GeometryError(
            f"strip {number}: it begins and ends in one point",
            value=float(strip.t[-1]),
            remedy="leave out its last quad",
        )


def _corners(strip: Strip) -> Array:
    """The corners (4, n, 3) round each quad."""
    return corners(np.stack([strip.lower, strip.upper]))


def _corner_sines(quads: Array) -> Array:
    """The sine of the angle at each corner, (4, n), seen across the diagonals: positive all
    round on a convex quad; 0 where a side has no length."""
    after = np.roll(quads, -1, axis=0) - quads
    before = np.roll(after, 1, axis=0)
    normal = np.cross(quads[2] - quads[0], quads[3] - quads[1])
    spanned = np.einsum("ijk,jk->ij", np.cross(before, after), normal)
    scale = _lengths(before) * _lengths(after) * _lengths(normal)
    return np.asarray(np.divide(spanned, scale, out=np.zeros_like(scale), where=scale > 0.0))


def _returns(strip: Strip) -> bool:
    """Whether the last ruling joins the ends of the first, straight or crosswise."""
    first = np.stack([strip.lower[0], strip.upper[0]])
    last = np.stack([strip.lower[-1], strip.upper[-1]])
    limit = COINCIDENT * size(np.concatenate([strip.lower, strip.upper]))
    return any(bool(_lengths(first - other).max() <= limit) for other in (last, last[::-1]))


def _quad(strip: Strip, j: int) -> Patch:
    """Quad j as a patch; at a tip the rulings keep the direction of the one that has a length."""
    ends = slice(j, j + 2)
    lower, way, (low, high) = strip.lower[ends], strip.way[ends], strip.t[ends]
    tip = not way.any(axis=1).all()
    steady = way[0] if way[0].any() else way[1]

    def field(t: Array, order: int) -> RulingJet:
        c0 = _between(t, low, high, lower, order)
        ray = _between(t, low, high, way, order)
        if tip:
            e = taylor.unit(taylor.constant_vector(steady, order, t.size))
            length = taylor.dot(ray, e)
        else:
            e, length = taylor.unit(ray), taylor.norm(ray)
        return RulingJet(c0, e, np.zeros_like(length), length)

    return Patch(field, (float(low), float(high)))


def _between(t: Array, low: float, high: float, ends: Array, order: int) -> Array:
    """The series (order + 1, n, 3) of the line from ends[0] to ends[1], both met exactly."""
    share = ((t - low) / (high - low))[:, None]
    step = ends[1] - ends[0]
    out = taylor.constant_vector(0.0, order, t.size)
    out[0] = np.where(share < 0.5, ends[0] + share * step, ends[1] - (1.0 - share) * step)
    if order:
        out[1] = step / (high - low)
    return out


def _lengths(x: Array) -> Array:
    return np.asarray(np.linalg.norm(x, axis=-1))
