"""Reference lines on laid sheets: rulings to bend along, and bends where a sheet has a crease."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from devcad.flatten.pattern import Line
from devcad.flatten.sheets import Laid
from devcad.geometry.cuts import Track
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

SMOOTH = np.radians(0.01)
"""Tangent planes that differ by less along a line are one there."""
LINE_EVERY = np.radians(15.0)
"""A reference ruling is drawn after this much bending: none on a plane."""
STEPS = 32
"""Steps on one polynomial of an edge between which it is seen to cross a ruling."""
HALVINGS = 30
"""Halvings towards such a crossing."""


def joint_line(start: Array, end: Array, angle: float) -> Line:
    """The line between two sheets that meet under an angle (radians, positive towards the
    front): a ruling where they are tangential, else a bend."""
    if abs(angle) <= SMOOTH:
        return Line("RULING", start, end)
    return Line("BEND_UP" if angle > 0.0 else "BEND_DOWN", start, end, angle)


def creases(patch: Patch) -> tuple[Array, Array]:
    """The breaks of a patch at which its tangent plane jumps, and by how much, (k,) each."""
    at = np.array(patch.breaks)
    if not at.size:
        return at, at
    before, after = patch.frame(np.nextafter(at, -np.inf)), patch.frame(np.nextafter(at, np.inf))
    sine = np.einsum("ij,ij->i", np.cross(before.n, after.n), after.e)
    angle = np.arctan2(sine, np.einsum("ij,ij->i", before.n, after.n))
    folds = np.abs(angle) > SMOOTH
    return at[folds], angle[folds]


def reference_lines(laid: Laid) -> list[Line]:
    """The creases of a sheet, and a ruling for every 15 degrees of bending, as far as they lie on
    the sheet."""
    bends, angles = creases(laid.sheet.patch)
    rulings = _rulings(laid)
    at, angle = np.append(bends, rulings), np.append(angles, np.zeros(rulings.size))
    if not at.size:
        return []
    crossings = [_crossings(side.track, at) for loop in laid.sheet.loops for side in loop]
    out = []
    for k, (ruling, fold) in enumerate(zip(at.tolist(), angle.tolist(), strict=True)):
        v = np.sort(np.concatenate([found[which == k] for which, found in crossings]))
        for low, high in zip(v[::2].tolist(), v[1::2].tolist(), strict=False):
            start, end = laid.development.points(np.full(2, ruling), np.array([low, high]))
            out.append(joint_line(start, end, fold))
    return out


def _rulings(laid: Laid) -> Array:
    """Where a sheet has bent by another 15 degrees, (k,)."""
    series = laid.development.series
    share = np.arange(STEPS) / STEPS
    low, width = series.knots[:-1, None], np.diff(series.knots)[:, None]
    t = np.append((low + width * share).ravel(), series.knots[-1])
    rate = np.abs(series(t)[:, 3])
    bending = np.append(0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t)))
    wanted = np.arange(LINE_EVERY, bending[-1] * (1.0 - 1e-9), LINE_EVERY)
    return np.asarray(np.interp(wanted, bending, t))


def _crossings(track: Track, at: Array) -> tuple[NDArray[np.intp], Array]:
    """Which of the rulings ``at`` (k,) a track crosses, (m,), and at which v, (m,)."""
    knots = track.series.knots
    share = np.arange(STEPS) / STEPS
    u = np.append((knots[:-1, None] + np.diff(knots)[:, None] * share).ravel(), knots[-1])
    after = track(u)[0][:, None] > at
    step, which = np.nonzero(after[1:] != after[:-1])
    low, high, before = u[step], u[step + 1], after[step, which]
    for _ in range(HALVINGS if step.size else 0):
        middle = 0.5 * (low + high)
        same = (track(middle)[0] > at[which]) == before
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return which, track(high)[1]
