"""The developable on which a space curve is a line of curvature, Euclidean or Minkowskian."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal

import numpy as np
from pydantic import model_validator

from devcad.errors import GeometryError, JobError
from devcad.geometry import frames, taylor
from devcad.geometry.constructions.base import (
    Built,
    Closable,
    Extent,
    Rays,
    one_panel,
    sound,
    square,
    strip,
    velocity,
)
from devcad.geometry.constructions.sampling import VANISHES, crossing, grid, lowest
from devcad.geometry.curve import Curve
from devcad.geometry.curves import CurveSpec, Direction, Number
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array
from devcad.geometry.values import unit

LIGHTLIKE = 1e-9
"""|<x, x>| / |x|^2 up to which a vector counts as lightlike."""
STEEPEST = 1e-12
"""|n3| - hypot(n1, n2) of a unit normal up to which a plane is lightlike, to rounding."""

AS_TIMELIKE = 'causal = "timelike" gives the timelike developable'
BY_RULING = "give the start ruling instead of angle: ruling = [x, y, z]"


class LineOfCurvature(Closable):
    """P = curve + v b: b is normal to the curve and parallel along it, b' along T.

    The first ruling comes from ``angle`` (theta of the table: from N to the surface normal
    towards B; degrees, or a plain number in Minkowski space) or from ``ruling``, projected
    orthogonally to T. c0 = curve, e = b/|b|; the extent is the length along b in the metric.

    Source: geometry.md, section 1.
    """

    kind: Literal["line-of-curvature"]
    curve: CurveSpec
    extent: Extent
    metric: Literal["euclidean", "minkowski"] = "euclidean"
    causal: Literal["spacelike", "timelike"] | None = None
    angle: Number | None = None
    ruling: Direction | None = None

    @model_validator(mode="after")
    def _one_start(self) -> LineOfCurvature:
        if self.causal is not None and self.metric == "euclidean":
            raise JobError(
                "causal is for the Minkowski metric", remedy='write metric = "minkowski"'
            )
        if (self.angle is None) == (self.ruling is None):
            raise JobError(
                "a line of curvature has either angle or ruling",
                remedy="angle = theta at the start, or ruling = [x, y, z], the first ruling",
            )
        return self

    def build(self) -> Built:
        """One patch for each smooth piece of the curve.

        Raises:
            GeometryError: no such surface: the curve's tangent is lightlike or changes its
                causal type, a timelike curve is asked for a spacelike surface, the first ruling
                does not exist or has the wrong causal type, or the ruling jumps at a corner.
        """
        curve = self.curve.curve()
        with np.errstate(over="ignore", invalid="ignore"):  # a huge rapidity: see _require_slope
            return one_panel(self._patches(curve), curve.closed)

    def _patches(self, curve: Curve) -> Iterator[Patch]:
        """The patches in order, each beginning with the ruling that the one before ended with."""
        last: Array | None = None
        for piece in sound(curve, "curve", order=3):
            if self._causal is not None:
                _require_type(piece, self._causal)
            start = self._start(piece) if last is None else _beyond(last, piece, self._metric)
            normal = frames.parallel_normal(piece, start, self._metric)
            yield _patch(piece, normal, self.extent, self._causal)
            last = normal.series(*_at(piece, piece.domain[1], 1))[0, 0]

    @property
    def _metric(self) -> Array:
        return frames.EUCLID if self.metric == "euclidean" else frames.LORENTZ

    @property
    def _causal(self) -> str | None:
        """What the surface is to be; None when Euclidean."""
        return None if self.metric == "euclidean" else self.causal or "spacelike"

    def _start(self, piece: Curve) -> Array:
        """The first b (3,), of length one in the metric."""
        _, jet = _at(piece, piece.domain[0], 3)
        if self.ruling is not None:
            return _projected(unit(self.ruling), jet, self._metric, self._causal)
        assert self.angle is not None
        if self.metric == "euclidean":
            _require_normal(piece, jet, frames.EUCLID)
            return _by_angle("E", math.radians(self.angle), jet, frames.EUCLID)
        _require_normal(piece, jet, frames.LORENTZ)
        sign_t, sign_n, _ = (s[0] for s in frames.frenet(jet, frames.LORENTZ).signs)
        row = "TL" if sign_t < 0.0 else "SB" if sign_n > 0.0 else "SN"
        if row != "TL" and self._causal == "timelike":
            row += "'"
        return _by_angle(row, self.angle, jet, frames.LORENTZ)


def _at(piece: Curve, t: float, order: int) -> tuple[Array, Array]:
    """One parameter as an array, and the curve's series there."""
    here = np.array([t])
    return here, piece.jet(here, order)


def _patch(
    piece: Curve, normal: frames.ParallelNormal, extent: Extent, causal: str | None
) -> Patch:
    """The rulings along b on one smooth piece of the curve."""

    def rays(t: Array, order: int) -> tuple[Array, Array, Array | None]:
        jet = piece.jet(t, order + 1)
        b = normal.series(t, jet)
        return jet[:-1], taylor.unit(b), None if causal is None else taylor.norm(b)

    if causal is not None:
        _require_slope(piece, rays, causal)
    return strip(piece, rays, extent, causal=causal)


def _by_angle(row: str, theta: float, jet: Array, metric: Array) -> Array:
    """b of a row of the table at the start of the curve."""
    frame, angle = frames.frenet(jet, metric), np.array(theta)
    along_n, along_b = frames.ROWS[row].along_n(angle), frames.ROWS[row].along_b(angle)
    return np.asarray(along_n * frame.N[0, 0] + along_b * frame.B[0, 0])


def _projected(ruling: Array, jet: Array, metric: Array, causal: str | None) -> Array:
    """The part of a unit vector orthogonal to T, of length one in the metric.

    Raises:
        GeometryError: it is parallel to T, or of the wrong causal type.
    """
    tangent, signs = frames.tangent(jet[:2], metric)
    along, sign = tangent[0, 0], float(signs[0])
    across = ruling - sign * float(ruling @ (metric * along)) * along
    size = float(np.linalg.norm(across))
    if not size > VANISHES * float(along @ along):
        raise GeometryError(
            "ruling: it is parallel to the curve's tangent at the start",
            value=size,
            limit=VANISHES * float(along @ along),
            remedy="give a ruling across the curve",
        )
    wanted = -1.0 if causal == "timelike" and sign > 0.0 else 1.0
    norm = float(across @ (metric * across))
    share = wanted * norm / size**2
    if not share > LIGHTLIKE:
        kind = "spacelike" if wanted > 0.0 else "timelike"
        raise GeometryError(
            f"ruling: normal to the curve it has <b, b>/|b|^2 = {wanted * share:.6g}, "
            f"which is not {kind}",
            value=wanted * share,
            limit=wanted * LIGHTLIKE,
            remedy=f"give a ruling whose part normal to the curve is {kind}",
        )
    return np.asarray(across / math.sqrt(abs(norm)))


def _beyond(ruling: Array, piece: Curve, metric: Array) -> Array:
    """The ruling that came to a corner, as the first one after it.

    Raises:
        GeometryError: it is not normal to the curve after the corner.
    """
    here, jet = _at(piece, piece.domain[0], 1)
    tangent, sign = frames.tangent(jet, metric)
    along = tangent[0, 0]
    lean = float(ruling @ (metric * along))
    share = abs(lean) / float(np.linalg.norm(ruling) * np.linalg.norm(along))
    if not share <= VANISHES:
        raise GeometryError(
            f"curve: at the corner t = {here[0]:.6g} the ruling is not normal to both sides",
            value=share,
            limit=VANISHES,
            remedy="round the corner (corner_radius), or make one panel of each side",
        )
    return np.asarray(ruling - sign[0] * lean * along)


def _require_type(piece: Curve, causal: str) -> None:
    """Raise a GeometryError unless the tangent keeps a causal type that carries the surface."""

    def share(t: Array, order: int) -> Array:
        first = velocity(piece, t, order)
        return taylor.div(frames.inner(first, first, frames.LORENTZ), square(first))

    seen = share(grid(piece), 0)[0]
    sign = float(np.sign(seen[np.argmax(np.abs(seen))]))
    at, least = lowest(lambda t, k: sign * share(t, k), piece)
    if least < -LIGHTLIKE:
        at = crossing(share, piece)
        before, after = ("spacelike", "timelike") if seen[0] > 0.0 else ("timelike", "spacelike")
        raise GeometryError(
            f"curve: it is {before} before t = {at:.6g} and {after} after it",
            value=at,
            limit=0.0,
            remedy="split the curve there",
        )
    if not least > LIGHTLIKE:
        raise GeometryError(
            f"curve: the tangent is lightlike at t = {at:.6g}: "
            f"<r', r'>/|r'|^2 = {sign * least:.3g}, its size must exceed {LIGHTLIKE:g}",
            value=sign * least,
            limit=LIGHTLIKE,
            remedy="end the curve before that point",
        )
    if sign < 0.0 and causal == "spacelike":
        raise GeometryError(
            f"curve: it is timelike (at t = {piece.domain[0]:.6g} <r', r'>/|r'|^2 = "
            f"{seen[0]:.6g}, it must be positive), so no spacelike surface contains it",
            value=float(seen[0]),
            limit=0.0,
            remedy=AS_TIMELIKE,
        )


def _require_normal(piece: Curve, jet: Array, metric: Array) -> None:
    """Raise a GeometryError unless N = T'/|T'| exists at the start."""
    turning = frames.tangent(jet, metric)[0][1, 0]
    rates = np.linalg.norm(frames.tangent(piece.jet(grid(piece), 2), metric)[0][1], axis=1)
    largest = max(float(rates.max()), 1.0 / (piece.domain[1] - piece.domain[0]))
    size = float(np.linalg.norm(turning))
    at = piece.domain[0]
    if not size > VANISHES * largest:
        raise GeometryError(
            f"angle: the curve is straight at its start t = {at:.6g}, so N does not exist there",
            value=size,
            limit=VANISHES * largest,
            remedy=BY_RULING,
        )
    share = float(turning @ (metric * turning)) / size**2
    if not abs(share) > LIGHTLIKE:
        raise GeometryError(
            f"angle: T' is lightlike at the curve's start t = {at:.6g}, so N does not exist there",
            value=share,
            limit=LIGHTLIKE,
            remedy=BY_RULING,
        )


def _require_slope(piece: Curve, rays: Rays, causal: str) -> None:
    """Raise a GeometryError unless the tangent planes have the causal type that was asked for.

    A plane with Euclidean normal n is spacelike where |n3| > hypot(n1, n2): geometry.md 0.1.
    """
    t = grid(piece)
    normal = np.cross(rays(t, 0)[1][0], velocity(piece, t, 0)[0])
    normal = normal / np.linalg.norm(normal, axis=1)[:, None]
    margin = np.abs(normal[:, 2]) - np.hypot(normal[:, 0], normal[:, 1])
    margin = margin if causal == "spacelike" else -margin
    worst = int(np.argmin(margin))
    if not margin[worst] > STEEPEST:
        raise GeometryError(
            f"the surface is not {causal} at t = {t[worst]:.6g}: "
            f"|n3| - hypot(n1, n2) = {margin[worst]:.3g}",
            value=float(margin[worst]),
            limit=STEEPEST,
            remedy="choose a smaller angle, or another start ruling",
        )
