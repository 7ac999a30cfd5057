"""Pattern edges as straight lines and circular arcs: exact where they are ones, otherwise the
fewest tangent continuous arcs within a tolerance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from devcad.errors import CheckFailed
from devcad.flatten import loops
from devcad.flatten.arcarea import with_area
from devcad.flatten.arcsearch import Nodes, fewest_arcs
from devcad.flatten.edges import closes_smoothly, smooth_edges
from devcad.flatten.green import swept_area
from devcad.flatten.loops import SHORTEST, Loop, Path
from devcad.flatten.measure import deviation
from devcad.flatten.pattern import CUTOUT, Edge
from devcad.flatten.trace import Trace, evaluate, trace, turns, unit_tangents
from devcad.geometry.taylor import Array

EXACT = 1e-9  # of a piece's size: design.md section 7, the scale of every "is it zero"
NOISE = 2e-11  # of the edge's size: the accuracy of a pattern, 1e-9 mm per 100 mm, twice
FINER = 0.3  # the next tolerance tried where arcs cannot enclose the true area
ROUNDS = 6  # fits at most, each nearer than the last
FINEST = 1e-12  # of an edge's size: no fit is asked to be nearer
PER_ARC = 12.0  # nodes tried for each arc expected: more costs time, saves at most one arc in 20

TRIES = ((1, SHORTEST), (2, SHORTEST), (1, 0.0), (2, 0.0), (4, 0.0), (8, 0.0))
"""Times PER_ARC nodes, and least length of an arc: the tolerance comes before the length."""

Keep = tuple[float | None, float | None]
"""Directions in radians to keep at the start and the end, None where they are free."""

Fit = Callable[[Trace, float, Keep], Path]
"""traced edge, tolerance, directions to keep -> path."""

FreeFit = Callable[
    [Trace, int, int, float, "float | None", "float | None"], "tuple[Array, Array] | None"
]
"""traced edge, first and last sample, tolerance, directions to keep -> points and bulges."""

Pieces = list[tuple[int, int, "Path | None"]]
"""Stretches of a trace, (first sample, last sample, exact path or None), end to end."""


def fit_outline(outline: tuple[Edge, ...], tolerance: float) -> Loop:
    """A closed outline as lines and arcs, counterclockwise, within ``tolerance`` (mm).

    From corner to corner (``smooth_edges``) straight lines and circular arcs are recognised;
    what is neither becomes the fewest tangent continuous arcs found. Every corner is a vertex;
    edges shorter than 1e-9 of the outline are dropped. No arc sweeps more than half a turn, and
    none is shorter than 0.01 mm unless its edge is or the tolerance asks for it. What is cut
    out (edges named "cutout") encloses the true area, to rounding. ``deviation`` is measured on
    the true curves.

    Raises:
        CheckFailed: the tolerance cannot be kept (it is below the rounding of the numbers).
    """
    return assemble(outline, tolerance, fit_trace)


def fit_edge(edge: Edge, tolerance: float, keep: Keep = (None, None)) -> Path:
    """One edge as lines and arcs within ``tolerance`` (mm), as in :func:`fit_outline`.

    ``keep``: the directions (radians) to keep at the two ends, None where they are free.
    """
    return fit_trace(trace(edge, tolerance / 50.0), tolerance, keep)


def assemble(outline: tuple[Edge, ...], tolerance: float, fit: Fit) -> Loop:
    """The closed loop of all edges, each turned into a path by ``fit``, counterclockwise."""
    traces, keep = traced_edges(outline, tolerance)
    corners = [kept.points[0] for kept in traces]
    paths = [fit(kept, tolerance, keep) for kept in traces]
    points = [
        part
        for corner, path in zip(corners, paths, strict=True)
        for part in (corner[None], path.points[1:-1])
    ]
    gaps = [
        float(np.hypot(*(kept.points[-1] - corner)))
        for kept, corner in zip(traces, corners[1:] + corners[:1], strict=True)
    ]
    loop = Loop(
        np.concatenate(points),
        np.concatenate([path.bulges for path in paths]),
        all(path.exact for path in paths),
        max(max(path.deviation for path in paths), *gaps),
    )
    return loops.counterclockwise(loop)


def traced_edges(outline: tuple[Edge, ...], tolerance: float) -> tuple[list[Trace], Keep]:
    """The traces of an outline from corner to corner, and the directions each has to keep."""
    edges = smooth_edges(outline)
    traces = [trace(edge, tolerance / 50.0) for edge in edges]
    seam = _angle(traces[0].tangents[0]) if closes_smoothly(edges) else None
    return traces, (seam, seam)


def fit_trace(traced: Trace, tolerance: float, keep: Keep) -> Path:
    """A traced edge as lines and arcs, measured; see :func:`fit_edge`."""
    stretches = pieces(traced)
    aim, found = 0.99 * tolerance, FINEST * traced.size
    exact = all(path is not None for _, _, path in stretches)
    for left in reversed(range(ROUNDS if exact or found < tolerance else 0)):
        fit = _fit_cut if left and traced.edge.name == CUTOUT else _fit_free
        path = _join(traced, stretches, aim, keep, fit)
        if path is None:
            aim *= FINER
            continue
        found = deviation(traced, path.points, path.bulges)
        if found <= tolerance or path.exact:
            return replace(path, deviation=found)
        aim *= min(0.95, 0.98 * tolerance / found)
    raise CheckFailed(
        f"an outline cannot be fitted: {found:.3g} mm off, limit {tolerance:.3g} mm",
        value=found,
        limit=tolerance,
        remedy="use a larger tolerance",
    )


def _join(
    traced: Trace, stretches: Pieces, tolerance: float, keep: Keep, fit: FreeFit
) -> Path | None:
    """Exact pieces and fitted ones, end to end, tangent continuous; None where the fit is."""
    parts: list[Path] = []
    for k, (i, j, exact) in enumerate(stretches):
        if exact is not None:
            parts.append(exact)
            continue
        start = keep[0] if k == 0 else end_direction(stretches[k - 1][2], last=True)
        end = keep[1] if k == len(stretches) - 1 else end_direction(stretches[k + 1][2], last=False)
        found = fit(traced, i, j, tolerance, start, end)
        if found is None:
            return None
        parts.append(Path(*found, False, 0.0))
    inner = [part.points[:-1] for part in parts]
    return Path(
        np.concatenate([*inner, traced.points[-1:]]),
        np.concatenate([part.bulges for part in parts]),
        all(part.exact for part in parts),
        0.0,
    )


def _fit_cut(
    traced: Trace, i: int, j: int, tolerance: float, start: float | None, end: float | None
) -> tuple[Array, Array] | None:
    """As :func:`_fit_free` with the area of the true curve; None where these arcs have it not."""
    points, bulges = _fit_free(traced, i, j, tolerance, start, end)
    kept = (start is not None, end is not None)
    found = with_area(points, bulges, _swept(traced, i, j), kept)
    if found is None or _shortest(*found) < min(SHORTEST, _shortest(points, bulges)):
        return None
    return found


def _shortest(points: Array, bulges: Array) -> float:
    return float(loops.lengths(points[:-1], points[1:], bulges).min())


def _swept(traced: Trace, i: int, j: int) -> float:
    """The area between the true curve from sample i to sample j and its chord."""
    inner = traced.knots[(traced.knots > i) & (traced.knots < j)]
    return swept_area(replace(traced.edge, u=traced.u[[i, *inner, j]]))


def end_direction(path: Path | None, *, last: bool) -> float | None:
    """The direction of an exact path at its end or start."""
    if path is None:
        return None
    k = -1 if last else 0
    chord = path.points[1:][k] - path.points[:-1][k]
    half = float(loops.half_sweeps(path.bulges)[k])
    return _angle(chord) + (half if last else -half)


def _angle(vector: Array) -> float:
    return float(np.arctan2(vector[1], vector[0]))


def _fit_free(
    traced: Trace, i: int, j: int, tolerance: float, start: float | None, end: float | None
) -> tuple[Array, Array]:
    """Points and bulges of the fewest arcs along samples i to j of a trace."""
    density = _density(traced, i, j, tolerance)
    short = traced.s[j] - traced.s[i] <= SHORTEST
    for finer, shortest in TRIES:
        if short and shortest > 0.0:
            continue
        points, fine, angles = _nodes(traced, i, j, density, PER_ARC * finer)
        found = fewest_arcs(Nodes(points, fine, angles, start, end, tolerance, shortest))
        if found is not None:
            return _straightened(found, points, tolerance, start, end)
    raise CheckFailed(
        f"an outline has no smooth fit within {tolerance:.3g} mm",
        limit=tolerance,
        remedy="use a larger tolerance",
    )


def _straightened(
    found: tuple[Array, Array],
    samples: Array,
    tolerance: float,
    start: float | None,
    end: float | None,
) -> tuple[Array, Array]:
    """One arc that may as well be a line becomes one, if no direction has to be kept."""
    points, bulges = found
    if len(bulges) > 1 or start is not None or end is not None:
        return found
    many = np.ones(len(samples))
    flat = loops.segment_distance(
        many[:, None] * points[0], many[:, None] * points[1], 0.0 * many, samples
    )
    return (points, np.zeros(1)) if flat.max() <= tolerance else found


def _density(traced: Trace, i: int, j: int, tolerance: float) -> Array:
    """Arcs expected up to each sample i..j of a trace, (j - i + 1,), increasing from 0.

    Arcs of length a on a curvature that changes by k' leave 0.008 k' a^3 (the third Bernoulli
    polynomial's maximum over six); where k' vanishes a quarter of the mean is kept, so that
    there are nodes everywhere, and never less than two arcs a turn.
    """
    s = traced.s[i : j + 1]
    ds = np.maximum(np.diff(s), 1e-12 * (s[-1] - s[0]))
    turn = turns(traced.tangents[i : j + 1])
    curvature = turn / ds
    change = np.abs(np.diff(curvature)) / (0.5 * (ds[:-1] + ds[1:]))
    change = np.concatenate([change[:1], change, change[-1:]]) if len(change) else np.zeros(2)
    rate = (0.008 * 0.5 * (change[:-1] + change[1:]) / tolerance) ** (1.0 / 3.0)
    mean = float((rate * ds).sum() / ds.sum())
    per_step = np.maximum(rate, 0.25 * mean) * ds + np.abs(turn) / np.pi + ds / ds.sum()
    return np.concatenate([[0.0], np.cumsum(per_step)])


def _nodes(
    traced: Trace, i: int, j: int, density: Array, per_arc: float
) -> tuple[Array, int, Array]:
    """Points on samples i to j for the search, how many of them a node, directions at nodes."""
    fine = 4
    count = int(np.clip(np.ceil(per_arc * density[-1]), 16, 40000))
    levels = np.linspace(0.0, density[-1], fine * count + 1)
    u = np.interp(levels, density, traced.u[i : j + 1])
    knots = traced.knots[(traced.knots > i) & (traced.knots < j)]
    if len(knots) < count:  # where the curvature jumps, an arc should end
        place = np.rint(density[knots - i] / density[-1] * count).astype(int)
        u[fine * np.clip(place, 1, count - 1)] = traced.u[knots]
        u = np.sort(u) if u[-1] >= u[0] else np.sort(u)[::-1]
    points, slopes = evaluate(traced.edge, u)
    points = points.copy()
    points[0], points[-1] = traced.points[i], traced.points[j]
    tangents, _ = unit_tangents(traced.edge, points, slopes)
    return points, fine, np.arctan2(tangents[::fine, 1], tangents[::fine, 0])


def pieces(traced: Trace) -> Pieces:
    """A traced edge cut into lines and arcs, and the stretches between that are neither."""
    whole = _recognise(traced, 0, len(traced.u) - 1)
    if whole is not None:
        return [(0, len(traced.u) - 1, whole)]
    found: Pieces = []
    for i, j in zip(traced.knots[:-1].tolist(), traced.knots[1:].tolist(), strict=True):
        exact = _recognise(traced, i, j)
        if exact is not None and traced.s[j] - traced.s[i] < SHORTEST:
            exact = None
        found.append((i, j, exact))
    found = _joined(traced, found)
    return _without_short(traced, found) if traced.edge.name == CUTOUT else found


def _without_short(traced: Trace, found: Pieces) -> Pieces:
    """The pieces with those below 0.01 mm given to a neighbour: a contour that only just reaches
    over a joint. It becomes longer if it still is the same line or arc, else it is fitted."""
    while len(found) > 1:
        sizes = [float(traced.s[j] - traced.s[i]) for i, j, _ in found]
        k = int(np.argmin(sizes))
        pairs = [n for n in (k - 1, k) if 0 <= n < len(found) - 1]
        if sizes[k] >= SHORTEST:
            break
        ends = [(found[n][0], found[n + 1][1]) for n in pairs]
        exact = [_recognise(traced, i, j) for i, j in ends]
        free = [found[n][2] is None or found[n + 1][2] is None for n in pairs]
        best = min(range(len(pairs)), key=lambda m: (exact[m] is None, not free[m]))
        n = pairs[best]
        found = _joined(traced, [*found[:n], (*ends[best], exact[best]), *found[n + 2 :]])
    return found


def _joined(traced: Trace, found: Pieces) -> Pieces:
    """The pieces with neighbours that are one line, one arc or both free made one."""
    out: Pieces = []
    for i, j, exact in found:
        if out and (out[-1][2] is None) == (exact is None):
            both = None if exact is None else _recognise(traced, out[-1][0], j)
            if exact is None or both is not None:
                out[-1] = (out[-1][0], j, both)
                continue
        out.append((i, j, exact))
    return out


def _recognise(traced: Trace, i: int, j: int) -> Path | None:
    """The line or arc that samples i to j lie on, in segments of at most half a turn."""
    points = traced.points[i : j + 1]
    size = float(np.hypot(*np.ptp(points, axis=0)))
    limit = EXACT * size + NOISE * traced.size
    chord = points[-1] - points[0]
    length = float(np.hypot(*chord))
    if length > 2.0 * limit:
        offset = loops.cross(chord, points - points[0]) / length
        forward = np.diff(points @ chord)
        if np.abs(offset).max() <= limit and np.all(forward > -limit * length):
            return Path(points[[0, -1]], np.zeros(1), True, 0.0)
    return _recognise_arc(points, turns(traced.tangents[i : j + 1]), size, limit)


def _recognise_arc(points: Array, turn: Array, size: float, limit: float) -> Path | None:
    """The circular arc through samples (n, 2), whose tangents turn by ``turn`` (n - 1,)."""
    sweep = float(turn.sum())
    if not 1e-9 < abs(sweep) < 2.0 * np.pi + 1e-6 or np.any(turn * np.sign(sweep) < -1e-6):
        return None
    if abs(sweep) < np.pi:
        half = _common_half_sweep(points, limit)
        if half is None:
            return None
        return Path(points[[0, -1]], np.array([np.tan(0.5 * half)]), True, 0.0)
    middle = points.mean(axis=0)
    x = (points - middle) / size
    solution, *_ = np.linalg.lstsq(np.column_stack([2.0 * x, np.ones(len(x))]), loops.dot(x, x))
    centre = solution[:2]
    radii = np.hypot(*(x - centre).T)
    if np.ptp(radii) * size > 2.0 * limit:
        return None
    angles = np.unwrap(np.arctan2(*(x - centre).T[::-1]))
    sweep = float(angles[-1] - angles[0])
    if abs(abs(sweep) - 2.0 * np.pi) * size < 4.0 * limit:
        sweep = float(np.copysign(2.0 * np.pi, sweep))
    parts = int(np.ceil(abs(sweep) / np.pi - 1e-9))
    at = angles[0] + sweep * np.arange(1, parts) / parts
    inner = middle + size * (centre + radii.mean() * loops.direction(at))
    path = np.concatenate([points[:1], inner, points[-1:]])
    return Path(path, np.full(parts, np.tan(0.25 * sweep / parts)), True, 0.0)


def _common_half_sweep(points: Array, limit: float) -> float | None:
    """Half the sweep of the arc from the first to the last point through all others."""
    qa, bq = points[1:-1] - points[0], points[-1] - points[1:-1]
    turned = np.arctan2(loops.cross(qa, bq), loops.dot(qa, bq))
    chord = float(np.hypot(*(points[-1] - points[0])))
    arms = np.sqrt(loops.dot(qa, qa) * loops.dot(bq, bq)) / chord  # mm of offset per radian
    half = float((turned * arms**2).sum() / (arms**2).sum())
    return half if np.all(np.abs(turned - half) * arms <= limit) else None
