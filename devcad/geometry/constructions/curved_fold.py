"""One sheet folded along curved creases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from devcad.errors import GeometryError, JobError
from devcad.geometry import taylor
from devcad.geometry.constructions.base import (
    Built,
    BuiltPanel,
    Extent,
    Flank,
    NonNegative,
    Surface,
    smooth,
    strip,
)
from devcad.geometry.constructions.curved_creases import (
    ALONG,
    KIND,
    Creased,
    FoldAngle,
    by_ruling,
    by_torsion,
    flat_crease,
    folded_beyond,
    require_flat,
    space_crease,
    two_sides,
)
from devcad.geometry.constructions.frenet_based import SAME_RULING, rails_bend, sides
from devcad.geometry.constructions.sampling import grid, lowest, require_finite
from devcad.geometry.curve import Curve, ends_meet
from devcad.geometry.curves import ConstantExpression, CurveSpec, ScalarExpression
from devcad.geometry.flanks import Flanking
from devcad.geometry.jets import Expression, parse
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

NOTHING = parse("0")
COLLIDES = 1e-9
"""The width left at a further crease, against that at the one before, at which rulings collide."""
CLEAR = 0.1
"""The same on a dense sample, from which on it is not looked for the lowest in between."""
TOUCHES = -1e-9
"""The same at an outer edge, which rulings may touch: the check ``regular`` decides."""

MOST = 12
"""Further creases on either side: what a crease costs grows with the square of those before it."""
Creases = Annotated[tuple[ScalarExpression, ...], Field(max_length=MOST)]


class CurvedFold(Surface):
    """One sheet folded along curved creases, the first drawn in the flat or given in space.

    ``crease`` is a curve in space and ``angle`` alpha that from its osculating plane to the
    tangent plane on either side, 0 < |alpha| < 90; or ``flat_crease`` is its line in the pattern
    (z = 0) and ``fold`` = 2 alpha. Above 0 it is a valley, below 0 a mountain. A flat crease
    leaves its torsion open: 0, or ``torsion``, or what gives the right rulings the angle
    ``ruling`` to the crease. All angles are in degrees, numbers or expressions in t.

    Left is the side of N (of a flat crease: its left), the front that of B (towards the viewer of
    the pattern). Rulings point to the right on all chains; v is a length along them. At
    ``right_creases`` (v > 0) and ``left_creases`` (v < 0), each counted from the crease before it,
    the sheet folds again; it ends at ``extent`` = [left, right] beyond the outermost creases.
    ``groove`` is the width that a thick sheet leaves along its creases; ``cut`` the t at which the
    pattern of a closed crease opens.

    Source: geometry.md, section 8. Further creases: the next flank is the last one reflected in
    the osculating plane of the crease between them.
    """

    kind: Literal["curved-fold"]
    crease: CurveSpec | None = None
    angle: ScalarExpression | None = None
    flat_crease: CurveSpec | None = None
    fold: ScalarExpression | None = None
    torsion: ScalarExpression | None = None
    ruling: ScalarExpression | None = None
    extent: Extent
    left_creases: Creases = ()
    right_creases: Creases = ()
    groove: NonNegative | None = None
    cut: ConstantExpression | None = None

    @model_validator(mode="after")
    def _one_way(self) -> CurvedFold:
        given = tuple(
            name
            for name in ("crease", "angle", "flat_crease", "fold")
            if getattr(self, name) is not None
        )
        if given not in (("crease", "angle"), ("flat_crease", "fold")):
            raise JobError(
                f"{KIND} needs crease and angle, or flat_crease and fold; given "
                + ("none of them" if not given else "only " + " and ".join(given))
                if len(given) < 2
                else f"{KIND} takes crease and angle, or flat_crease and fold, not "
                + ", ".join(given),
                value=", ".join(given),
                remedy="angle is measured in space from the osculating plane, fold = 2 angle "
                "belongs to the crease in the flat",
            )
        winding = [name for name in ("torsion", "ruling") if getattr(self, name) is not None]
        if winding and (len(winding) == 2 or self.crease is not None):
            raise JobError(
                f"{' and '.join(winding)}: "
                + (
                    "a crease in space has its own torsion"
                    if self.crease is not None
                    else "one of the two follows from the other"
                ),
                value=", ".join(winding),
                remedy="leave it out, or give the crease in the flat: flat_crease and fold"
                if self.crease is not None
                else "leave one out",
            )
        return self

    def build(self) -> Built:
        """One panel: the chain right of the first crease, and a flank for every other strip.

        Raises:
            JobError: an angle, a distance or the extent is outside its domain.
            GeometryError: the crease has a corner or, in space, an inflection; rulings run along
                it, jump, or meet within the sheet; a further crease does not fold.
        """
        piece, alpha, crease = self._first()
        strips = self._strips(piece, *two_sides(crease, alpha, piece, self.ruling))
        for each in strips:
            each.require_sound(piece)
        chains = _chains(piece, strips)
        space = Curve(lambda t, order: crease(t, order).point, piece.domain, piece.breaks)
        closes = ends_meet(space)
        if piece.closed and not closes:
            raise _open_in_space(space)
        flanks = tuple(
            Flank(chain, each.parent, each.side)
            for chain, each in zip(chains[1:], strips[1:], strict=True)
        )
        return Built((BuiltPanel(chains[0], closes, flanks=flanks),))

    def _first(self) -> tuple[Curve, FoldAngle, Creased]:
        """The curve as given, its fold angle, and the crease in space."""
        if self.crease is not None and self.angle is not None:
            piece = smooth(self.crease.curve(), "crease", order=5)
            alpha = FoldAngle("angle", self.angle, 1.0)
            alpha.require_folded(piece)
            return piece, alpha, space_crease(piece)
        assert self.flat_crease is not None
        assert self.fold is not None
        piece = smooth(self.flat_crease.curve(), "flat_crease", order=4)
        require_flat(piece)
        alpha = FoldAngle("fold", self.fold, 0.5)
        alpha.require_folded(piece)
        t = grid(piece)
        if self.ruling is None:
            torsion = self.torsion or NOTHING
            require_finite(torsion.at(t, 2), t, "torsion")
            return piece, alpha, flat_crease(piece, alpha, by_torsion(torsion))
        angle = self.ruling.at(t, 2)
        require_finite(angle, t, "ruling")
        off = np.minimum(angle[0], 180.0 - angle[0])
        worst = int(np.argmin(off))
        if not off[worst] > np.degrees(ALONG):
            raise JobError(
                f"ruling is {angle[0, worst]:.6g} deg at t = {t[worst]:.6g}: allowed are 0 to 180, "
                "both excluded",
                value=float(angle[0, worst]),
                limit=180.0,
                remedy="it is the angle from the crease's direction to the right ruling",
            )
        return piece, alpha, flat_crease(piece, alpha, by_ruling(self.ruling))

    def _strips(self, piece: Curve, right: Flanking, left: Flanking) -> list[Strip]:
        """The strips of the sheet, the one right of the first crease first, then the left one."""
        low, high = _require_distances(piece, "extent: left", self.extent[0], -1.0), self.extent[1]
        _require_distances(piece, "extent: right", high, 1.0)
        strips = [
            Strip("the right side", right, NOTHING, high, 0, "top"),
            Strip("the left side", left, low, NOTHING, 0, "base"),
        ]
        for distances, turn, key in (
            (self.right_creases, 1.0, "right_creases"),
            (self.left_creases, -1.0, "left_creases"),
        ):
            parent = 0 if turn > 0.0 else 1
            for k, distance in enumerate(distances):
                name = f"{key}[{k}]"
                _require_distances(piece, name, distance, turn)
                strips[parent] = last = strips[parent].up_to(distance, turn, name)
                last.require_clear(piece)
                field = folded_beyond(last.field, distance, piece, turn, name)
                ends = (NOTHING, high) if turn > 0.0 else (low, NOTHING)
                side: Literal["base", "top"] = "top" if turn > 0.0 else "base"
                strips.append(Strip(f"the sheet beyond {name}", field, *ends, parent, side))
                parent = len(strips) - 1
        return strips


@dataclass(frozen=True, slots=True)
class Strip:
    """What lies between two creases, or a crease and an edge: ``low`` <= v <= ``high``, one of
    which is the crease v = 0 of chain number ``parent``. ``crease`` names the other, if it is one.
    """

    name: str
    field: Flanking
    low: Expression
    high: Expression
    parent: int
    side: Literal["base", "top"]
    crease: str = ""

    def up_to(self, distance: Expression, turn: float, crease: str) -> Strip:
        """The strip that ends at a further crease, not at the sheet's edge."""
        low, high = (self.low, distance) if turn > 0.0 else (distance, self.high)
        return Strip(self.name, self.field, low, high, self.parent, self.side, crease)

    def rays(self, t: Array, order: int) -> tuple[Array, Array, None]:
        """Base points and rulings."""
        jet = self.field(t, order)
        return jet.c0, jet.e, None

    def require_sound(self, piece: Curve) -> None:
        """Raise a GeometryError where rulings jump or meet within the strip."""
        self._require_one_ruling(piece)
        if not self.crease:
            self.require_clear(piece)

    def require_clear(self, piece: Curve) -> None:
        """Raise a GeometryError where rulings run along the crease or meet within the strip."""
        far = self.low if self.high is NOTHING else self.high

        def widths(t: Array, order: int) -> tuple[Array, Array]:
            """What a step of t is worth across the rulings: at the crease, and its growth."""
            jet = self.field(t, order + 1)
            across = taylor.cross(jet.n, jet.e)[: order + 1]
            return (
                taylor.dot(taylor.derivative(jet.c0), across),
                taylor.dot(taylor.derivative(jet.e), across),
            )

        def share(t: Array, order: int) -> Array:
            near, growth = widths(t, order)
            return 1.0 + taylor.mul(far.at(t, order), taylor.div(growth, near))

        self._require_across(piece)
        at, least = 0.0, float(share(grid(piece), 0)[0].min())
        if not least > CLEAR:
            at, least = lowest(share, piece)
        if least > (COLLIDES if self.crease else TOUCHES):
            return
        near, growth = (float(x[0, 0]) for x in widths(np.array([at]), 0))
        meet, edge = abs(near / growth), abs(float(far.at([at], 0)[0, 0]))
        where = f"{self.crease} at" if self.crease else "the extent"
        raise GeometryError(
            f"{KIND}: the rulings of {self.name} meet at t = {at:.6g}, {meet:.6g} from the crease, "
            f"{'before ' if self.crease else 'within '}{where} {edge:.6g}",
            value=meet,
            limit=edge,
            remedy=("bring that crease nearer" if self.crease else "make the extent smaller there")
            + ", bend the crease less, or let its fold angle change more slowly",
        )

    def _require_across(self, piece: Curve) -> None:
        """Raise a GeometryError where the rulings run along the crease."""
        t = grid(piece)
        jet = self.field(t, 1)
        along = jet.c0[1] / np.linalg.norm(jet.c0[1], axis=1)[:, None]
        sine = np.linalg.norm(np.cross(along, jet.e[0]), axis=1)
        worst = int(np.argmin(np.where(np.isfinite(sine), sine, -1.0)))
        if sine[worst] > ALONG:
            return
        raise GeometryError(
            f"{KIND}: the rulings of {self.name} run along the crease at t = {t[worst]:.6g}",
            value=float(sine[worst]),
            limit=ALONG,
            remedy="let the fold angle change more slowly there, or end the crease before it",
        )

    def _require_one_ruling(self, piece: Curve) -> None:
        """Raise a GeometryError at a break where the ruling or the front jumps."""
        if not piece.breaks:
            return
        after = np.array(piece.breaks)
        before = self.field(np.nextafter(after, piece.domain[0]), 0)
        behind = self.field(after, 0)
        turn = np.maximum(
            *(
                np.linalg.norm(x[0] - y[0], axis=1)
                for x, y in ((before.e, behind.e), (before.n, behind.n))
            )
        )
        worst = int(np.argmax(turn))
        if turn[worst] <= SAME_RULING:
            return
        raise GeometryError(
            f"{KIND}: the rulings of {self.name} turn by {np.degrees(turn[worst]):.3g} deg at "
            f"once at t = {after[worst]:.6g}, where the crease's curvature or torsion jumps",
            value=float(turn[worst]),
            limit=SAME_RULING,
            remedy="let the fold angle stand still and the torsion vanish there, or give a crease "
            "with continuous curvature: degree = 5 for points",
        )


def _require_distances(piece: Curve, name: str, distance: Expression, turn: float) -> Expression:
    """A distance along the rulings: finite, > 0 to the right (``turn`` 1) and < 0 to the left."""
    t = grid(piece)
    values = distance.at(t, 2)
    require_finite(values, t, name)
    worst = int(np.argmin(turn * values[0]))
    if turn * values[0, worst] > 0.0:
        return distance
    raise JobError(
        f"{name} is {values[0, worst]:.6g} at t = {t[worst]:.6g}, allowed are numbers "
        + ("above 0" if turn > 0.0 else "below 0"),
        value=float(values[0, worst]),
        limit=0.0,
        remedy="lengths count along the rulings: to the right > 0, to the left < 0",
    )


def _open_in_space(space: Curve) -> GeometryError:
    start, end = space.point(np.array(space.domain))
    gap = float(np.linalg.norm(end - start))
    return GeometryError(
        f"{KIND}: flat_crease is closed, but folded its ends are {gap:.6g} apart: the crease turns "
        "by more than in the flat",
        value=gap,
        limit=0.0,
        remedy="end the flat crease before it closes (a circle that shall close in space has "
        "sweep = 360 cos(fold/2)), or give a closed crease in space: crease and angle",
    )


def _chains(piece: Curve, strips: list[Strip]) -> list[tuple[Patch, ...]]:
    """The patches of all strips, cut at the breaks at which a rail of any of them is not smooth."""
    whole = [strip(piece, each.rays, (each.low, each.high)) for each in strips]
    if not piece.breaks:
        return [(patch,) for patch in whole]
    bends = np.any([rails_bend(patch) for patch in whole], axis=0)
    if not bends.any():
        return [(patch,) for patch in whole]
    return [
        tuple(
            strip(part, rays, (each.low, each.high))
            for part, rays in sides(piece, each.rays, bends)
        )
        for each in strips
    ]
