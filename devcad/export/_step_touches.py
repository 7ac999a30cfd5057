"""Where cuts touch the end of a strip without crossing it.

A corner on a ruling is a vertex of the ruling, too. A contour that is tangent to the ruling would
run along it within what the kernels tell apart for a thousandth of a millimetre, which none of
their intersections survives: it is kept off by a hair instead.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from devcad.export._step_places import Ground
from devcad.geometry.cells import Run
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.cuts import Cut

HAIR, SHARE, LEAST = 2e-5, 0.25, 1e-6
"""mm that a contour stays off a ruling that it is tangent to, twice what CAD systems tell apart;
less, a share of the tolerance, where this is fine, but ten times what the kernel tells apart."""
BESIDE = 1e-3
"""Of a strip's span in t: only as near to its ends a touch is looked for."""
TANGENT = 1e-3
"""Largest slope against the ruling, mm a mm, of a contour that is tangent to it."""
TURNS = np.linspace(0.0, 1.0, 65)
HALVINGS = 50


def hair(tolerance: float) -> float:
    """How far a contour stays off a ruling that it is tangent to, mm."""
    return min(HAIR, max(SHARE * tolerance, LEAST))


def turns(ground: Ground, series: Piecewise, low: float, high: float) -> list[float]:
    """Where strictly between two parameters of a track t turns back next to an end of the strip."""
    if not _near(ground, series):
        return []
    found = [_extreme(ground, series, low, high, end) for end in (0, 1)]
    return sorted(u for u, inside in found if inside)


def drift(ground: Ground, cuts: Sequence[Cut], run: Run) -> tuple[float, float]:
    """What is added to t along a closed run, a + b t, so that it stays off the strip's ends."""
    if run.first is not None:
        return 0.0, 0.0
    tracks = [(cuts[p.cut].tracks[p.track].series, *p.u) for p in run.pieces]
    if not any(_near(ground, series) for series, _, _ in tracks):
        return 0.0, 0.0
    found = [_kept_off(ground, tracks, end) for end in (0, 1)]
    (first, up), (last, down) = found
    if not (up and down):
        return up + down, 0.0
    b = (down - up) / (last - first)
    return up - b * first, b


def _kept_off(
    ground: Ground, tracks: list[tuple[Piecewise, float, float]], end: int
) -> tuple[float, float]:
    """The extreme of t on a contour towards an end of the strip, and by how much t is to change
    there; not at all where a corner or a whole side touches."""
    strip, sign = ground.skin.strip, 1.0 - 2.0 * end
    places = [_extreme(ground, series, low, high, end)[0] for series, low, high in tracks]
    at = np.array([s(np.array([u]))[0] for (s, _, _), u in zip(tracks, places, strict=True)])
    k = int(np.argmin(sign * at[:, 0]))
    t, v = at[k].tolist()
    f = strip.patch.frame(strip.ends[[end]])
    pace = abs(float(f.q[0] + v * f.a[0]))
    away = sign * (t - float(strip.ends[end])) * pace
    if not away < ground.hair:
        return t, 0.0
    for i in np.flatnonzero(np.abs(at[:, 0] - t) * pace <= ground.hair).tolist():
        series, low, high = tracks[i]
        if np.ptp(series(low + (high - low) * TURNS)[:, 0]) * pace <= ground.hair:
            return t, 0.0  # it runs along the ruling
        slope = series.derivative()(np.array([places[i]]))[0]
        if abs(slope[0]) * pace > TANGENT * abs(slope[1]):
            return t, 0.0
    return t, sign * (ground.hair - away) / pace


def _near(ground: Ground, series: Piecewise) -> bool:
    """Whether a track may come near an end of the strip, by the size of its coefficients."""
    start, end = ground.skin.strip.ends
    reach = np.abs(series.coefficients[:, 1:, 0]).sum(axis=1) + BESIDE * (end - start)
    middle = series.coefficients[:, 0, 0]
    return bool((np.minimum(np.abs(middle - start), np.abs(middle - end)) <= reach).any())


def _extreme(
    ground: Ground, series: Piecewise, low: float, high: float, end: int
) -> tuple[float, bool]:
    """Where between two parameters of a track t comes nearest to an end of the strip, and whether
    it turns back there beside the end, strictly between them."""
    sign, border = 1.0 - 2.0 * end, float(ground.skin.strip.ends[end])
    places = low + (high - low) * TURNS
    t = series(places)[:, 0]
    k = int(np.argmin(sign * t))
    if not 0 < k < len(t) - 1:
        return float(places[k]), False
    step = float(np.abs(t[[k - 1, k + 1]] - t[k]).max())
    span = float(np.ptp(ground.skin.strip.ends))
    if abs(t[k] - border) > step + BESIDE * span:
        return float(places[k]), False
    slope, (a, b) = series.derivative(), places[[k - 1, k + 1]].tolist()
    for _ in range(HALVINGS):
        middle = 0.5 * (a + b)
        if sign * float(slope(np.array([middle]))[0, 0]) < 0.0:
            a = middle
        else:
            b = middle
    at = 0.5 * (a + b)
    beside = abs(float(series(np.array([at]))[0, 0]) - border) <= BESIDE * span
    return at, beside and low < at < high
