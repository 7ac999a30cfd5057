"""Lines drawn on the sheet, as curves in its pattern."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from devcad.flatten.pattern import Edge, Line, PlaneCurve, Unrolled
from devcad.geometry.drawing import Drawing, OnSurface
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

STEPS = 256
"""Steps of a drawing between which it is seen to cross a border or a break."""
HALVINGS = 60
"""A step halved so often is below the rounding of the parameter."""
ON_BORDER = 1e-10
"""Of the extent's width and of the domain: a line as near to the border runs along it."""
KINK = 1e-6
"""A line that turns by more than this at one point, in radians, has a corner there."""
SEEN = (0.29, 0.5, 0.77)
"""Where a stretch between two crossings is looked at, as shares of it."""


def draw(drawing: Drawing, patch: Patch, unrolled: Unrolled) -> tuple[Edge, ...]:
    """A drawing as curves in the plane, one for each of its stretches on the patch.

    What leaves the patch's domain or its extent is left out, and what runs along its border:
    there the cut is. The edges' ``u`` also list where the path crosses the patch's breaks.
    """

    curve = image(drawing.path, patch, unrolled)
    knots = _crossings(drawing, patch)
    places = np.concatenate([knots[:-1] + share * np.diff(knots) for share in SEEN])
    sides = _sides(drawing, patch, places)[:, :4].reshape(len(SEEN), -1, 4)
    within = np.any(sides > 2.0 * ON_BORDER, axis=0)  # of each border, somewhere
    kept = np.all(sides >= 0.0, axis=(0, 2)) & np.all(within, axis=1)
    changes = np.flatnonzero(np.diff(kept.astype(int), prepend=0, append=0)).tolist()
    kinks = _kinks(curve, knots)
    runs = [
        run
        for i, j in zip(changes[::2], changes[1::2], strict=True)
        for run in _between(knots, i, j, kinks)
    ]
    return tuple(
        Edge(drawing.layer, kept_inside(curve, run) if kinks else curve, run) for run in runs
    )


def kept_inside(curve: PlaneCurve, run: Array) -> PlaneCurve:
    """The curve, asked just inside the ends of a run: there it answers for this side."""
    low, high = np.nextafter(run[0], run[-1]), np.nextafter(run[-1], run[0])
    return lambda u: curve(np.clip(u, low, high))


def _kinks(curve: PlaneCurve, knots: Array) -> list[int]:
    """At which of the inner knots the image turns: a break across which the pattern's speed jumps,
    where a flat goes over into a bend whose neutral fibre is not the middle."""
    inner = knots[1:-1]
    if not inner.size:
        return []
    reach = 1e-9 * (knots[-1] - knots[0])
    before, after = (curve(inner + side * reach)[1] for side in (-1.0, 1.0))
    sine = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    turn = np.abs(np.arctan2(sine, (before * after).sum(axis=1)))
    return (np.flatnonzero(turn > KINK) + 1).tolist()


def _between(knots: Array, first: int, last: int, kinks: list[int]) -> list[Array]:
    """The knots from the first to the last, in runs that end at kinks."""
    ends = [first, *(k for k in kinks if first < k < last), last]
    return [knots[i : j + 1] for i, j in pairwise(ends)]


def image(path: OnSurface, patch: Patch, unrolled: Unrolled) -> PlaneCurve:
    """A path on a patch as a curve in the plane.

    The image of (t, v) is the development's, and so is the derivative: the tangent
    dt (p e + (q + v a) m) + dv e of the surface, carried over.
    """

    def curve(u: Array) -> tuple[Array, Array]:
        t, v, dt, dv = path(u)
        t = np.clip(t, *patch.domain)
        f = patch.frame(t)
        origin, e, m = unrolled.axes(t)
        slope = (dt * f.p + dv)[:, None] * e + (dt * (f.q + v * f.a))[:, None] * m
        return origin + v[:, None] * e, slope

    return curve


def not_repeated(
    lines: tuple[Line, ...], drawings: tuple[Edge, ...], near: float
) -> tuple[Line, ...]:
    """The lines without the rulings that a drawing repeats from end to end, within ``near`` mm:
    a line that is drawn twice is burnt twice."""
    if not drawings:
        return lines
    # both ends and the middle, (k, 3, 2), in either direction
    drawn = np.stack([edge.curve(np.linspace(edge.u[0], edge.u[-1], 3))[0] for edge in drawings])

    def repeated(line: Line) -> bool:
        places = np.stack([line.start, 0.5 * (line.start + line.end), line.end])
        off = [np.abs(drawn - way).max(axis=(1, 2)).min() for way in (places, places[::-1])]
        return line.layer == "RULING" and min(off) <= near

    return tuple(line for line in lines if not repeated(line))


def _sides(drawing: Drawing, patch: Patch, u: Array) -> Array:
    """On which side of every border (four columns, shares, ON_BORDER on it and more inside) and
    every break the drawing is at u (n,)."""
    t, v, _, _ = drawing.path(u)
    low, high = patch.domain
    jet = patch.jet(np.clip(t, low, high), 0)
    width = (jet.v_to[0] - jet.v_from[0]).max()
    inside = [
        (t - low) / (high - low),
        (high - t) / (high - low),
        (v - jet.v_from[0]) / width,
        (jet.v_to[0] - v) / width,
    ]
    return np.column_stack([*(x + ON_BORDER for x in inside), *(t - at for at in patch.breaks)])


def _crossings(drawing: Drawing, patch: Patch) -> Array:
    """The drawing's ends and, between them, where it crosses a border or a break, increasing."""
    u = np.linspace(*drawing.u, STEPS + 1)
    outside = _sides(drawing, patch, u) < 0.0
    step, side = np.nonzero(outside[1:] != outside[:-1])
    low, high, before = u[step], u[step + 1], outside[step, side]
    for _ in range(HALVINGS if step.size else 0):
        middle = 0.5 * (low + high)
        now = _sides(drawing, patch, middle)[np.arange(step.size), side] < 0.0
        low, high = np.where(now == before, middle, low), np.where(now == before, high, middle)
    inner = np.unique(high)
    return np.concatenate([u[:1], inner[(inner > u[0]) & (inner < u[-1])], u[-1:]])
