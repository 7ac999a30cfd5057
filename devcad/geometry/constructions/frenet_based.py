"""What the kinds made of a curve's Frenet frame share: no inflection, one ruling at every break."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from devcad.errors import GeometryError
from devcad.geometry import taylor
from devcad.geometry.constructions.base import (
    Built,
    Extent,
    Rays,
    one_panel,
    smooth,
    square,
    strip,
    velocity,
)
from devcad.geometry.constructions.sampling import VANISHES, grid, lowest
from devcad.geometry.curve import COINCIDENT, Curve, size
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

SAME_RULING = 1e-9
"""Two unit rulings on the two sides of a break that differ by less are one."""
SAME_COURSE = 1e-6
"""Two unit vectors along the rails on the two sides of a break that differ by less are one: beyond
the rounding of a high derivative, and no fit within 1e-6 of the size sees the rest."""

THROUGH_INFLECTIONS = "use another kind: line-of-curvature works through inflections"

Rulings = Callable[[Array, Array], tuple[Array, Array]]
"""Parameters t (n,) and the curve's series there to the series of c0 and e."""


def frenet_surface(
    kind: str,
    curve: Curve,
    rulings: Rulings,
    extent: Extent,
    *,
    depth: int,
    instead: str = "",
    require: Callable[[Curve], None] | None = None,
) -> Built:
    """The surface whose c0 and e follow from the derivatives of a curve without inflections.

    Args:
        rulings: gives c0 and e to order K at least from the curve's series of order K + depth.
        depth: the highest derivative of the curve that c0 and e need.
        instead: what the remedy against an inflection tells, apart from splitting the curve.
        require: the kind's own demand on the curve, which has no corner and no inflection there.
    Raises:
        GeometryError: the curve stands still, has a corner or an inflection, or a derivative
            jumps so that the ruling does.
    """
    piece = smooth(curve, "curve", order=depth + 2)  # the bending takes two derivatives more
    require_bent(kind, piece, instead)
    if require is not None:
        require(piece)

    def rays(t: Array, order: int) -> tuple[Array, Array, None]:
        c0, e = rulings(t, piece.jet(t, order + depth))  # one of the two may be longer
        return c0[: order + 1], e[: order + 1], None

    _require_one_ruling(kind, piece, rays, depth)
    whole = strip(piece, rays, extent)
    return one_panel(_joined(kind, piece, whole, rays, extent), curve.closed)


def require_bent(kind: str, piece: Curve, instead: str) -> None:
    """Raise a GeometryError where the curvature vanishes: N and B change sides there."""

    def bending(t: Array, order: int) -> Array:
        """k^2 by the series of r' and r''."""
        first = velocity(piece, t, order + 1)
        second = taylor.derivative(first)
        first = first[: order + 1]
        return taylor.div(square(taylor.cross(first, second)), taylor.power(square(first), 3.0))

    t = grid(piece)
    at, least = lowest(bending, piece)
    extent = float(np.ptp(piece.jet(t, 0)[0], axis=0).max())
    scale = max(float(bending(t, 0)[0].max()), extent**-2)
    if least > VANISHES**2 * scale:
        return
    low, high = piece.domain
    inside = min(at - low, high - at) > VANISHES * (high - low)
    part = "split the curve there" if inside else "end the curve before that point"
    raise GeometryError(
        f"{kind}: the curve has an inflection (curvature 0) at t = {at:.6g}",
        value=float(np.sqrt(max(least, 0.0))),
        limit=VANISHES * float(np.sqrt(scale)),
        remedy=part + (f", or {instead}" if instead else ""),
    )


def _require_one_ruling(kind: str, piece: Curve, rays: Rays, depth: int) -> None:
    """Raise a GeometryError at a break where the ruling jumps with a derivative of the curve."""
    if not piece.breaks:
        return
    after = np.array(piece.breaks)
    before = np.nextafter(after, piece.domain[0])
    points = np.concatenate([rays(grid(piece), 0)[0][0], piece.point(grid(piece))])
    (c0, e, _), (c1, f, _) = rays(before, 0), rays(after, 0)
    turn = np.linalg.norm(f[0] - e[0], axis=1)
    shift = np.linalg.norm(c1[0] - c0[0], axis=1)
    jump = np.maximum(turn / SAME_RULING, shift / (COINCIDENT * size(points)))
    worst = int(np.argmax(jump))
    if jump[worst] <= 1.0:
        return
    turns = turn[worst] > SAME_RULING
    raise GeometryError(
        f"{kind}: a derivative of the curve up to the {ORDINAL[depth]} jumps at "
        f"t = {after[worst]:.6g}, so the ruling "
        + (f"turns there by {np.degrees(turn[worst]):.3g} deg" if turns else "shifts there"),
        value=float(turn[worst] if turns else shift[worst]),
        limit=SAME_RULING if turns else COINCIDENT * size(points),
        remedy=f"give the curve a continuous {ORDINAL[depth]} derivative: degree = 5 for points",
    )


ORDINAL = {2: "second", 3: "third", 4: "fourth", 5: "fifth"}


def _joined(kind: str, piece: Curve, whole: Patch, rays: Rays, extent: Extent) -> tuple[Patch, ...]:
    """The surface as patches, joined where its rails are not smooth at a break.

    There the rulings on the two sides are one, but what crosses them changes its direction, or its
    speed at one end more than at the other: no smooth strip has such an inside.
    """
    if not piece.breaks:
        return (whole,)
    bends = rails_bend(whole)
    if not bends.any():
        return (whole,)
    patches = tuple(strip(side, of, extent) for side, of in sides(piece, rays, bends))
    for left, right in pairwise(patches):
        _require_one_front(kind, left, right)
    return patches


def rails_bend(whole: Patch) -> npt.NDArray[np.bool_]:
    """At which breaks of a patch its rails are not smooth, (number of breaks,)."""
    after = np.array(whole.breaks)
    before, behind = (_course(whole, t) for t in (np.nextafter(after, whole.domain[0]), after))
    return np.asarray(np.linalg.norm(behind - before, axis=1) > SAME_COURSE)


def sides(piece: Curve, rays: Rays, bends: npt.NDArray[np.bool_]) -> list[tuple[Curve, Rays]]:
    """The curve cut at those of its breaks that bend, and the rulings over each side of them."""
    after = np.array(piece.breaks)
    corners = tuple(after[bends].tolist())
    smooth_breaks = tuple(after[~bends].tolist())

    def of(side: Curve) -> Rays:
        def one_sided(t: Array, order: int) -> tuple[Array, Array, Array | None]:
            return rays(np.clip(t, side.domain[0], _last(side, piece)), order)

        return one_sided

    parts = replace(piece, breaks=smooth_breaks, corners=corners).pieces()
    return [(side, of(side)) for side in parts]


def _require_one_front(kind: str, before: Patch, after: Patch) -> None:
    """Raise a GeometryError where the sheet is folded back on itself between two patches."""
    front, back = before.frame([before.domain[1]]).n[0], after.frame([after.domain[0]]).n[0]
    if float(front @ back) > 0.0:
        return
    at = after.domain[0]
    raise GeometryError(
        f"{kind}: the regression curve jumps across the extent at t = {at:.6g}, where the third "
        "derivative of the curve jumps: the surface folds back there",
        value=at,
        remedy="give the curve a continuous third derivative: degree = 5 for points",
    )


def _last(side: Curve, whole: Curve) -> float:
    """The last parameter at which the series of the whole curve is that of its side."""
    end = side.domain[1]
    return end if end == whole.domain[1] else float(np.nextafter(end, side.domain[0]))


def _course(patch: Patch, t: Array) -> Array:
    """The velocities of both rails at t in one unit vector (n, 6)."""
    jet = patch.jet(t, 1)
    both = np.concatenate([jet.rail(jet.v_from)[1], jet.rail(jet.v_to)[1]], axis=1)
    length = np.linalg.norm(both, axis=1)[:, None]
    return np.asarray(both / np.where(length > 0.0, length, 1.0))
