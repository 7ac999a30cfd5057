"""The edges of cuts on every layer: lines, circular arcs, else splines in space and on the face."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from devcad.export._step_batch import fitted
from devcad.export._step_body import (
    Arc,
    Cone,
    Curve,
    Cylinder,
    Line,
    Ruled,
    Straight,
    Stretch,
    Trace,
)
from devcad.export._step_draft import Draft
from devcad.export._step_legs import Leg, Legs, legs, tied
from devcad.export._step_places import Ground
from devcad.export._step_rails import EDGE_TOLERANCE, circle_centre, plane_arc, sweep
from devcad.export._step_tracks import Indices
from devcad.geometry.cells import Run
from devcad.geometry.cuts import Cut
from devcad.geometry.fit import FLOOR, Spline
from devcad.geometry.taylor import Array

SAMPLES = np.linspace(0.0, 1.0, 17)
PROBES: Array = np.linspace(0.5, 8.5, 9) / 9.0
"""Shares of an edge where the written file is measured."""
CLOSE = 1e-9
"""Of its length: a curve as near to a line or an arc is one."""
FINE = 1.5e-9
"""Of its length: how closely an edge is fitted, so that small holes keep their area."""
SHORT = 0.1
"""Of an edge's tolerance: its poles are rounded to decimals below."""
FINEST = 3e-12
"""Of the size: rounding."""

Known = tuple[tuple[Curve, ...], tuple[tuple[float, float], ...], tuple[Trace | None, ...]]
"""Curves, spans and traces on every layer."""


@dataclass(frozen=True, slots=True)
class Rim:
    """One edge of a cut on every layer, run in the cut's direction: the sheet is on its left.

    ``starts`` and ``ends`` are its vertices, ``probes`` parameters (k,) and true points
    (k, layers, 3) there, points alone where the curves are exact.
    """

    leg: Leg
    starts: tuple[int, ...]
    ends: tuple[int, ...]
    curves: tuple[Curve, ...]
    spans: tuple[tuple[float, float], ...]
    traces: tuple[Trace | None, ...]
    probes: tuple[Array, Array]


def rims(
    draft: Draft,
    ground: Ground,
    cuts: Sequence[Cut],
    runs: Sequence[Run],
    tolerance: float,
    degree: int,
) -> list[tuple[Rim, ...]]:
    """The edges of every run in a strip, in its order; their vertices are added to the draft.

    Exact where a layer is a plane, cylinder or cone and they are lines or arcs on it; else within
    half of ``tolerance`` and 1.5e-9 of their length, in space and on the face by one parameter.

    Raises:
        GeometryError: a fit is out of reach.
    """
    chains = [legs(ground, cuts, run) for run in runs]
    if not chains:
        return []
    table = tied(draft, ground, cuts, chains)
    rows = table.rows(np.arange(len(table.legs)), SAMPLES)
    floor = FINEST * draft.size
    near = CLOSE * table.length + floor
    known = [_known(ground, rows[k], table.ends[k], float(near[k])) for k in range(len(near))]
    free = np.array([k for k, found in enumerate(known) if found is None], dtype=int)
    fine = np.maximum(np.minimum(0.5 * tolerance, FINE * table.length), floor)
    splines = _free(table, free, fine, degree)
    true = table.truth(PROBES)
    out = []
    for k, (leg, pair) in enumerate(zip(table.legs, table.vertices, strict=True)):
        found = known[k]
        probes = (np.zeros(0), rows[k][:, :, :3])
        if found is None:
            spline = splines[k]
            found = _of_spline(ground, spline, SHORT * float(fine[k]))
            probes = (PROBES * spline.knots[-1], true[k])
        curves, spans, traces = found
        out.append(Rim(leg, *pair, curves, spans, traces, probes))
        if any(leg.drift):
            draft.moved = ground.hair
    made = iter(out)
    return [tuple(next(made) for _ in chain) for chain in chains]


def edge_tolerance(size: float, tolerance: float) -> float:
    """How closely edges on exact faces are fitted, mm."""
    return min(tolerance, max(EDGE_TOLERANCE, FINEST * size))


def _free(table: Legs, which: Indices, fine: Array, degree: int) -> dict[int, Spline]:
    """Splines for some of the legs, all layers and their places side by side."""
    if not len(which):
        return {}
    layers, width = table.ends.shape[2:]

    def rows(some: Indices, shares: Array) -> Array:
        found = table.rows(which[some], shares)
        return found.reshape(*found.shape[:2], -1)

    blocks = [slice(width * k, width * k + 3) for k in range(layers)]
    blocks += [slice(width * k + 3, width * k + 5) for k in range(layers) if width == 5]
    breaks = [table.breaks[k] for k in which.tolist()]
    found = fitted(rows, breaks, fine[which], tuple(blocks), degree)
    return dict(zip(which.tolist(), found, strict=True))


def _of_spline(ground: Ground, spline: Spline, floor: float) -> Known:
    """A fit of all columns as curves and traces, rounded to decimals below ``floor`` mm."""
    width, layers = ground.width, len(ground.skin.surfaces)
    span = float(spline.knots[0]), float(spline.knots[-1])
    curves, traces = [], list[Trace | None]()
    for k in range(layers):
        curves.append(_short(spline.part(slice(width * k, width * k + 3)), floor * np.ones(3)))
        if width == 3:
            traces.append(None)
            continue
        place = spline.part(slice(width * k + 3, width * k + 5))
        scaled = Spline(place.degree, place.knots, place.poles / ground.scale)
        traces.append(_short(scaled, floor / ground.scale))
    return tuple(curves), (span,) * layers, tuple(traces)


def _short(spline: Spline, floor: Array) -> Spline:
    """The spline with its inner poles rounded to decimals below ``floor`` (k,) for each column:
    a file of many holes is mostly their digits."""
    poles = spline.poles.copy()
    for k, decimals in enumerate(np.ceil(-np.log10(floor)).astype(int).tolist()):
        poles[1:-1, k] = np.round(poles[1:-1, k], decimals)
    return Spline(spline.degree, spline.knots, poles)


# lines and arcs


def _known(ground: Ground, rows: Array, ends: Array, near: float) -> Known | None:
    """A leg as a line or an arc on all its layers; ``rows`` (m, layers, width) are samples of it
    in order, ``ends`` (2, layers, width) its ends."""
    if _straight(ground, rows, near):
        return _line(ground, ends)
    if isinstance(ground.skin.surfaces[0], (Cylinder, Cone)):
        return _round_arc(ground, rows, ends) if np.ptp(rows[:, :, 4], 0).max() <= near else None
    if ground.width == 3:
        return _plane_arcs(rows, near)
    return None


def _straight(ground: Ground, rows: Array, near: float) -> bool:
    """Whether a leg is straight: on a plane, or along a ruling of an exact surface."""
    surface = ground.skin.surfaces[0]
    if isinstance(surface, Ruled):
        low, high = surface.low.weights, surface.high.weights
        even = low is None or high is None or np.array_equal(low, high)
        if ground.fitted or not even:
            return False
        return bool(np.ptp(rows[:, :, 4], axis=0).max() <= near)
    if isinstance(surface, (Cylinder, Cone)) and np.ptp(rows[:, :, 3], axis=0).max() > near:
        return False
    points = rows[:, :, :3]
    chord = points[-1] - points[0]
    length = np.linalg.norm(chord, axis=1)
    off = np.linalg.norm(np.cross(points - points[0], chord), axis=2)
    return bool((off.max(axis=0) <= near * length).all())


def _line(ground: Ground, ends: Array) -> Known:
    lengths = np.linalg.norm(ends[1, :, :3] - ends[0, :, :3], axis=1).tolist()
    traces: list[Trace | None] = [None] * len(lengths)
    if ground.width == 5:
        places = ends[:, :, 3:] / ground.scale
        for k, surface in enumerate(ground.skin.surfaces):
            a, b = places[:, k]
            if isinstance(surface, Ruled):
                traces[k] = Stretch(a, np.array([b[0], a[1]]))
            else:
                traces[k] = Straight(a, np.array([0.0, np.sign(b[1] - a[1])]))
    return (Line(),) * len(lengths), tuple((0.0, x) for x in lengths), tuple(traces)


def _round_arc(ground: Ground, rows: Array, ends: Array) -> Known:
    """A leg around the axis of a cylinder or cone."""
    frame = ground.skin.frame
    assert frame is not None
    curves, traces = [], []
    places = ends[:, :, 3:] / ground.scale
    turn = float(np.sign(places[1, 0, 0] - places[0, 0, 0]))
    u = places[0, 0, 0]
    x = np.cos(u) * frame.x + np.sin(u) * np.cross(frame.axis, frame.x)
    for k, skin in enumerate(ground.skin.surfaces):
        assert isinstance(skin, (Cylinder, Cone))
        arm = rows[:, k, :3] - skin.point
        height = arm @ skin.axis
        centre = skin.point + height.mean() * skin.axis
        radius = float(np.linalg.norm(arm - height[:, None] * skin.axis, axis=1).mean())
        curves.append(Arc(centre, turn * skin.axis, x, radius))
        v = float(rows[:, k, 4].mean())
        traces.append(Straight(np.array([u, v]), np.array([turn, 0.0])))
    span = 0.0, float(abs(places[1, 0, 0] - u))
    return tuple(curves), (span,) * len(curves), tuple(traces)


def _plane_arcs(rows: Array, near: float) -> Known | None:
    """A leg that is an arc on every layer, about one axis."""
    size = near / FLOOR
    layers = [rows[:, k, :3] for k in range(rows.shape[1])]
    if any(circle_centre(points, size) is None for points in layers):
        return None
    arcs = [plane_arc(points, size) for points in layers]
    if np.linalg.norm(np.cross(arcs[-1].centre - arcs[0].centre, arcs[0].axis)) > near:
        return None
    spans = tuple(sweep(arc, points) for arc, points in zip(arcs, layers, strict=True))
    return tuple(arcs), spans, (None,) * len(arcs)
