"""An outline's edges made ready for fitting: one for each smooth run, none without length."""

from __future__ import annotations

import itertools

import numpy as np

from devcad.flatten import loops
from devcad.flatten.pattern import CUTOUT, Edge, length_bound, sample
from devcad.flatten.shapes import MARK
from devcad.flatten.trace import evaluate
from devcad.geometry.taylor import Array

STROKES = {MARK, "SCORE", "SEW", "GRAIN", "LABEL", "GLUE", "NOTCH_MARK"}
"""Roles of drawings whose edges are strokes of a pen, one after the other."""
DROPPED = 1e-9  # of the outline's size: a shorter edge is a corner
SMOOTH = 1e-6  # rad: a smaller corner between two edges is none


def smooth_edges(outline: tuple[Edge, ...]) -> tuple[Edge, ...]:
    """The same closed outline with an edge from each true corner to the next.

    Edges shorter than 1e-9 of the outline are left out, and cuts below 0.01 mm in a straight
    side; edges that continue each other smoothly become one, whose ``u`` lists their joints. An
    outline without any corner stays one closed edge from the first point. The run begins at the
    first edge's start unless that lies within a smooth run.
    """
    samples = [sample(edge, 8) for edge in outline]
    size = float(np.hypot(*np.ptp(np.concatenate(samples), axis=0)))
    lengths = [float(np.hypot(*np.diff(points, axis=0).T).sum()) for points in samples]
    kept = [edge for edge, length in zip(outline, lengths, strict=True) if length > DROPPED * size]
    sides = zip(kept[-1:] + kept[:-1], kept, kept[1:] + kept[:1], strict=True)
    kept = [edge for before, edge, after in sides if not _nick(before, edge, after)]
    corners = [k for k, edge in enumerate(kept) if not _continues(kept[k - 1], edge)]
    if not corners:
        return (_chained(kept),)
    starts = [*corners, corners[0] + len(kept)]
    around = kept + kept
    return tuple(_chained(around[i:j]) for i, j in itertools.pairwise(starts))


def _nick(before: Edge, edge: Edge, after: Edge) -> bool:
    """Whether an edge is where a hole only just reaches over a straight side: nothing to cut."""
    if edge.name != CUTOUT or before.name != after.name or before.name == CUTOUT:
        return False
    return length_bound(edge) < loops.SHORTEST and _continues(before, after)


def strokes(drawings: tuple[Edge, ...]) -> tuple[tuple[Edge, ...], ...]:
    """The lines of drawings, each drawn without lifting the pen: strokes of one role that follow
    one another and begin where the one before ends belong together, an edge for each smooth run."""
    out: list[list[Edge]] = []
    for edge in drawings:
        before = out[-1][-1] if out else None
        goes_on = before is not None and before.name == edge.name and edge.name in STROKES
        if before is not None and goes_on and _meets(before, edge):
            out[-1].append(edge)
        else:
            out.append([edge])
    return tuple(_smooth_runs(stroke) for stroke in out)


def _smooth_runs(edges: list[Edge]) -> tuple[Edge, ...]:
    """Edges that follow each other with those that continue each other smoothly made one."""
    corners = [k for k in range(1, len(edges)) if not _continues(edges[k - 1], edges[k])]
    return tuple(_chained(edges[i:j]) for i, j in itertools.pairwise([0, *corners, len(edges)]))


def _meets(before: Edge, after: Edge) -> bool:
    """Whether an edge begins where the one before ends."""
    gap = after.curve(after.u[:1])[0][0] - before.curve(before.u[-1:])[0][0]
    return float(np.hypot(*gap)) <= DROPPED * (length_bound(before) + length_bound(after))


def closes_smoothly(edges: tuple[Edge, ...]) -> bool:
    """Whether the outline is one edge without any corner."""
    return len(edges) == 1 and _continues(edges[0], edges[0])


def _continues(before: Edge, after: Edge) -> bool:
    """Whether the second edge starts in the direction in which the first one ends."""
    a, b = _end_slope(before, -1), _end_slope(after, 0)
    if a is None or b is None:
        return False
    return bool(abs(np.arctan2(loops.cross(a, b), loops.dot(a, b))) < SMOOTH)


def _end_slope(edge: Edge, k: int) -> Array | None:
    """The derivative along the run at an end; None where it vanishes or does not exist."""
    _, slopes = evaluate(edge, np.linspace(edge.u[0], edge.u[-1], 9))
    speed = np.hypot(*slopes.T)
    if not speed[k] > 1e-9 * speed[1:-1].max():
        return None
    return np.asarray(slopes[k] * np.sign(edge.u[-1] - edge.u[0]))


def _chained(edges: list[Edge]) -> Edge:
    """Edges that follow each other as one, the k-th over [k, k + 1]."""
    if len(edges) == 1:
        return edges[0]
    spans = [(float(edge.u[0]), float(edge.u[-1])) for edge in edges]

    def curve(x: Array) -> tuple[Array, Array]:
        points, slopes = np.empty((len(x), 2)), np.empty((len(x), 2))
        piece = np.clip(np.floor(x).astype(int), 0, len(edges) - 1)
        for k, (edge, (a, b)) in enumerate(zip(edges, spans, strict=True)):
            here = piece == k
            if here.any():
                f = x[here] - k
                points[here], found = edge.curve((1.0 - f) * a + f * b)
                slopes[here] = (b - a) * found
        return points, slopes

    inner = [
        k + (edge.u[:-1] - a) / (b - a)
        for k, (edge, (a, b)) in enumerate(zip(edges, spans, strict=True))
    ]
    name = CUTOUT if any(edge.name == CUTOUT for edge in edges) else edges[0].name
    return Edge(name, curve, np.concatenate([*inner, [float(len(edges))]]))
