"""Control nets of developable splines: the second edge of a polynomial developable by its first.

Let b and c be splines of degree p on one knot vector, L and M two numbers. If the polar forms
meet, c[t, ..., t, L] = b[t, ..., t, M] for every t, then the tangents of b and c at t meet in that
point, so that the surface between b and c has one tangent plane along each ruling. In poles,
with the domain scaled to [0, 1], d = c - b, g(u) = 1 - u/L and w = 1 - M/L,

    g(k[i+1]) d[i+1] = g(k[i+p+1]) d[i] - w (b[i+1] - b[i])

The regression curve crosses the ruling at t at the fraction g(t)/w (0 on b, 1 on c). So a net is
given by d[0] and two numbers: s = g(1) > 0 and w; it is regular where w < min(1, s).

Source: Aumann, A simple algorithm for designing developable Bezier surfaces (CAGD 20, 2003); Chu
and Sequin, Developable Bezier patches: properties and design (CAD 34, 2002); Fernandez-Jambrina,
B-spline control nets for developable surfaces (CAGD 24, 2007). The form in s and w, in which cones
(s = 1) and cylinders (w = 0) are no limits, follows by writing M/L and 1/L for L and M.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from devcad.geometry.fit import Spline
from devcad.geometry.taylor import Array

_GRID = 161  # values of s that are tried
_WIDEST = 20.0  # the largest s; the smallest is its inverse
_HALVINGS = 60
_STEPS = 20  # of Gauss and Newton
_SAME = 1e-9  # of the first ruling: two ways to miss the aim that count as one
_STEP = 1e-6  # in s, for the slopes: Newton steps forgive their error
_GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)


@dataclass(frozen=True, slots=True)
class Freedom:
    """The two numbers that are left free by a boundary and its first ruling.

    ``spread`` = s and ``pull`` = w; the singular points lie at the fractions 1/w and s/w of the
    first and the last ruling.
    """

    spread: float
    pull: float

    @property
    def regular(self) -> bool:
        """Whether no singular point lies on the patch."""
        return self.spread > 0.0 and self.pull < min(1.0, self.spread)


@dataclass(frozen=True, slots=True)
class Aim:
    """What the rulings shall be: ``rulings`` (n, 3) at ``t`` (n,), as nearly as possible.

    The singular points keep the distance ``room`` (in lengths of the ruling) from the patch;
    ``cone`` leaves only cones and cylinders: what closes where the boundary closes.
    """

    t: Array
    rulings: Array
    room: float
    cone: bool = False


def clamped(degree: int, knots: Array, poles: Array) -> Spline:
    """The same spline with its ends as knots of multiplicity degree + 1."""
    from scipy.interpolate import BSpline  # type: ignore[import-untyped,unused-ignore]

    ends = knots[degree], knots[-degree - 1]
    spline = BSpline(knots, poles, degree)
    for end in ends:
        missing = degree - int(np.count_nonzero(knots == end))
        if missing > 0:
            spline = spline.insert_knot(end, missing)
    first = int(np.searchsorted(spline.t, ends[0], side="right")) - degree
    last = int(np.searchsorted(spline.t, ends[1])) + degree - 1
    inside = np.concatenate([[ends[0]], spline.t[first : last + 1], [ends[1]]])
    return Spline(degree, inside, np.asarray(spline.c[first - 1 : last - degree + 1]))


def opposite(boundary: Spline, ruling: Array, freedom: Freedom) -> Spline:
    """The second edge: same degree and knots, poles b + d."""
    still, drawn = _parts(boundary, np.array([freedom.spread]))
    d = still * ruling - freedom.pull * drawn[:, 0]
    return replace(boundary, poles=boundary.poles + d)


def by_second(boundary: Spline, ruling: Array, second: Array) -> tuple[Freedom, float]:
    """The freedom that takes the opposite edge's second pole to ``second``, and how far that lies
    from the plane of the first leg and the first ruling; these two must not be parallel."""
    leg = boundary.poles[1] - boundary.poles[0]
    wanted = second - boundary.poles[1]
    columns = np.stack([ruling, leg], axis=1)
    scale = np.linalg.norm(columns, axis=0)
    share = np.linalg.lstsq(columns / scale, wanted, rcond=None)[0] / scale
    knots = _scaled(boundary)
    spread = 1.0 - (1.0 - float(share[0])) / float(knots[boundary.degree + 1])
    missed = float(np.linalg.norm(columns @ share - wanted))
    return Freedom(spread, -float(share[1])), missed


def carried(boundary: Spline, ruling: Array, t: Array) -> Array:
    """The ruling as it is carried along the boundary without turning about it, (n, 3).

    It keeps its length and its angle with the boundary. ``t`` increases from the start; each step
    turns by the smallest rotation that takes one tangent into the next.
    """
    slope = boundary.derivative(t)
    tangent = slope / np.linalg.norm(slope, axis=1)[:, None]
    out = np.empty((len(t), 3))
    out[0] = ruling
    for k in range(1, len(t)):
        axis = np.cross(tangent[k - 1], tangent[k])
        cosine = max(float(tangent[k - 1] @ tangent[k]), -1.0 + 1e-9)
        turned = np.cross(axis, out[k - 1])
        out[k] = out[k - 1] + turned + np.cross(axis, turned) / (1.0 + cosine)
    return out


def nearest(boundary: Spline, ruling: Array, aim: Aim) -> Freedom:
    """The regular freedom whose rulings come nearest to the aim, in least squares.

    For each s the best w is a matter of a division; s is searched on a grid, refined by sections
    where the distance dips, and polished to rounding. Of equal ones the s nearest to 1 is taken.
    """
    if aim.cone:
        return Freedom(1.0, float(_best(boundary, ruling, aim, np.ones(1))[0][0]))
    x = np.linspace(-np.log(_WIDEST), np.log(_WIDEST), _GRID)
    error = _best(boundary, ruling, aim, np.exp(x))[1]
    padded = np.concatenate([[np.inf], error, [np.inf]])
    dips = np.flatnonzero((padded[1:-1] <= padded[:-2]) & (padded[1:-1] <= padded[2:])).tolist()
    found = [(float(np.exp(x[k])), float(error[k])) for k in dips]
    for k in dips:
        s = _section(boundary, ruling, aim, x[max(k - 1, 0)], x[min(k + 1, _GRID - 1)])
        found.append((s, float(_best(boundary, ruling, aim, np.array([s]))[1][0])))
    least = min(e for _, e in found) + (_SAME * float(np.linalg.norm(ruling))) ** 2 * len(aim.t)
    s = min((s for s, e in found if e <= least), key=lambda s: max(s, 1.0 / s))
    w = float(_best(boundary, ruling, aim, np.array([s]))[0][0])
    return _polished(boundary, ruling, aim, Freedom(s, w))


def steepest(boundary: Spline, ruling: Array, aim: Aim) -> Freedom:
    """The regular freedom whose rulings keep farthest from the boundary's tangent."""
    spreads = np.exp(np.linspace(-1.5, 1.5, 31))
    low, high = _limits(aim, spreads)
    best, top = Freedom(1.0, 0.0), -np.inf
    for s, a, b in zip(spreads, low, high, strict=True):
        for w in np.concatenate([np.linspace(max(a, -2.0), b, 31), [0.0]]):
            freedom = Freedom(float(s), float(w))
            value = least_sine(boundary, ruling, freedom, aim.t)
            if value > top:
                best, top = freedom, value
    return best


def least_sine(boundary: Spline, ruling: Array, freedom: Freedom, t: Array) -> float:
    """The smallest sine of the angle between ruling and boundary at t (n,)."""
    slope = boundary.derivative(t)
    d = opposite(boundary, ruling, freedom)(t) - boundary(t)
    sizes = np.linalg.norm(slope, axis=1) * np.linalg.norm(d, axis=1)
    return float((np.linalg.norm(np.cross(slope, d), axis=1) / sizes).min())


def _scaled(boundary: Spline) -> Array:
    """The knots with the domain as [0, 1]."""
    knots = boundary.knots
    return np.asarray((knots - knots[0]) / (knots[-1] - knots[0]))


def _parts(boundary: Spline, spread: Array) -> tuple[Array, Array]:
    """For each s (k,) the poles of d = x d[0] - w y: x (n, k) and y (n, k, 3)."""
    knots, p = _scaled(boundary), boundary.degree
    legs = np.diff(boundary.poles, axis=0)
    count = len(boundary.poles)
    g = 1.0 + (spread - 1.0) * knots[:, None]  # (knots, k)
    still = np.ones((count, len(spread)))
    drawn = np.zeros((count, len(spread), 3))
    for i in range(count - 1):
        still[i + 1] = g[i + p + 1] * still[i] / g[i + 1]
        drawn[i + 1] = (g[i + p + 1][:, None] * drawn[i] + legs[i]) / g[i + 1][:, None]
    return still, drawn


def _rulings(boundary: Spline, ruling: Array, t: Array, spread: Array) -> tuple[Array, Array]:
    """d at t without w, and what w takes off: (n, k, 3) both."""
    still, drawn = _parts(boundary, spread)
    poles = np.concatenate([still[:, :, None] * ruling, drawn], axis=1)
    values = Spline(boundary.degree, boundary.knots, poles.reshape(len(poles), -1))(t)
    values = values.reshape(len(t), 2 * len(spread), 3)
    return values[:, : len(spread)], values[:, len(spread) :]


def _limits(aim: Aim, spread: Array) -> tuple[Array, Array]:
    """The smallest and the largest w that keep the room, (k,) each."""
    narrow = np.minimum(1.0, spread)
    return -narrow / aim.room, narrow / (1.0 + aim.room)


def _best(boundary: Spline, ruling: Array, aim: Aim, spread: Array) -> tuple[Array, Array]:
    """For each s (k,) the best w and the sum of squares that it leaves."""
    still, drawn = _rulings(boundary, ruling, aim.t, spread)
    off = still - aim.rulings[:, None]
    square = np.einsum("nki,nki->k", drawn, drawn)
    along = np.einsum("nki,nki->k", drawn, off)
    wanted = np.where(square > 0.0, along / np.where(square > 0.0, square, 1.0), 0.0)
    w = np.clip(wanted, *_limits(aim, spread))
    rest = off - w[None, :, None] * drawn
    return w, np.einsum("nki,nki->k", rest, rest)


def _section(boundary: Spline, ruling: Array, aim: Aim, low: float, high: float) -> float:
    """The s of the smallest distance between exp(low) and exp(high), by golden sections."""

    def error(x: float) -> float:
        return float(_best(boundary, ruling, aim, np.array([np.exp(x)]))[1][0])

    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_a, at_b = error(a), error(b)
    for _ in range(_HALVINGS):
        if at_a <= at_b:
            high, b, at_b = b, a, at_a
            a = high - _GOLDEN * (high - low)
            at_a = error(a)
        else:
            low, a, at_a = a, b, at_b
            b = low + _GOLDEN * (high - low)
            at_b = error(b)
    return float(np.exp(a if at_a <= at_b else b))


def _polished(boundary: Spline, ruling: Array, aim: Aim, freedom: Freedom) -> Freedom:
    """A few steps of Gauss and Newton while they help: the sections stop at half of the digits."""
    best, error = freedom, np.inf
    for _ in range(_STEPS):
        spreads = freedom.spread + _STEP * np.array([0.0, 1.0, -1.0])
        still, drawn = _rulings(boundary, ruling, aim.t, spreads)
        rest = still - freedom.pull * drawn - aim.rulings[:, None]
        size = float(np.linalg.norm(rest[:, 0]))
        low, high = _limits(aim, spreads[:1])
        if not (size < error and low[0] <= freedom.pull <= high[0] and freedom.regular):
            return best
        best, error = freedom, size
        by_s = (rest[:, 1] - rest[:, 2]).ravel() / (2.0 * _STEP)
        slopes = np.stack([by_s, -drawn[:, 0].ravel()], axis=1)
        step = np.linalg.lstsq(slopes, -rest[:, 0].ravel(), rcond=None)[0]
        freedom = Freedom(freedom.spread + float(step[0]), freedom.pull + float(step[1]))
    return best
