"""Where a panel is cut, as edges in its pattern: the border of the sheet, notches and holes."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from devcad.errors import GeometryError
from devcad.flatten.drawings import kept_inside
from devcad.flatten.green import enclosed_area
from devcad.flatten.images import track_images, within
from devcad.flatten.pattern import CUTOUT, Edge, Unrolled, length_bound
from devcad.geometry.cells import Run, Stretch, whole
from devcad.geometry.chain import Chain
from devcad.geometry.cuts import Cut
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

Pairs = Sequence[tuple[Patch, Unrolled]]
"""The patches of a chain in order, each with its place in the plane."""
SIDES = ("start", "top", "end", "base")
"""The names of a border's sides, counterclockwise."""
COLLAPSED = 1e-12
"""An edge shorter than this share of the pattern is a point: an apex."""
ONE_LINE = 1e-9
"""Rulings whose ends are no further apart than this share of them are one line."""
KINK = 1e-6
"""An edge that turns by more than this at one point, in radians, has a corner there."""


def border(pairs: Pairs) -> tuple[Edge, ...]:
    """The outline of a chain in the plane: along the first ruling, up the top edges, back along
    the last ruling and down the base edges. Edges that are a point are left out."""
    first, last = pairs[0], pairs[-1]
    edges = [
        _ruling_edge("start", *first, first[0].domain[0], upwards=True),
        *(edge for pair in pairs for edge in _rail_edges("top", *pair, *pair[0].domain)),
        _ruling_edge("end", *last, last[0].domain[1], upwards=False),
        *(edge for pair in reversed(pairs) for edge in _rail_edges("base", *pair, *pair[0].domain)),
    ]
    return _without_points(edges)


def cut_border(
    chain: Chain, pairs: Pairs, cuts: tuple[Cut, ...]
) -> tuple[tuple[Edge, ...], tuple[tuple[Edge, ...], ...]]:
    """The outline that cuts leave of a chain's border, counterclockwise, and the holes inside it,
    each clockwise.

    An edge that is cut into several stays several of the same name, over less of their u; what
    is cut is named "cutout", over the u of its track. The ends meet to rounding.

    Raises:
        GeometryError: the cutouts part the panel, or leave nothing of it.
    """
    cell = whole(cuts, chain)
    if len(cell.loops) != 1:
        what = f"part the panel in {len(cell.loops)}" if cell.loops else "leave nothing of it"
        raise GeometryError(
            f"the cutouts {what}",
            value=len(cell.loops),
            limit=1,
            remedy="make them smaller or move them, or make several panels",
        )
    (loop,) = cell.loops
    stretches = [(p.side, p.start, k) for k, p in enumerate(loop) if isinstance(p, Stretch)]
    first = min(stretches)[2] if stretches else 0
    around = (*loop[first:], *loop[:first])
    runs = [part for part in around if isinstance(part, Run)]
    cut = _run_edges([*runs, *cell.holes], pairs, cuts)
    crossing = iter(cut)
    edges: list[Edge] = []
    for part in around:
        edges += next(crossing) if isinstance(part, Run) else _stretch_edges(part, pairs)
    return _without_points(edges), tuple(cut[len(runs) :])


def healed(
    outline: tuple[Edge, ...], holes: tuple[tuple[Edge, ...], ...]
) -> tuple[tuple[Edge, ...], tuple[tuple[Edge, ...], ...]]:
    """An outline and its holes without a first and last ruling that are one line.

    A flat disc is cut round and not along a radius; the other rim of a ring becomes a hole.
    """
    names = [edge.name for edge in outline]
    if names[0] != SIDES[0] or names.count(SIDES[0]) != 1 or names.count(SIDES[2]) != 1:
        return outline, holes
    k = names.index(SIDES[2])
    start, end = (edge.curve(edge.u[[0, -1]])[0] for edge in (outline[0], outline[k]))
    size = float(np.hypot(*np.ptp(np.concatenate([start, end]), axis=0)))
    if np.abs(start - end[::-1]).max() > ONE_LINE * size:
        return outline, holes
    rims = sorted(filter(None, (outline[1:k], outline[k + 1 :])), key=enclosed_area)
    return rims[-1], (*holes, *rims[:-1])


def _run_edges(runs: Sequence[Run], pairs: Pairs, cuts: Sequence[Cut]) -> list[tuple[Edge, ...]]:
    """The edges of runs of cuts, one for each piece."""
    lengths = [(cuts[p.cut].tracks[p.track], p.u) for run in runs for p in run.pieces]
    edges = iter(
        Edge(CUTOUT, image, within(track.series.knots, *u))
        for image, (track, u) in zip(track_images(lengths, pairs), lengths, strict=True)
    )
    return [tuple(itertools.islice(edges, len(run.pieces))) for run in runs]


def _without_points(edges: list[Edge]) -> tuple[Edge, ...]:
    corners = np.concatenate([e.curve(e.u)[0] for e in edges])
    size = float(np.linalg.norm(np.ptp(corners, axis=0)))
    return tuple(e for e in edges if length_bound(e) > COLLAPSED * size)


def _stretch_edges(stretch: Stretch, pairs: Pairs) -> list[Edge]:
    """What is left of one side of the border, as edges."""
    patch, unrolled = pairs[stretch.patch]
    name = SIDES[stretch.side]
    if stretch.side in (1, 3):
        low, high = sorted((stretch.start, stretch.end))
        return _rail_edges(name, patch, unrolled, low, high)
    t = patch.domain[stretch.side // 2]
    curve = _ruling_edge(name, patch, unrolled, t, upwards=stretch.side == 0).curve
    return [Edge(name, curve, np.array([stretch.start, stretch.end]))]


def _rail_edges(name: str, patch: Patch, unrolled: Unrolled, low: float, high: float) -> list[Edge]:
    """The image of the extent's end: t increases along the top and decreases along the base.

    In pieces where it has a corner: the edge of a thick sheet's middle, which stands square to
    a skin that was cut aslant, has one wherever the bending jumps.
    """
    top = name == "top"

    def curve(t: Array) -> tuple[Array, Array]:
        f = patch.frame(t)
        jet = patch.jet(t, 1)
        v, slope = (jet.v_to if top else jet.v_from)[:2]
        origin, e, m = unrolled.axes(t)
        tangent = (f.p + slope)[:, None] * e + (f.q + v * f.a)[:, None] * m
        return origin + v[:, None] * e, tangent

    knots = within(patch.segments, low, high)
    inner = knots[1:-1]
    reach = 1e-9 * (knots[-1] - knots[0])  # a smooth edge turns by as little over this
    before, after = (_heading(curve(inner + side * reach)[1]) for side in (-1.0, 1.0))
    kinks = np.flatnonzero(np.abs(np.angle(after / before)) > KINK) + 1
    pieces = np.split(knots, kinks)
    runs = [
        np.append(piece, following[:1])
        for piece, following in itertools.zip_longest(pieces, pieces[1:], fillvalue=knots[:0])
    ]
    edges = [Edge(name, kept_inside(curve, run), run if top else run[::-1].copy()) for run in runs]
    return edges if top else edges[::-1]


def _heading(slopes: Array) -> NDArray[np.complex128]:
    """Plane directions as unit complex numbers; 1 where there is none."""
    z = slopes[:, 0] + 1j * slopes[:, 1]
    size = np.abs(z)
    return np.divide(z, size, out=np.ones_like(z), where=size > 0.0)


def _ruling_edge(name: str, patch: Patch, unrolled: Unrolled, t: float, *, upwards: bool) -> Edge:
    """The image of one ruling, u = v."""
    at = np.array([t])
    jet = patch.jet(at, 0)
    origin, direction = (axis[0] for axis in unrolled.axes(at)[:2])
    ends = np.array([jet.v_from[0, 0], jet.v_to[0, 0]])

    def curve(v: Array) -> tuple[Array, Array]:
        return origin + v[:, None] * direction, np.broadcast_to(direction, (len(v), 2))

    return Edge(name, curve, ends if upwards else ends[::-1].copy())
