"""Deflation: the normal where the whole ruling is singular, at an end of the domain.

At a tip where c0' runs along e, or where everything stands still, e x P_t vanishes along the
ruling and the normal is only a limit. There N(t) = e x P_t, taken at a fixed share of the extent,
is divided by the power of t - end with which it vanishes: what is left, W, has the normal's
direction up to the end and beyond rounding. Near the end W is its own Taylor series, so that
nothing is divided by a small number.

Source: l'Hopital's rule; the sheet's orientation is N's own inside the domain.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.taylor import Array

if TYPE_CHECKING:
    from devcad.geometry.patch import RulingJet

VANISHES = 1e-9
"""N at an end counts as zero below this share of its largest value."""
SHARES = (0.5, 0.625)
"""Where on the ruling N is taken: half way, or beside it where that is the singular point."""
TERMS = 20
"""Terms of W beyond those asked for: at an eighth of its radius of convergence, 8^-20 is left."""
RADIUS = 0.125
"""Share of the radius of convergence in which W is its Taylor series."""
STEP = 8
"""Series are kept for orders in these steps."""
MOST = 8
"""The largest power with which N may vanish."""
AGREE = 1e-9
"""How closely the series and N over its power agree where both are good."""
POINTS = 10
"""Values that W goes through where its series is noise: 40^-10 is left at a tenth of the room."""
INTERPOLATED = (0.1, 0.03, 0.01)
"""Reaches of such an interpolation, in shares of the distance to the next break."""


@dataclass(frozen=True, slots=True)
class Deflated:
    """The end ``t`` of a domain, W's Taylor coefficients there (J, 3), and the distance ``reach``
    from the end within which they give W to rounding."""

    t: float
    coefficients: Array
    reach: float

    def near(self, t: Array) -> Array:
        """Which of the parameters t (n,) lie within reach, (n,) bool."""
        return np.asarray(np.abs(t - self.t) <= self.reach)

    def series(self, t: Array, order: int) -> Array:
        """The Taylor series of W at t (n,) within reach, (order + 1, n, 3)."""
        step = (t - self.t)[:, None]
        table = np.repeat(self.coefficients[:, None], t.size, axis=1)
        for k in range(order + 1):  # Horner's rule again and again: the Taylor shift
            for j in range(len(table) - 2, k - 1, -1):
                table[j] += step * table[j + 1]
        return np.asarray(table[: order + 1])


def deflated(
    field: Callable[[Array, int], RulingJet], segments: tuple[float, ...], order: int
) -> tuple[Deflated, ...]:
    """The ends of the domain at which N vanishes, for series of W up to ``order``.

    ``segments`` are the domain's ends with the breaks between. Almost always there are none.
    """
    which = vanishing(field, segments[0], segments[-1])
    if not any(which):
        return ()
    return _expanded(field, segments, which, STEP * (order // STEP + 1))


@lru_cache(maxsize=512)
def vanishing(
    field: Callable[[Array, int], RulingJet], low: float, high: float
) -> tuple[bool, bool]:
    """Whether N vanishes at the start and at the end of the domain, at both shares: the whole
    ruling is singular there."""
    jet = field(np.array([low, high, *(low + (high - low) * np.arange(1, 8) / 8.0)]), 1)
    size = np.max([np.linalg.norm(_normal(jet, share)[0], axis=1) for share in SHARES], axis=0)
    small = size[:2] <= VANISHES * size[2:].max()
    return bool(small[0]), bool(small[1])


@lru_cache(maxsize=64)
def _expanded(
    field: Callable[[Array, int], RulingJet],
    segments: tuple[float, ...],
    which: tuple[bool, bool],
    order: int,
) -> tuple[Deflated, ...]:
    found = []
    for end, inward in ((0, 1), (-1, -2)):
        if which[end]:
            room = abs(segments[inward] - segments[end])
            found.append(_at_end(field, segments[end], room, order, start=end == 0))
    return tuple(w for w in found if w is not None)


def _at_end(
    field: Callable[[Array, int], RulingJet], t: float, room: float, order: int, *, start: bool
) -> Deflated | None:
    """W at one end; ``room`` is the distance to the next break. None where N is zero throughout.

    By the Taylor series of N if it agrees with N itself; where derivatives of high order are
    noise, by interpolation of N over the power of t - end.
    """
    share, power = _power(field, t, room)
    if power > MOST:
        return None
    jet = field(np.array([t]), order + TERMS + power + 1)
    kept = _normal(jet, share)[power:, 0]
    if not start and power % 2:
        kept = -kept  # t - end is negative inside
    size = np.linalg.norm(kept, axis=1)
    with np.errstate(divide="ignore"):
        ratios = (size[0] / size[1:]) ** (1.0 / np.arange(1, len(size)))
    exact = Deflated(t, kept, min(RADIUS * float(ratios.min()), 0.5 * room))
    if _disagrees(field, exact, share, power, start=start) <= AGREE:
        return exact
    tries = [
        _interpolated(field, t, room * reach, (order, share, power), start=start)
        for reach in INTERPOLATED
    ]
    return min(tries, key=lambda w: _disagrees(field, w, share, power, start=start))


def _power(field: Callable[[Array, int], RulingJet], t: float, room: float) -> tuple[float, int]:
    """The share of the extent at which N vanishes least, and the power with which it does."""
    jet = field(np.array([t]), MOST + 2)
    best = SHARES[0], MOST + 1
    for share in SHARES:
        weight = np.linalg.norm(_normal(jet, share)[:, 0], axis=1) * room ** np.arange(MOST + 2)
        there = np.flatnonzero(weight > VANISHES * weight[: MOST // 2].max())
        if len(there) and there[0] < best[1]:
            best = share, int(there[0])
    return best


def _quotient(
    field: Callable[[Array, int], RulingJet], t: float, h: Array, share: float, power: int
) -> tuple[Array, Array]:
    """N / |t - end|^power at t + h, h (n,) signed, and its derivative, each (n, 3)."""
    normal = _normal(field(t + h, 2), share)
    value = normal[0] / np.abs(h)[:, None] ** power
    slope = normal[1] / np.abs(h)[:, None] ** power - power * value / h[:, None]
    return value, slope


def _disagrees(
    field: Callable[[Array, int], RulingJet], w: Deflated, share: float, power: int, *, start: bool
) -> float:
    """How far W and its derivative are off the quotient's, relative, at places within reach."""
    h = w.reach * np.array([0.37, 0.71, 0.93]) * (1.0 if start else -1.0)
    value, slope = _quotient(field, w.t, h, share, power)
    found = w.series(w.t + h, 1)
    size = float(np.linalg.norm(value, axis=1).max())
    off = np.abs(found[0] - value).max(), w.reach * np.abs(found[1] - slope).max()
    return float(max(off) / size) if size > 0.0 else np.inf


def _interpolated(
    field: Callable[[Array, int], RulingJet],
    t: float,
    reach: float,
    form: tuple[int, float, int],
    *,
    start: bool,
) -> Deflated:
    """W through its values at Chebyshev points of the first kind, which spare the end itself."""
    order, share, power = form
    nodes = np.sin((np.arange(POINTS) + 0.5) * (0.25 * np.pi / POINTS) * 2.0) ** 2
    side = 1.0 if start else -1.0
    value, _ = _quotient(field, t, side * reach * nodes, share, power)
    powers = np.linalg.solve(np.vander(nodes, increasing=True), value)
    table = np.zeros((max(order + 1, POINTS), 3))
    table[:POINTS] = powers / (side * reach) ** np.arange(POINTS)[:, None]
    return Deflated(t, table, reach)


def _normal(jet: RulingJet, share: float) -> Array:
    """The series of e x P_t at a share of the extent, of one order less than the jet."""
    v = (1.0 - share) * jet.v_from + share * jet.v_to
    order = len(jet.e) - 1
    tangent = taylor.derivative(jet.c0) + taylor.mul(v[:order], taylor.derivative(jet.e))
    return taylor.cross(jet.e[:order], tangent)
