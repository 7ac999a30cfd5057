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
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from devcad.errors import LimitError
from devcad.geometry import taylor
from devcad.geometry.classify import panels
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

if TYPE_CHECKING:  # only thick sheets with creases have one
    from devcad.geometry.pull import Pull

TURN = np.radians(30.0)
"""Largest turning of the normal, or of the ruling in the sheet, across one strip."""
MOST = 200_000
"""Rulings of one segment that nobody can mean."""
USED = 0.998
"""Share of the tolerance that placement aims at; the rest covers sampling between points."""
INNER = np.arange(1, 12) / 12
"""Where a strip's deviation is measured, in shares of its parameter."""
MANY, SPENT = 16, 0.86
"""A patch of this many strips is to use this share of its tolerance."""
HALVINGS = 40
"""Rounds of halving strips that are too coarse on another patch, at most."""
GRID = 129
"""Density samples on one panel of the patch."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Increasing parameters of the rulings, ends included, and the certified distance in mm."""

    t: Array
    deviation: float


def place(
    patch: Patch, layers: tuple[float, ...], tolerance: float, pull: Pull | None = None
) -> Placement:
    """The fewest rulings whose triangles stay within ``tolerance`` (mm) of every layer.

    ``layers`` are the distances along n of the surfaces to be meshed, ``pull`` what draws their
    edges to the mitres of creases. Rulings break where the
    surface's curvature jumps; at smoother breaks they need not. At most 30 degrees of turning
    lie in one strip. Strips of a segment are equal in their distance to the surface; only where
    breaks leave a patch of 16 strips far below its tolerance, one segment is filled from its
    start, so that the tolerance is what the mesh really has. Source: algorithms.md, 3.

    Raises:
        LimitError: more rulings than a part can have.
    """
    ends = _segments(patch, layers)
    if pull is not None:
        ends = np.unique(np.concatenate([ends, pull.breaks]))
    segments = [
        _Segment(patch, layers, low, high, tolerance, pull)
        for low, high in itertools.pairwise(ends)
    ]
    pieces = [segment.fewest() for segment in segments]
    if sum(len(piece.t) - 1 for piece in pieces) >= MANY:
        worst = max(piece.deviation for piece in pieces)
        most = max(range(len(pieces)), key=lambda k: len(pieces[k].t))
        if worst < SPENT * tolerance and len(pieces[most].t) > 2:
            pieces[most] = segments[most].spent(len(pieces[most].t) - 1)
    t = np.concatenate([*(piece.t[:-1] for piece in pieces), ends[-1:]])
    return Placement(t, max(piece.deviation for piece in pieces))


def place_together(patches: Sequence[Patch], layers: tuple[float, ...], tolerance: float) -> Array:
    """Rulings (n,) of patches that share their parameter, within ``tolerance`` (mm) on all: those
    of the patch that needs most of them, and more where another one does."""
    t = max((place(patch, layers, tolerance).t for patch in patches), key=len)
    for _ in range(HALVINGS):
        coarse = np.zeros(len(t) - 1, dtype=bool)
        for patch in patches:
            coarse |= strip_deviation(patch, layers, t) > tolerance
            frame = patch.frame(
                np.concatenate([[np.nextafter(t[0], t[1])], t[1:-1], [np.nextafter(t[-1], t[-2])]])
            )
            for axis in (frame.n, frame.e):
                coarse |= taylor.rows_dot(axis[:-1], axis[1:]) < np.cos(1.01 * TURN)
        if not coarse.any():
            break
        t = np.sort(np.concatenate([t, 0.5 * (t[:-1] + t[1:])[coarse]]))
    return t


def strip_deviation(
    patch: Patch, layers: tuple[float, ...], t: Array, pull: Pull | None = None
) -> Array:
    """The certified distance between the patch and the triangles of each strip, (n - 1,).

    The largest distance of a rail to its chord, looked at 11 times a strip, plus a quarter of
    the strip's departure from a plane (half the distance of its diagonals' middles), or of a
    wall's that leans because of a ``pull``.
    """
    low, high = t[:-1], t[1:]
    inner = low[:, None] + (high - low)[:, None] * INNER
    corners = _rails(patch, layers, t, pull)  # (rails, n, 3)
    curves = _rails(patch, layers, inner.ravel(), pull)
    curves = curves.reshape(len(corners), len(low), len(INNER), 3)
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
    if pull is not None:
        flatness = np.maximum(flatness, _leaning(corners, normal))
    return np.asarray(sagitta + 0.25 * flatness)


def _leaning(corners: Array, normal: Array) -> Array:
    """How far the walls between the outer layers' edges (rails, n, 3) are from plane, strip by
    strip, (n - 1,)."""
    half = len(corners) // 2
    worst = np.zeros(len(normal))
    for low, high in ((corners[0], corners[half - 1]), (corners[half], corners[-1])):
        chord = np.diff(low + high, axis=0)
        across = taylor.rows_cross(chord, normal)
        size = np.maximum(np.linalg.norm(across, axis=1), 1e-300)
        skew = np.abs(taylor.rows_dot(np.diff(high - low, axis=0), across)) / size
        worst = np.maximum(worst, skew)
    return worst


def _rails(patch: Patch, layers: tuple[float, ...], t: Array, pull: Pull | None = None) -> Array:
    """The rails at t, (2 * layers, n, 3): first all layers' v_from ends, then the v_to ends."""
    if layers == (0.0,):
        jet = patch.jet(t, 0)
        c0, e, v = jet.c0[0], jet.e[0], (jet.v_from[0], jet.v_to[0])
        return np.asarray(np.stack([c0 + v[0][:, None] * e, c0 + v[1][:, None] * e]))
    frame = patch.frame(t)
    rails = np.stack(
        [
            frame.c0 + v[:, None] * frame.e + d * frame.n
            for v in (frame.v_from, frame.v_to)
            for d in layers
        ]
    )
    if pull is not None:
        shifts = pull.rails(t)
        rails += np.stack([d * shifts[:, side] for side in (0, 1) for d in layers])
    return rails


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


class _Segment:
    """One segment between forced rulings, and how rulings can be laid on it."""

    def __init__(
        self,
        patch: Patch,
        layers: tuple[float, ...],
        low: float,
        high: float,
        tolerance: float,
        pull: Pull | None = None,
    ) -> None:
        self.patch, self.layers, self.aim, self.pull = patch, layers, USED * tolerance, pull
        inner = [x for x in panels(patch) if low < x < high]
        pieces = itertools.pairwise([low, *inner, high])
        starts = [np.linspace(a, b, GRID)[:-1] for a, b in pieces]
        self.grid = np.concatenate([*starts, [high]])
        inside = 0.5 * (self.grid[1:] + self.grid[:-1])
        step = np.diff(self.grid)
        weight = np.maximum(_density(patch, layers, inside, tolerance), 0.0) * step
        self.total = float(weight.sum())
        # a floor keeps the parameters increasing where nothing bends
        weight = weight + 1e-6 * max(self.total, 1e-12) / len(weight)
        self.density = np.concatenate([[0.0], np.cumsum(weight)])
        frame = patch.frame(inside)
        turning = np.hypot(frame.a, frame.c) * step
        self.turned = np.concatenate([[0.0], np.cumsum(turning)])
        if self.total > MOST:
            raise self._too_many(self.total)

    def _too_many(self, number: float) -> LimitError:
        return LimitError(
            f"the tolerance of {self.aim / USED:.6g} mm asks for {number:.6g} rulings, "
            f"limit {MOST}",
            value=float(number),
            limit=float(MOST),
            remedy="raise the tolerance; is the part in the right units?",
        )

    def laid(self, number: float) -> tuple[Placement, float]:
        """Strips of equal density, ``number`` of them (a fraction makes the last one smaller),
        and by what factor their number is too small for the tolerance and the turning."""
        share = np.append(np.arange(np.ceil(number - 1e-9)) / number, 1.0)
        t = np.interp(share * self.density[-1], self.density, self.grid)
        t[0], t[-1] = self.grid[0], self.grid[-1]
        away = strip_deviation(self.patch, self.layers, t, self.pull)
        placed = Placement(t, float(away.max()))
        turn = float(np.diff(np.interp(t, self.grid, self.turned)).max())
        # twelve strips of 30 degrees go round, whatever the rounding of their sum
        return placed, max(np.sqrt(placed.deviation / self.aim), turn / TURN * (1.0 - 1e-9))

    def fewest(self) -> Placement:
        """The smallest number of equal strips that keeps the tolerance and the turning."""
        number = max(1, int(np.ceil(self.total - 1e-9)))
        best: Placement | None = None
        floor = 1
        for _ in range(24):
            trial, short = self.laid(number)
            if short <= 1.0:
                best = trial
                following = max(floor, min(number - 1, int(np.ceil(number * short))))
            else:
                floor = number + 1
                following = max(floor, int(np.ceil(number * min(short, 4.0))))
                if best is not None:
                    following = min(following, len(best.t) - 2)
            if following < floor or (best is not None and following >= len(best.t) - 1):
                break
            number = following
            if number > MOST:
                raise self._too_many(number)
        return best if best is not None else trial

    def spent(self, number: int) -> Placement:
        """As many strips, all but the last as large as the tolerance and the turning allow."""
        low, high = number - 1.0, float(number)
        for _ in range(24):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if self.laid(middle)[1] <= 1.0 else (middle, high)
        return self.laid(high)[0]


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
