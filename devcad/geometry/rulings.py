"""Certified placement of rulings: as few as the tolerance allows, and never one fewer.

Between two rulings the surface is replaced by two triangles. Along a ruling nothing is lost, so
the distance to the surface is largest on the boundary: the sagitta of the rails (the two ends
of the extent, on every layer of a thick sheet) over their chords, which holds the bending of
the surface and the turning of the boundary within it, plus a quarter of what the four corners
miss of one plane. Rulings are placed at equal integrals of the density that makes the sagitta
constant; then the distance is measured, and their number is the smallest that keeps it.

Source: algorithms.md, 3; sagitta of an arc of length s and curvature k: k s^2 / 8.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from devcad.errors import LimitError
from devcad.geometry import taylor
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

TURN = np.radians(30.0)
"""Largest turning of the normal, or of the ruling in the sheet, across one strip."""
MOST = 200_000
"""Rulings of one segment that nobody can mean."""
USED = 0.998
"""Share of the tolerance that placement aims at; the rest covers sampling between points."""
INNER = np.arange(1, 12) / 12
"""Where a strip's deviation is measured, in shares of its parameter."""
GRID = 129
"""Density samples on one smooth segment."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Increasing parameters of the rulings, ends included, and the certified distance in mm."""

    t: Array
    deviation: float


def place(patch: Patch, layers: tuple[float, ...], tolerance: float) -> Placement:
    """The fewest rulings whose triangles stay within ``tolerance`` (mm) of every layer.

    ``layers`` are the distances along n of the surfaces to be meshed. Rulings break where the
    surface's curvature jumps; at smoother breaks they need not. At most 30 degrees of turning
    lie in one strip. Source: algorithms.md, 3.

    Raises:
        LimitError: more rulings than a part can have.
    """
    ends = _segments(patch, layers)
    pieces = [
        _place_segment(patch, layers, low, high, tolerance)
        for low, high in itertools.pairwise(ends)
    ]
    t = np.concatenate([*(piece.t[:-1] for piece in pieces), ends[-1:]])
    return Placement(t, max(piece.deviation for piece in pieces))


def strip_deviation(patch: Patch, layers: tuple[float, ...], t: Array) -> Array:
    """The certified distance between the patch and the triangles of each strip, (n - 1,).

    The largest distance of a rail to its chord, looked at 11 times a strip, plus a quarter of
    the strip's departure from a plane (half the distance of its diagonals' middles).
    """
    low, high = t[:-1], t[1:]
    inner = low[:, None] + (high - low)[:, None] * INNER
    corners = _rails(patch, layers, t)  # (rails, n, 3)
    curves = _rails(patch, layers, inner.ravel()).reshape(len(corners), len(low), len(INNER), 3)
    start = corners[:, :-1, None]
    chord = corners[:, 1:, None] - start
    length = np.maximum((chord**2).sum(axis=-1, keepdims=True), 1e-300)
    away = curves - start
    share = np.clip((away * chord).sum(axis=-1, keepdims=True) / length, 0.0, 1.0)
    sagitta = np.linalg.norm(away - share * chord, axis=-1).max(axis=(0, 2))
    half = len(corners) // 2
    skew = corners[:half, :-1] + corners[half:, 1:] - corners[half:, :-1] - corners[:half, 1:]
    normal = patch.frame(0.5 * (low + high)).n
    flatness = np.abs(np.einsum("rni,ni->rn", skew, normal)).max(axis=0)
    return np.asarray(sagitta + 0.25 * flatness)


def _rails(patch: Patch, layers: tuple[float, ...], t: Array) -> Array:
    """The rails at t, (2 * layers, n, 3): first all layers' v_from ends, then the v_to ends."""
    if layers == (0.0,):
        jet = patch.jet(t, 0)
        c0, e, v = jet.c0[0], jet.e[0], (jet.v_from[0], jet.v_to[0])
        return np.asarray(np.stack([c0 + v[0][:, None] * e, c0 + v[1][:, None] * e]))
    frame = patch.frame(t)
    return np.stack(
        [
            frame.c0 + v[:, None] * frame.e + d * frame.n
            for v in (frame.v_from, frame.v_to)
            for d in layers
        ]
    )


def _density(patch: Patch, layers: tuple[float, ...], t: Array, tolerance: float) -> Array:
    """Strips per unit of t that the tolerance and the turning ask for, (n,)."""
    jet = patch.frame_jet(t, 2)
    sagitta = np.zeros(len(t))
    for v in (jet.ruling.v_from, jet.ruling.v_to):
        rail = jet.ruling.rail(v)
        for d in layers:
            curve = rail + d * jet.n
            first, second = curve[1], 2.0 * curve[2]
            length = (first**2).sum(axis=1)
            along = (first * second).sum(axis=1) / np.maximum(length, 1e-300)
            across = second - np.where(length > 0.0, along, 0.0)[:, None] * first
            sagitta = np.maximum(sagitta, np.linalg.norm(across, axis=1))
    density = np.sqrt(sagitta / (8.0 * USED * tolerance))
    return np.asarray(np.maximum(density, np.hypot(jet.a[0], jet.c[0]) / TURN))


def _place_segment(
    patch: Patch, layers: tuple[float, ...], low: float, high: float, tolerance: float
) -> Placement:
    """Rulings on one segment: the smallest number that keeps the tolerance."""
    grid = np.linspace(low, high, GRID)
    inside = 0.5 * (grid[1:] + grid[:-1])
    weight = np.maximum(_density(patch, layers, inside, tolerance), 0.0) * np.diff(grid)
    # a floor keeps the parameters increasing where nothing bends
    total = weight.sum()
    weight = weight + 1e-6 * max(total, 1e-12) / GRID
    cumulative = np.concatenate([[0.0], np.cumsum(weight)])
    fewest = max(1, int(np.ceil(_turning(patch, low, high) / TURN - 1e-9)))

    def at(number: int) -> Placement:
        t = np.interp(np.linspace(0.0, cumulative[-1], number + 1), cumulative, grid)
        t[0], t[-1] = low, high
        return Placement(t, float(strip_deviation(patch, layers, t).max()))

    if max(fewest, total) > MOST:
        raise LimitError(
            f"the tolerance of {tolerance:.6g} mm asks for {max(fewest, total):.6g} rulings, "
            f"limit {MOST}",
            value=float(max(fewest, total)),
            limit=float(MOST),
            remedy="raise the tolerance; is the part in the right units?",
        )
    number = max(fewest, int(np.ceil(total - 1e-9)))
    best: Placement | None = None
    floor = fewest
    for _ in range(24):
        trial = at(number)
        if trial.deviation <= USED * tolerance:
            best = trial
            guess = int(np.ceil(number * np.sqrt(trial.deviation / (USED * tolerance))))
            following = max(floor, min(number - 1, guess))
        else:
            floor = number + 1
            ratio = np.sqrt(trial.deviation / (USED * tolerance))
            following = max(floor, int(np.ceil(number * min(ratio, 4.0))))
            if best is not None:
                following = min(following, len(best.t) - 2)
        if following < floor or (best is not None and following >= len(best.t) - 1):
            break
        number = following
    return best if best is not None else trial


def _turning(patch: Patch, low: float, high: float) -> float:
    """The turning of the frame over a segment in radians."""
    t = low + (high - low) * (np.arange(64) + 0.5) / 64
    frame = patch.frame(t)
    return float(np.hypot(frame.a, frame.c).mean() * (high - low))


def _segments(patch: Patch, layers: tuple[float, ...]) -> Array:
    """The domain's ends and those breaks where the rails' curvature jumps."""
    ends = patch.segments
    if len(ends) == 2:
        return ends
    breaks = ends[1:-1]
    span = ends[-1] - ends[0]
    before = _second(patch, layers, breaks - 1e-9 * span)
    after = _second(patch, layers, breaks + 1e-9 * span)
    size = np.maximum(np.abs(before), np.abs(after)).max()
    jumps = np.abs(after - before).max(axis=(0, 2)) > 1e-4 * size
    return np.concatenate([ends[:1], breaks[jumps], ends[-1:]])


def _second(patch: Patch, layers: tuple[float, ...], t: Array) -> Array:
    """The rails' second derivatives at t, (rails, n, 3)."""
    jet = patch.frame_jet(t, 2)
    return np.stack(
        [
            taylor.derivative(taylor.derivative(jet.ruling.rail(v) + d * jet.n))[0]
            for v in (jet.ruling.v_from, jet.ruling.v_to)
            for d in layers
        ]
    )
