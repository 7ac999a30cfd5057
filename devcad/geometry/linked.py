"""A chain of curves by fraction of its length: exact where the length is the parameter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from devcad.errors import JobError
from devcad.geometry import taylor
from devcad.geometry.chebyshev import Piecewise, resolve
from devcad.geometry.curve import SAME_DIRECTION, Curve, ends_meet, turns
from devcad.geometry.taylor import Array

NEWTON_STEPS = 5  # from a table as fine as the nodes: errors 1/8, 1/128, 3e-5, 5e-10, 1e-19


@dataclass(frozen=True, slots=True)
class _Uniform:
    """A smooth curve whose parameter is proportional to its length."""

    curve: Curve
    knots: Array  # (m + 1,) parameters: ends and breaks
    lengths: Array  # (m + 1,) from the start to the knots

    def jet(self, span: Array, s: Array, order: int) -> Array:
        """The Taylor coefficients in the length, s (n,) after knot ``span``."""
        low, high = self.knots[span], self.knots[span + 1]
        rate = (high - low) / (self.lengths[span + 1] - self.lengths[span])
        t = np.minimum(low + s * rate, np.nextafter(high, low))
        powers = rate ** np.arange(order + 1)[:, None]
        return np.asarray(self.curve.jet(t, order) * powers[..., None])


@dataclass(frozen=True, slots=True)
class _Measured:
    """A smooth curve with its length as a function of its parameter, to be inverted."""

    curve: Curve
    knots: Array
    lengths: Array
    length_speed: Piecewise  # two columns
    table_t: Array  # increasing, knots included
    table_s: Array

    def jet(self, span: Array, s: Array, order: int) -> Array:
        """The Taylor coefficients in the length, s (n,) after knot ``span``."""
        t = self._parameter(span, self.lengths[span] + s)
        jet = self.curve.jet(t, order)
        if order == 0:
            return jet
        speed = taylor.norm(taylor.derivative(jet))
        step = taylor.invert(taylor.integral(np.zeros(len(t)), speed))
        return taylor.compose(jet, step)

    def _parameter(self, span: Array, s: Array) -> Array:
        """The parameters at the lengths s (n,), by Newton steps kept inside the table's cell."""
        cell = np.clip(np.searchsorted(self.table_s, s, side="right") - 1, 0, len(self.table_s) - 2)
        low = np.maximum(self.table_t[cell], self.knots[span])
        high = np.minimum(self.table_t[cell + 1], np.nextafter(self.knots[span + 1], -np.inf))
        t = np.clip(np.interp(s, self.table_s, self.table_t), low, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            for _ in range(NEWTON_STEPS):
                length, speed = self.length_speed(t).T
                step = (length - s) / speed
                t = np.clip(np.where(np.isfinite(step), t - step, t), low, high)
        return t


_Link = _Uniform | _Measured


def chain(curves: Sequence[Curve], uniform: Sequence[bool], *, gap: float, closed: bool) -> Curve:
    """The curves end to end; the parameter is the fraction of the total length, [0, 1].

    Curves flagged ``uniform`` have parameters proportional to their length and keep their exact
    form; the others are measured and inverted to rounding. A curve that starts within ``gap`` of
    where the one before ends is moved there.

    Raises:
        JobError: a curve starts elsewhere, or a closed chain ends elsewhere than it starts.
    """
    _check_gaps(curves, gap, closed)
    links: list[_Link] = []
    shifts: list[Array] = []
    at: Array | None = None
    for curve, even in zip(curves, uniform, strict=True):
        start, end = curve.point(np.array(curve.domain))
        shift = np.zeros(3) if at is None else at - start
        at = end + shift
        for piece in curve.pieces():
            links.append(_uniform(piece) if even else _measured(piece))
            shifts.append(shift)
    return _assembled(links, shifts, closed)


def _check_gaps(curves: Sequence[Curve], gap: float, closed: bool) -> None:
    ends = [curve.point(np.array(curve.domain)) for curve in curves]
    pairs = list(zip(range(len(ends)), range(1, len(ends)), strict=False))
    for i, j in [*pairs, (len(ends) - 1, 0)] if closed else pairs:
        distance = float(np.linalg.norm(ends[j][0] - ends[i][1]))
        if not distance <= gap:
            raise JobError(
                f"curve {j} (counted from 0) starts {distance:.6g} from the end of curve {i},"
                f" limit {gap:.3g}",
                value=distance,
                limit=gap,
                remedy="make them meet, or turn one round",
            )


def _knots(curve: Curve) -> Array:
    return np.array([curve.domain[0], *curve.breaks, curve.domain[1]])


def _uniform(curve: Curve) -> _Uniform:
    knots = _knots(curve)
    middle = np.array([0.5 * (knots[0] + knots[-1])])
    speed = np.linalg.norm(curve.jet(middle, 1)[1])
    return _Uniform(curve, knots, speed * (knots - knots[0]))


def _measured(curve: Curve) -> _Measured:
    knots = _knots(curve)

    def of_speed(t: Array) -> Array:
        return np.asarray(np.linalg.norm(curve.jet(t, 1)[1], axis=1))[:, None]

    speed = resolve(of_speed, knots)
    length = speed.antiderivative()
    padded = np.pad(speed.coefficients, ((0, 0), (0, 1), (0, 0)))
    both = Piecewise(speed.knots, np.concatenate([length.coefficients, padded], axis=2))
    cells = length.coefficients.shape[1]
    table = speed.knots[:-1, None] + np.diff(speed.knots)[:, None] * (np.arange(cells) / cells)
    table_t = np.append(table.ravel(), speed.knots[-1])
    lengths = length(knots)[:, 0]
    if not (np.isfinite(lengths).all() and (np.diff(lengths) > 0.0).all()):
        raise JobError(
            "a curve of a chain has no length that grows with its parameter",
            value=float(lengths[-1]),
            remedy="its expressions must be finite and must not stand still",
        )
    return _Measured(curve, knots, lengths, both, table_t, length(table_t)[:, 0])


def _assembled(links: list[_Link], shifts: list[Array], closed: bool) -> Curve:
    """One curve from the links in order."""
    ends = np.cumsum([link.lengths[-1] for link in links])
    total = float(ends[-1])
    before = np.concatenate([[0.0], ends[:-1]])
    starts = (
        np.concatenate([b + link.lengths[:-1] for b, link in zip(before, links, strict=True)])
        / total
    )  # every span of every link
    owner = np.concatenate([np.full(len(link.knots) - 1, i) for i, link in enumerate(links)])
    span = np.concatenate([np.arange(len(link.knots) - 1) for link in links])

    def jet(t: Array, order: int) -> Array:
        out = np.zeros((order + 1, len(t), 3))
        row = np.clip(np.searchsorted(starts, t, side="right") - 1, 0, len(starts) - 1)
        for i in np.unique(owner[row]):
            here = np.flatnonzero(owner[row] == i)
            s = (t[here] - starts[row[here]]) * total
            out[:, here] = links[i].jet(span[row[here]], np.maximum(s, 0.0), order)
            out[0, here] += shifts[i]
        return out * total ** np.arange(order + 1)[:, None, None]

    curve = Curve(jet, (0.0, 1.0))
    inner = np.flatnonzero(span == 0)[1:]
    corner = np.zeros(len(starts), dtype=bool)
    if inner.size:
        corner[inner] = turns(curve, starts[inner]) > SAME_DIRECTION
    smooth = ~corner
    smooth[0] = False
    curve = replace(
        curve, breaks=tuple(starts[smooth].tolist()), corners=tuple(starts[corner].tolist())
    )
    return replace(curve, closed=closed or ends_meet(curve))
