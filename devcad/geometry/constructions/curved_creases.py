"""Curved creases as numbers: given in space or in the flat, and the next one on a folded flank."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from devcad.errors import GeometryError, JobError, LimitError
from devcad.geometry import frames, taylor
from devcad.geometry.constructions.frenet_based import require_bent
from devcad.geometry.constructions.sampling import VANISHES, crossing, grid, lowest, require_finite
from devcad.geometry.curve import Curve, size
from devcad.geometry.flanks import (
    CreaseJet,
    Flanking,
    FlankJet,
    Seen,
    beyond,
    fold_at,
    seen,
    side,
    slopes,
)
from devcad.geometry.jets import Expression
from devcad.geometry.natural import framed_curve
from devcad.geometry.quotient import Pair, Pole, Quotient, quotient
from devcad.geometry.taylor import Array

KIND = "curved-fold"
STEEPEST = 90.0 - 1e-6
"""Degrees: from this alpha on the two sides lie upon one another."""
FLATTEST = 1e-7
"""sin(alpha) from which on a sheet is folded: below it the rulings have lost half their digits."""
ALONG = 1e-6
"""The sine of the angle between crease and ruling below which the ruling runs along the crease."""
OFF_THE_PLANE = 1e-9
"""How far a flat crease may leave the plane z = 0, as a share of its size."""

Creased = Callable[[Array, int], CreaseJet]
"""Parameters t (n,) and an order K to the crease's series."""


@dataclass(frozen=True, slots=True)
class FoldAngle:
    """alpha along a crease: ``share`` times the expression, which is in degrees."""

    name: str
    expression: Expression
    share: float

    def at(self, t: Array, order: int) -> Array:
        """The series of alpha in radians at t (n,), (order + 1, n)."""
        return self.share * np.radians(self.expression.at(t, order))

    def require_folded(self, piece: Curve) -> None:
        """Raise a JobError where the sheet is not folded, or folded back upon itself."""
        t = grid(piece)
        alpha = self.at(t, 3)
        require_finite(alpha, t, self.name)
        steep = int(np.argmax(np.abs(alpha[0])))
        limit = 90.0 / self.share
        if not abs(alpha[0, steep]) < np.radians(STEEPEST):
            value = float(np.degrees(alpha[0, steep]) / self.share)
            raise JobError(
                f"{self.name} is {value:.6g} deg at t = {t[steep]:.6g}: from {limit:.0f} on the "
                "two sides of the crease lie upon one another",
                value=value,
                limit=limit,
                remedy=f"keep it between -{limit:.0f} and {limit:.0f} degrees",
            )
        at, least = lowest(self._squared_sine, piece)
        if not least > FLATTEST**2:
            throughout = bool(np.abs(np.sin(alpha[0])).max() <= FLATTEST)
            raise JobError(
                f"{self.name} is 0 {'throughout' if throughout else f'at t = {at:.6g}'}: the sheet "
                "is not folded there, and its rulings are not determined",
                value=0.0,
                limit=0.0,
                remedy="keep it above 0 all along (valley), or below 0 (mountain); end the crease "
                "where the fold ends",
            )

    def _squared_sine(self, t: Array, order: int) -> Array:
        sine, _ = taylor.sin_cos(self.at(t, order))
        return taylor.mul(sine, sine)


def space_crease(piece: Curve) -> Creased:
    """A crease given in space, by its Frenet frame; GeometryError where it is not curved."""
    t = grid(piece)
    jet = piece.jet(t, 2)
    turn = np.linalg.norm(np.cross(jet[1], jet[2]), axis=1) / np.linalg.norm(jet[1], axis=1) ** 2
    if turn.max() * np.ptp(piece.domain) <= VANISHES:
        raise GeometryError(
            f"{KIND}: the crease is straight: it has no osculating plane to measure the angle from",
            value=0.0,
            limit=VANISHES,
            remedy="give it as flat_crease with a constant fold, or use pq-strip for plane faces",
        )
    require_bent(KIND, piece, WITH_A_FLAT_CREASE)

    def jets(t: Array, order: int) -> CreaseJet:
        jet = piece.jet(t, order + 3)
        frame = frames.frenet(jet)
        bend, wind = (taylor.mul(frame.speed, x) for x in (frame.curvature, frame.torsion))
        return CreaseJet(jet[: order + 1], frame.T, frame.N, frame.B, bend, wind)

    return jets


WITH_A_FLAT_CREASE = (
    "give the crease in the flat: with flat_crease and fold it may run straight or turn the other "
    "way where the fold angle stands still and nothing twists"
)


def require_flat(piece: Curve) -> None:
    """Raise a JobError where a flat crease leaves the plane z = 0."""
    t = grid(piece)
    points = piece.point(t)
    worst = int(np.argmax(np.abs(points[:, 2])))
    if abs(points[worst, 2]) > OFF_THE_PLANE * size(points):
        raise JobError(
            f"flat_crease: z = {points[worst, 2]:.6g} at t = {t[worst]:.6g}",
            value=float(points[worst, 2]),
            limit=0.0,
            remedy="draw it in the plane z = 0, or give a crease in space: crease and angle",
        )


def flat_crease(piece: Curve, alpha: FoldAngle, winding: Winding) -> Creased:
    """A crease given in the flat, folded: k = kg / cos(alpha), a curvature with a sign.

    In space it starts where it starts in the flat, with its tangent, B = +z.
    """

    def rates(t: Array, order: int) -> tuple[Array, Array, Array]:
        speed, turn = _flat_rates(piece, t, order)
        angle = alpha.at(t, order + 1)
        _, cosine = taylor.sin_cos(angle[:-1])
        return speed, taylor.div(turn, cosine), winding(t, speed, turn, angle)

    start = piece.jet(np.array([piece.domain[0]]), 1)[:, 0]
    along = start[1] / np.linalg.norm(start[1])
    frame = np.stack([along, np.array([-along[1], along[0], 0.0]), np.array([0.0, 0.0, 1.0])])
    try:
        framed = framed_curve(rates, piece.domain, start[0], frame, piece.breaks)
    except LimitError as error:
        error.what = f"{KIND}: folded by {alpha.name}, {error.what}"
        error.remedy = (
            "shorten the crease, fold less (towards 180 degrees it coils up), or twist it less"
        )
        raise

    def jets(t: Array, order: int) -> CreaseJet:
        _, bend, wind = rates(t, order)
        return CreaseJet(*framed(t, order), bend, wind)

    return jets


Winding = Callable[[Array, Array, Array, Array], Array]
"""t (n,), the series of ds/dt, of kg ds/dt (K + 1, n) and of alpha (K + 2, n) to tau ds/dt."""


def by_torsion(torsion: Expression) -> Winding:
    """The torsion as given."""

    def winding(t: Array, speed: Array, _turn: Array, _alpha: Array) -> Array:
        return taylor.mul(speed, torsion.at(t, len(speed) - 1))

    return winding


def by_ruling(ruling: Expression) -> Winding:
    """The torsion that gives the right rulings the angle ``ruling`` (degrees) to the crease:
    tau = k sin(alpha) cot(beta) + alpha'."""

    def winding(t: Array, _speed: Array, turn: Array, alpha: Array) -> Array:
        sine, cosine = taylor.sin_cos(alpha[:-1])
        lean = taylor.mul(taylor.div(sine, cosine), cotangent(ruling, t, len(turn) - 1))
        return taylor.mul(turn, lean) + taylor.derivative(alpha)

    return winding


def cotangent(angle: Expression, t: Array, order: int) -> Array:
    """The series of the cotangent of an angle in degrees."""
    sine, cosine = taylor.sin_cos(np.radians(angle.at(t, order)))
    return taylor.div(cosine, sine)


def _flat_rates(piece: Curve, t: Array, order: int) -> tuple[Array, Array]:
    """The series of ds/dt and of kg ds/dt of a plane curve."""
    first = taylor.derivative(piece.jet(t, order + 2))
    second = taylor.derivative(first)
    x, y = first[:-1, :, 0], first[:-1, :, 1]
    square = taylor.mul(x, x) + taylor.mul(y, y)
    turn = taylor.mul(x, second[..., 1]) - taylor.mul(y, second[..., 0])
    return taylor.sqrt(square), taylor.div(turn, square)


def two_sides(
    crease: Creased, alpha: FoldAngle, piece: Curve, ruling: Expression | None
) -> tuple[Flanking, Flanking]:
    """The right and the left flank of the first crease; ``ruling`` is the angle of the right
    rulings where it is given.

    Raises:
        GeometryError: the rulings run along the crease somewhere.
    """
    return _flank(crease, alpha, piece, ruling, 1.0), _flank(crease, alpha, piece, None, -1.0)


def _flank(
    crease: Creased, alpha: FoldAngle, piece: Curve, ruling: Expression | None, right: float
) -> Flanking:
    """One side of the first crease."""
    name = "right" if right > 0.0 else "left"

    def pair(t: Array, order: int) -> tuple[Array, Array]:
        return slopes(crease(t, order), alpha.at(t, order + 1), right)

    ratio = None if ruling is not None else _ratio(pair, piece, crease, f"the {name} side")

    def flank(t: Array, order: int) -> FlankJet:
        jet, angle = crease(t, order), alpha.at(t, order + 1)
        if ratio is not None:
            cot = ratio.of(t, *slopes(jet, angle, right))
        elif ruling is not None:
            cot = cotangent(ruling, t, order)
        return side(jet, angle[:-1], cot, right)

    return flank


def _ratio(pair: Pair, piece: Curve, crease: Creased, name: str) -> Quotient:
    """The cotangents of a flank's rulings, finite all along."""
    t = grid(piece)
    jet = crease(t, 0)
    turning = float(max(np.abs(jet.bend).max(), np.abs(jet.wind).max()))
    found = quotient(pair, ends(piece), turning)
    if isinstance(found, Quotient):
        return found
    where = (
        f"at t = {found.t:.6g}: the crease is straight there"
        if found.stretch is None
        else f"from t = {found.t:.6g} to {found.stretch:.6g}: the crease is straight there"
    )
    raise GeometryError(
        f"{KIND}: the rulings of {name} run along the crease {where} (curvature 0), but its fold "
        "angle changes or it twists",
        value=found.t,
        remedy="let the fold angle stand still and the torsion vanish there, or end the crease "
        "before that point",
    )


@dataclass(frozen=True, slots=True)
class _Further:
    """A crease at v = ``distance`` on a flank, and the flank beyond it."""

    flank: Flanking
    distance: Expression
    right: float

    def seen(self, t: Array, order: int) -> Seen:
        """The crease as the flank sees it, its curvatures to order + 1."""
        return seen(self.flank(t, order + 3), self.distance.at(t, order + 3), self.right)

    def tangents(self, t: Array, order: int) -> tuple[Array, Array]:
        """Numerator and denominator of tan(alpha)."""
        here = self.seen(t, order - 1)
        return -self.right * here.bend[: order + 1], here.turn[: order + 1]

    def folded(self, t: Array, order: int, tangent: Quotient) -> tuple[Seen, Array]:
        """The crease and alpha to order + 1."""
        here = self.seen(t, order)
        return here, fold_at(here, t, tangent, self.right)


def folded_beyond(
    flank: Flanking, distance: Expression, piece: Curve, right: float, name: str
) -> Flanking:
    """The flank beyond a further crease at v = ``distance`` on ``flank``; ``name`` says which.

    Raises:
        GeometryError: nowhere folded, folded back upon itself, or the new rulings run along it.
    """
    crease = _Further(flank, distance, right)
    tangent = quotient(crease.tangents, ends(piece), 0.0)
    if isinstance(tangent, Pole):
        raise _folded_back(tangent.t, name)
    _require_refolded(lambda t, order: crease.folded(t, order, tangent)[1], piece, name)

    def pair(t: Array, order: int) -> tuple[Array, Array]:
        here, alpha = crease.folded(t, order, tangent)
        return 2.0 * taylor.derivative(alpha), here.bend[: order + 1]

    bending = np.abs(np.concatenate([x[0] for x in crease.tangents(grid(piece), 0)]))
    slope = quotient(pair, ends(piece), float(bending.max()))
    if isinstance(slope, Pole):
        raise GeometryError(
            f"{KIND}: the rulings beyond {name} run along it at t = {slope.t:.6g}, where it is "
            "straight and its fold angle changes",
            value=slope.t,
            remedy="end the creases before that point, or move it",
        )

    def new(t: Array, order: int) -> FlankJet:
        here, alpha = crease.folded(t, order, tangent)
        twice = slope.of(t, 2.0 * taylor.derivative(alpha), here.bend[: order + 1])
        return beyond(here, alpha, twice, right)

    return new


def _require_refolded(alpha: Callable[[Array, int], Array], piece: Curve, name: str) -> None:
    """Raise a GeometryError where a further crease does not fold, or folds by 180 degrees."""
    t = grid(piece)
    angle = alpha(t, 0)[0]
    steep = int(np.argmax(np.abs(angle)))
    if not abs(angle[steep]) < np.radians(STEEPEST):
        raise _folded_back(float(t[steep]), name)
    least = int(np.argmin(np.abs(angle)))
    changes = bool(angle.min() < 0.0 < angle.max())
    if changes or not abs(np.sin(angle[least])) > FLATTEST:
        at = crossing(alpha, piece) if changes else float(t[least])
        raise GeometryError(
            f"{KIND}: {name} does not fold at t = {at:.6g}: the sheet before it is plane there",
            value=0.0,
            limit=FLATTEST,
            remedy="a plane folds along straight lines only; move the crease, or end it before "
            "that point",
        )


def _folded_back(t: float, name: str) -> GeometryError:
    return GeometryError(
        f"{KIND}: {name} folds the sheet back upon itself at t = {t:.6g}: in the flat it is "
        "straight there, but the sheet before it is bent",
        value=t,
        remedy="give it another distance: it must be curved in the flat wherever the sheet is bent",
    )


def ends(piece: Curve) -> tuple[float, ...]:
    """The domain's ends with the breaks between them."""
    return (piece.domain[0], *piece.breaks, piece.domain[1])
