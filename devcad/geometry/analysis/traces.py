"""What a curve does along itself: arc length, curvature, torsion and the ratios of its frames.

Sampled densely enough to be drawn. Between two neighbouring samples nothing is looked for, apart
from the inflections: there N and B are continued through, so that an S-curve has one smooth frame
(its ratios are those of a curvature that changes its sign; the curvature itself is told as >= 0).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from devcad.errors import GeometryError
from devcad.geometry import frames, taylor
from devcad.geometry.chebyshev import Piecewise, resolve
from devcad.geometry.constructions.sampling import VANISHES, dips, grid, require_finite
from devcad.geometry.curve import Curve, size
from devcad.geometry.indicatrices import indicatrices
from devcad.geometry.taylor import Array

FEWEST, MOST = 257, 4097
"""Samples of a curve, breaks and corners from both sides among them."""
RATIOS = ("f", "sigma", "psi", "chi")
"""The ratios of the frames of (T, N, B), (N, Cc, Dbar), (Cc, N_N, B_N) and the next."""
DEPTH = 6
"""Derivatives of the curve in the last ratio; the first needs three."""
SEEN = 1e6
"""Samples follow the curve to this times 1e-14 of its size; a larger one hides waves as noise."""
LIGHT = 1e-9
"""<r', r'> below this share of |r'|^2 is lightlike."""
ROUNDING = 64.0 * np.finfo(float).eps

# Two rotations about no axis of symmetry, by quaternions: they turn rounding into other rounding.
_QUATERNIONS = ((0.5, 0.1, 0.7, 0.5), (0.3, -0.8, 0.4, 0.33))


@dataclass(frozen=True, slots=True)
class Traces:
    """The samples: ``t`` and ``arc`` (the length from the start), (n,), increasing.

    What does not exist is nan: T, N, B (n, 3) and ``curvature`` where the curve stands still;
    ``torsion``, N, B, ``ratios`` (4, n) and their axes (4, n, 3) where it is straight. ``noise``
    (4, n) is how much rounding moves the ratios. ``lorentz`` are curvature and torsion (2, n) in
    the metric x^2 + y^2 - z^2. ``inflections`` and ``stops`` (where the curve stands still) are
    isolated parameters. ``panels`` polynomials follow the curve.
    """

    t: Array
    arc: Array
    curvature: Array
    torsion: Array
    ratios: Array
    noise: Array
    axes: Array
    T: Array
    N: Array
    B: Array
    lorentz: Array
    inflections: tuple[float, ...]
    stops: tuple[float, ...]
    panels: int

    @property
    def bent(self) -> npt.NDArray[np.bool_]:
        """Which samples have a curvature that is not zero, (n,)."""
        return np.isfinite(self.torsion)

    @property
    def length(self) -> float:
        """The curve's length."""
        return float(self.arc[-1])


def trace(curve: Curve) -> Traces:
    """The traces of a curve, in its own units; the length is to rounding.

    Raises:
        JobError: a value or a first derivative is not a finite number; GeometryError: the curve
            is a point.
    """
    pieces = curve.pieces()
    for piece in pieces:
        t = grid(piece)
        require_finite(piece.jet(t, 1), t, "the curve")
    if not size(curve.point(grid(curve))) > 0.0:
        raise GeometryError(
            "the curve is a point: its coordinates do not change",
            value=0.0,
            remedy="let x, y or z depend on t",
        )
    stops = _stops(pieces)
    lengths = _arc_length(curve, stops)
    t, panels = _parameters(curve)
    arc = lengths(t)[:, 0]
    arc[0], arc[-1] = 0.0, float(lengths(np.array([curve.domain[1]]))[0, 0])
    with np.errstate(all="ignore"):
        return _oriented(curve, _evaluated(curve, t, arc, stops, panels), pieces)


def knots(curve: Curve) -> Array:
    """The domain's ends with the breaks and corners between them, increasing."""
    return np.unique([*curve.domain, *curve.breaks, *curve.corners])


def _stops(pieces: tuple[Curve, ...]) -> tuple[float, ...]:
    """The isolated parameters at which the curve stands still."""
    found: list[float] = []
    for piece in pieces:

        def squared(t: Array, order: int, of: Curve = piece) -> Array:
            velocity = taylor.derivative(of.jet(t, order + 1))
            return taylor.dot(velocity, velocity)

        most = float(squared(grid(piece), 0).max())
        at = np.array([piece.domain[0], *dips(squared, piece), piece.domain[1]])
        found += at[squared(at, 0)[0] <= VANISHES**2 * most].tolist()
    return tuple(dict.fromkeys(found))


def _arc_length(curve: Curve, stops: tuple[float, ...]) -> Piecewise:
    """The length from the start as a function of the parameter."""

    def speed(t: Array) -> Array:
        return np.asarray(np.linalg.norm(curve.jet(t, 1)[1], axis=1)[:, None])

    ends = np.unique([*knots(curve), *stops])
    return resolve(speed, ends).antiderivative()


def _parameters(curve: Curve) -> tuple[Array, int]:
    """The samples' parameters, every smooth stretch evenly, as many as its waves need; and the
    number of polynomials that follow them."""
    points = curve.point(grid(replace(curve, breaks=tuple(knots(curve)[1:-1].tolist()))))
    seen = resolve(curve.point, knots(curve), scale=SEEN * max(size(points), 1e-300))
    panels = len(seen.knots) - 1
    each = max(-(-(FEWEST - 1) // panels), seen.coefficients.shape[1] - 1)
    each = max(min(each, (MOST - 1) // panels), 2)
    inner = [np.linspace(a, b, each + 1) for a, b in pairwise(seen.knots.tolist())]
    ends = knots(curve)[1:-1]
    t = np.unique(np.concatenate([*inner, ends, np.nextafter(ends, -np.inf)]))
    return (t if len(t) <= 2 * MOST else t[:: len(t) // MOST]), panels


def _evaluated(curve: Curve, t: Array, arc: Array, stops: tuple[float, ...], panels: int) -> Traces:
    """The traces with the frames as they come, N towards the centre of curvature."""
    jet = curve.jet(t, DEPTH)
    row = indicatrices(jet, len(RATIOS))
    ratios = np.stack([frame.ratio[0] for frame in row])
    axes = np.stack([frame.axis[0] for frame in row])
    frenet = frames.frenet(jet[:4])
    still = frenet.speed[0] <= VANISHES * np.nanmax(frenet.speed[0], initial=0.0)
    straight = still | ~(frenet.curvature[0] > _straightness(curve, frenet, jet))
    light = np.abs(_slope(jet)) <= LIGHT
    lorentz = frames.frenet(jet[:4], frames.LORENTZ)
    return Traces(
        t,
        arc,
        np.where(still, np.nan, frenet.curvature[0]),
        np.where(straight, np.nan, frenet.torsion[0]),
        np.where(straight, np.nan, ratios),
        np.where(straight, np.nan, _noise(jet, ratios)),
        np.where(straight[:, None], np.nan, axes),
        np.where(still[:, None], np.nan, frenet.T[0]),
        np.where(straight[:, None], np.nan, frenet.N[0]),
        np.where(straight[:, None], np.nan, frenet.B[0]),
        np.stack(
            [
                np.where(still | light, np.nan, lorentz.curvature[0]),
                np.where(straight | light, np.nan, lorentz.torsion[0]),
            ]
        ),
        (),
        stops,
        panels,
    )


def _straightness(curve: Curve, frenet: frames.Frenet, jet: Array) -> Array:
    """The curvature below which each sample counts as straight, (n,): 1e-9 of the usual one (at
    least of 1/size), and the rounding of r' x r''."""
    known = frenet.curvature[0][np.isfinite(frenet.curvature[0])]
    usual = max(float(np.median(known)) if len(known) else 0.0, 1.0 / max(size(jet[0]), 1e-300))
    rounding = ROUNDING * 2.0 * np.linalg.norm(jet[2], axis=1) / frenet.speed[0] ** 2
    return np.asarray(VANISHES * usual + rounding)


def _slope(jet: Array) -> Array:
    """<r', r'>/|r'|^2 in the metric x^2 + y^2 - z^2, (n,): -1 along z, 0 lightlike, 1 across z."""
    velocity = jet[1]
    square = velocity**2
    return np.asarray(square @ frames.LORENTZ / square.sum(axis=1))


def _noise(jet: Array, ratios: Array) -> Array:
    """How much rounding moves the ratios, (4, n): what a rotation of the curve changes in them,
    the largest among neighbours."""
    found = np.zeros_like(ratios)
    for quaternion in _QUATERNIONS:
        turned = indicatrices(jet @ _rotation(np.array(quaternion)), len(RATIOS))
        moved = np.abs(np.stack([frame.ratio[0] for frame in turned]) - ratios)
        found = np.fmax(found, moved)
    wide = found.copy()
    for shift in (1, 2, 3):
        wide[:, shift:] = np.fmax(wide[:, shift:], found[:, :-shift])
        wide[:, :-shift] = np.fmax(wide[:, :-shift], found[:, shift:])
    return wide


def _rotation(quaternion: Array) -> Array:
    """The rotation matrix (3, 3) of a quaternion of any length."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


# --- through inflections -------------------------------------------------------------------


def _oriented(curve: Curve, raw: Traces, pieces: tuple[Curve, ...]) -> Traces:
    """The traces with N and B continued through inflections and breaks."""
    found = [_inflections(piece, raw) for piece in pieces]
    turning = np.concatenate([at[turns] for at, turns in found])
    flipped = np.searchsorted(turning, raw.t, side="left") % 2 == 1
    for knot in knots(curve)[1:-1]:
        after = int(np.searchsorted(raw.t, knot))
        before = _near(raw, range(after - 1, after - 4, -1))
        behind = _near(raw, range(after, after + 3))
        if before is None or behind is None:
            continue
        side = -1.0 if flipped[before] != flipped[behind] else 1.0
        if side * float(raw.B[before] @ raw.B[behind]) < 0.0:
            flipped[after:] = ~flipped[after:]
    sign = np.where(flipped, -1.0, 1.0)
    return replace(
        raw,
        ratios=sign * raw.ratios,
        N=sign[:, None] * raw.N,
        B=sign[:, None] * raw.B,
        inflections=tuple(float(t) for at, _ in found for t in at),
    )


def _near(raw: Traces, order: range) -> int | None:
    """The first sample of ``order`` that is bent."""
    return next((k for k in order if 0 <= k < len(raw.t) and raw.bent[k]), None)


def _inflections(piece: Curve, raw: Traces) -> tuple[Array, npt.NDArray[np.bool_]]:
    """The isolated parameters at which the curvature vanishes, and whether B turns over there."""
    ends = np.array(piece.domain)
    own = (raw.t >= ends[0]) & (raw.t <= ends[1]) & raw.bent
    if not own.any():
        return ends[:0], np.zeros(0, dtype=bool)
    level = VANISHES * float(np.median(raw.curvature[own]))
    at = np.unique([*ends, *dips(lambda t, order: _squared_area(piece, t, order), piece)])
    at = at[_bending(piece, at) <= level]  # nan where the curve stands still
    others = np.unique([*knots(piece), *at])
    gaps = np.abs(at[:, None] - others)
    step = 1e-3 * np.min(gaps, axis=1, where=gaps > 0.0, initial=float(np.ptp(ends)))
    before, behind = np.clip(at - step, *piece.domain), np.clip(at + step, *piece.domain)
    isolated = (before < at) & (_bending(piece, before) > level) | (
        (behind > at) & (_bending(piece, behind) > level)
    )
    sides = taylor.rows_dot(_area(piece, before, 0)[0], _area(piece, behind, 0)[0])
    inner = (before < at) & (behind > at) & ~np.isin(at, piece.breaks)
    return at[isolated], (inner & (sides < 0.0))[isolated]


def _area(piece: Curve, t: Array, order: int) -> Array:
    """The series of r' x r''."""
    first = taylor.derivative(piece.jet(t, order + 2))
    return taylor.cross(first[:-1], taylor.derivative(first))


def _squared_area(piece: Curve, t: Array, order: int) -> Array:
    w = _area(piece, t, order)
    return taylor.dot(w, w)


def _bending(piece: Curve, t: Array) -> Array:
    """The curvature, (n,), met to rounding at its zeros too."""
    speed = np.linalg.norm(piece.jet(t, 1)[1], axis=1)
    return np.asarray(np.linalg.norm(_area(piece, t, 0)[0], axis=1) / speed**3)
