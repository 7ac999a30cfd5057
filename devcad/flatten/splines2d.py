"""Pattern edges as cubic B-splines, one for each smooth stretch, for drawing in CAD."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devcad.errors import CheckFailed
from devcad.flatten import loops
from devcad.flatten.arcs import Keep, end_direction, pieces, traced_edges
from devcad.flatten.loops import Path
from devcad.flatten.measure import CERTIFICATE
from devcad.flatten.pattern import Edge
from devcad.flatten.trace import Trace, trace, unit_tangents
from devcad.flatten.trace import evaluate as evaluate_edge
from devcad.geometry.taylor import Array

DEGREE = 3
JUMP = 0.02  # of the largest curvature: a larger jump gets a double knot


@dataclass(frozen=True, slots=True)
class Spline:
    """A clamped B-spline: degree, knots (n + degree + 1,) in mm of length, control (n, 2)."""

    degree: int
    knots: Array
    control: Array
    deviation: float = 0.0


@dataclass(frozen=True, slots=True)
class Stretch:
    """Samples u, points, tangents and lengths s of a smooth stretch, with the directions to
    keep at its ends and the lengths at which its curvature jumps."""

    u: Array
    points: Array
    tangents: Array
    s: Array
    keep: Keep
    jumps: Array


def spline_outline(
    outline: tuple[Edge, ...], tolerance: float
) -> tuple[tuple[Path | Spline, ...], ...]:
    """For each edge of an outline its lines and arcs (exact paths) and cubic splines, in order.

    Every item starts where the one before ends, to the last bit. Splines stay within
    ``tolerance`` (mm) of the edge; smooth joints keep a common tangent.

    Raises:
        CheckFailed: the tolerance cannot be kept.
    """
    traces, keep = traced_edges(outline, tolerance)
    corners = [traced.points[0] for traced in traces]
    after = corners[1:] + corners[:1]
    return tuple(
        _joined([spline_or_path(t, part, tolerance) for part in stretches(t, keep)], a, b)
        for t, a, b in zip(traces, corners, after, strict=True)
    )


def spline_edge(edge: Edge, tolerance: float) -> tuple[Path | Spline, ...]:
    """One open edge as lines, arcs and cubic splines, as in :func:`spline_outline`."""
    traced = trace(edge, tolerance / 50.0)
    items = [spline_or_path(traced, part, tolerance) for part in stretches(traced, (None, None))]
    return _joined(items, traced.points[0], traced.points[-1])


def stretches(traced: Trace, keep: Keep) -> list[tuple[int, int, Path | None, Keep]]:
    """The exact and the free stretches of an edge, each with the directions to keep."""
    cut = pieces(traced)
    ends = [keep[0], *(None for _ in cut[1:]), keep[1]]
    for k in range(1, len(cut)):
        before, after = cut[k - 1][2], cut[k][2]
        ends[k] = end_direction(before, last=True)
        if ends[k] is None:
            ends[k] = end_direction(after, last=False)
    return [(i, j, exact, (ends[k], ends[k + 1])) for k, (i, j, exact) in enumerate(cut)]


def spline_or_path(
    traced: Trace,
    part: tuple[int, int, Path | None, Keep],
    tolerance: float,
) -> Path | Spline:
    """The exact path of a stretch, or the cubic spline with the fewest control points found."""
    i, j, exact, keep = part
    if exact is not None:
        return exact
    stretch = _stretch(traced, i, j, keep)
    spans, failed = 2, 1
    fitted = _graded(stretch, spans)
    while fitted.deviation > tolerance and spans < len(stretch.s) // 8:
        failed = spans
        spans += max(1, int(spans * min(1.0, (fitted.deviation / tolerance) ** 0.25 - 1.0)))
        fitted = _graded(stretch, spans)
    if fitted.deviation > tolerance:
        raise CheckFailed(
            f"an outline cannot be fitted by a spline: {fitted.deviation:.3g} mm off,"
            f" limit {tolerance:.3g} mm",
            value=fitted.deviation,
            limit=tolerance,
            remedy="use arcs (dxf.curves) or a larger tolerance",
        )
    while spans - failed > 1:  # the steps above were large ones
        middle = (spans + failed) // 2
        smaller = _graded(stretch, middle)
        if smaller.deviation <= tolerance:
            spans, fitted = middle, smaller
        else:
            failed = middle
    return fitted


def _graded(stretch: Stretch, spans: int) -> Spline:
    """The best of a few cubics with ``spans`` spans, the breaks moved to equal the errors."""
    breaks = np.linspace(0.0, stretch.s[-1], spans + 1)
    tries: list[Spline] = []
    for _ in range(4):
        fitted = _least_squares(stretch, breaks)
        found = spline_deviation(fitted, stretch.points, stretch.s)
        tries.append(Spline(fitted.degree, fitted.knots, fitted.control, found))
        breaks = _regraded(fitted, spans)
    return min(tries, key=lambda spline: spline.deviation)


def evaluate(spline: Spline, x: Array) -> Array:
    """Points of a spline at x (m,), (m, 2)."""
    first, values = _basis(spline.knots, spline.degree, x)
    near = spline.control[first[:, None] + np.arange(spline.degree + 1)]
    return np.asarray(np.einsum("mk,mki->mi", values, near))


def derivative(spline: Spline) -> Spline:
    """The spline's derivative."""
    p, t = spline.degree, spline.knots
    step = (t[p + 1 : -1] - t[1 : -p - 1])[:, None]
    return Spline(p - 1, t[1:-1], p * np.diff(spline.control, axis=0) / step)


def spline_deviation(spline: Spline, points: Array, s: Array) -> float:
    """A bound of the distance between curve points, dense and in order, and a spline, in mm.

    ``s`` (n,) are the points' lengths from the start, first guesses of their feet.
    """
    low, high = float(spline.knots[0]), float(spline.knots[-1])
    x = low + (s - s[0]) * (high - low) / (s[-1] - s[0])
    slope = derivative(spline)
    for _ in range(4):
        speed = evaluate(slope, x)
        step = loops.dot(points - evaluate(spline, x), speed) / loops.dot(speed, speed)
        x = np.clip(x + step, low, high)
    y = np.hypot(*(points - evaluate(spline, x)).T)
    # A local maximum lies above its sample by what the parabola through three samples says.
    bend = 2.0 * y[1:-1] - y[:-2] - y[2:]
    peak = bend > np.abs(y[2:] - y[:-2]) / 2.0
    more = (y[2:] - y[:-2]) ** 2 / (8.0 * np.where(peak, bend, 1.0))
    return float(CERTIFICATE * max(y.max(), (y[1:-1] + np.where(peak, more, 0.0)).max()))


def _joined(items: list[Path | Spline], start: Array, end: Array) -> tuple[Path | Spline, ...]:
    """The items of an edge with the corners as first and last point, bitwise."""
    out: list[Path | Spline] = []
    for k, item in enumerate(items):
        points = (item.points if isinstance(item, Path) else item.control).copy()
        if k == 0:
            points[0] = start
        if k == len(items) - 1:
            points[-1] = end
        out.append(
            Path(points, item.bulges, item.exact, item.deviation)
            if isinstance(item, Path)
            else Spline(item.degree, item.knots, points, item.deviation)
        )
    return tuple(out)


def _stretch(traced: Trace, i: int, j: int, keep: Keep) -> Stretch:
    """Samples i to j of a trace, refined to equal steps of length with the knots kept."""
    steps = int(np.clip(4 * (j - i), 400, 1600))
    even = np.linspace(traced.s[i], traced.s[j], steps + 1)
    u = np.interp(even, traced.s[i : j + 1], traced.u[i : j + 1])
    knots = traced.knots[(traced.knots > i) & (traced.knots < j)]
    u = np.unique(np.concatenate([u, traced.u[knots]]))
    u = u if traced.u[-1] >= traced.u[0] else u[::-1]
    points, slopes = evaluate_edge(traced.edge, u)
    tangents, _ = unit_tangents(traced.edge, points, slopes)
    points = points.copy()
    points[0], points[-1] = traced.points[i], traced.points[j]
    a, b = tangents[:-1], tangents[1:]
    turn = np.arctan2(loops.cross(a, b), loops.dot(a, b))
    ds = np.hypot(*np.diff(points, axis=0).T) / np.sinc(0.5 * turn / np.pi)
    s = np.concatenate([[0.0], np.cumsum(ds)])
    bend = turn / np.maximum(ds, 1e-12 * s[-1])
    at = np.flatnonzero(np.isin(u, traced.u[knots]))
    at = at[(at >= 2) & (at <= len(bend) - 2)]
    # Curvature continued linearly to the knot from its two sides.
    jump = np.abs(1.5 * (bend[at] - bend[at - 1]) - 0.5 * (bend[at + 1] - bend[at - 2]))
    return Stretch(u, points, tangents, s, keep, s[at[jump > JUMP * np.abs(bend).max()]])


def _least_squares(stretch: Stretch, breaks: Array) -> Spline:
    """The cubic with the given breaks nearest to the samples; ends, and the directions to keep
    there, are exact."""
    p, jumps = DEGREE, stretch.jumps
    if len(jumps):  # double knots at jumps, and no other knot close by
        gap = 0.25 * breaks[-1] / len(breaks)
        far = np.abs(breaks[1:-1, None] - jumps).min(axis=1) > gap
        inner = np.sort(np.concatenate([breaks[1:-1][far], jumps, jumps]))
    else:
        inner = breaks[1:-1]
    ends = np.ones(p + 1)
    knots = np.concatenate([breaks[0] * ends, inner, breaks[-1] * ends])
    basis = _matrix(knots, p, stretch.s)
    control = np.zeros((basis.shape[1], 2))
    control[0], control[-1] = stretch.points[0], stretch.points[-1]
    free = np.ones(len(control), dtype=bool)
    free[[0, -1]] = False
    if stretch.keep[0] is not None:  # by length, the first leg is the tangent times h / p
        control[1] = control[0] + stretch.tangents[0] * (knots[p + 1] - knots[1]) / p
        free[1] = False
    if stretch.keep[1] is not None:
        control[-2] = control[-1] - stretch.tangents[-1] * (knots[-2] - knots[-p - 2]) / p
        free[-2] = False
    rest = stretch.points - basis @ control
    part = basis[:, free]  # B-splines are well conditioned enough for normal equations
    control[free] = np.linalg.lstsq(part.T @ part, part.T @ rest, rcond=1e-14)[0]
    return Spline(p, knots, control)


def _regraded(spline: Spline, spans: int) -> Array:
    """Breaks for ``spans`` spans of equal error: density (fourth derivative)^(1/4), read from
    the jumps of the third derivative (de Boor, A Practical Guide to Splines, chapter 12)."""
    third = derivative(derivative(derivative(spline))).control
    knots = spline.knots[spline.degree : -spline.degree]
    wide = np.diff(knots) > 0.0
    third, breaks = third[wide], np.concatenate([knots[:-1][wide], knots[-1:]])
    h = np.diff(breaks)
    jump = np.hypot(*np.diff(third, axis=0).T) / (0.5 * (h[:-1] + h[1:]))
    fourth = np.concatenate([jump[:1], jump, jump[-1:]])
    rate = 0.5 * (fourth[:-1] ** 0.25 + fourth[1:] ** 0.25)
    rate = np.maximum(rate, 0.2 * (rate * h).sum() / h.sum())
    total = np.concatenate([[0.0], np.cumsum(rate * h)])
    inner = np.interp(np.linspace(0.0, total[-1], spans + 1)[1:-1], total, breaks)
    return np.concatenate([breaks[:1], inner, breaks[-1:]])


def _basis(knots: Array, degree: int, x: Array) -> tuple[NDArray[np.intp], Array]:
    """The degree + 1 B-splines that do not vanish at x (m,): the first one's number (m,) and
    their values (m, degree + 1). The NURBS Book, algorithm A2.2, for many x at once."""
    count = len(knots) - degree - 1
    span = np.clip(np.searchsorted(knots, x, side="right") - 1, degree, count - 1)
    values = np.zeros((len(x), degree + 1))
    values[:, 0] = 1.0
    for p in range(1, degree + 1):
        carried = np.zeros(len(x))
        for r in range(p):
            right, left = knots[span + r + 1] - x, x - knots[span + 1 - p + r]
            share = values[:, r] / (right + left)
            values[:, r] = carried + right * share
            carried = left * share
        values[:, p] = carried
    return span - degree, values


def _matrix(knots: Array, degree: int, x: Array) -> Array:
    """All B-splines at x (m,), (m, n)."""
    first, values = _basis(knots, degree, x)
    out = np.zeros((len(x), len(knots) - degree - 1))
    out[np.arange(len(x))[:, None], first[:, None] + np.arange(degree + 1)] = values
    return out
