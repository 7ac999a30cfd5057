"""What leather and cloth ask for: the arrow along the grain, the lines up to which turned edges
are skived, and by how much a layer that lies outside is longer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from devcad.flatten import clipping
from devcad.flatten.pattern import CUTOUT, Edge, Pattern, length_bound
from devcad.flatten.shapes import line
from devcad.geometry.chain import Chain
from devcad.geometry.taylor import Array
from devcad.part import Panel
from devcad.shop.offset import offset_edge
from devcad.shop.room import free_room
from devcad.shop.settings import EdgeFinish, EdgeName

GRAIN, MARK = "GRAIN", "MARK"
RIMS: tuple[EdgeName, ...] = ("base", "top")
"""The edges along which a sheet bends; the others are straight rulings."""
LENGTHS = (0.5, 0.4, 0.3, 0.22, 0.16, 0.12, 0.08, 0.05, 0.0)
"""Of the sheet's reach along the grain: the lengths of an arrow, the first that has room."""
LONGEST, SHORTEST = 300.0, 10.0
"""mm, of an arrow."""
HEAD, LARGEST_HEAD = 0.12, 6.0
"""The strokes of a head along the arrow: a share of its length, mm at most."""
WIDE = 0.35
"""How far they spread, as a share of that, to either side."""
MARGIN = 1.0
"""mm between an arrow and whatever else."""
FINE = 0.02
"""mm; what the polygons of a pattern may leave its curves by."""
PARTS, GAUSS = 64, 6
"""Of the quadrature of bending between two breaks of a patch: steps, and nodes in each."""


def grained(
    pattern: Pattern,
    grain: float,
    *,
    net: tuple[Edge, ...] = (),
    obstacles: Sequence[Edge] = (),
) -> tuple[Pattern, tuple[str, ...]]:
    """The pattern with an arrow along its grain (radians from +x), and a note where it has no room.

    The arrow has two heads, for the piece may lie either way round: the nest turns it by half a
    turn, and by no other angle. Drawings of the role GRAIN: the shaft, then the heads. It lies
    inside the outline and ``net`` (the seam line, if it is another), 1 mm from these, from holes,
    drawings and ``obstacles`` at least, on bend lines and rulings where nothing else is left.
    """
    way = np.array([np.cos(grain), np.sin(grain)])
    room = free_room(pattern, FINE, net=net, obstacles=obstacles)
    if room is not None:
        corners = np.concatenate([edge.curve(edge.u)[0] for edge in pattern.outline])
        reach = max(float(np.ptp(corners @ way)), float(np.ptp(room.centres @ way)))
        for share in LENGTHS:
            length = min(max(share * reach, SHORTEST), LONGEST)
            head = min(HEAD * length, LARGEST_HEAD)
            margin = MARGIN + room.bound
            size = length + 2.0 * margin, 2.0 * (WIDE * head + margin)
            boxes = (room.best(*size, angle=grain, cross=cross) for cross in room.levels)
            box = next((one for one in boxes if one is not None), None)
            if box is not None:
                drawn = (*pattern.drawings, *_arrow(box.centre, way, length, head))
                return replace(pattern, drawings=drawn), ()
    return pattern, (f"the grain's arrow ({np.degrees(grain):.6g} degrees) has no room",)


def _arrow(middle: Array, way: Array, length: float, head: float) -> tuple[Edge, ...]:
    """A shaft and its two heads, each one stroke over the tip."""
    across = WIDE * head * np.array([-way[1], way[0]])
    tail, tip = middle - 0.5 * length * way, middle + 0.5 * length * way
    out = [line(tail, tip, GRAIN)]
    for end, back in ((tip, -head * way), (tail, head * way)):
        out += [line(end + back + across, end, GRAIN), line(end, end + back - across, GRAIN)]
    return tuple(out)


def skived(
    pattern: Pattern,
    net: tuple[Edge, ...],
    finishes: Mapping[EdgeName, EdgeFinish],
    thickness: float,
) -> tuple[Pattern, tuple[str, ...]]:
    """The pattern with a MARK line along every turned edge, and notes.

    From the line to the cut edge the leather is skived before it is folded: it runs inside the
    fold, the seam line of ``net`` (the outline without allowances), one thickness away, so that
    the bend itself lies in thin leather. It is prolonged straight to the outline and ends there
    and at holes.
    """
    turned = [name for name, finish in finishes.items() if finish.finish == "turned"]
    if not turned or thickness <= 0.0:
        return pattern, ()
    contours = [
        tuple(replace(edge, name=CUTOUT) for edge in contour)
        for contour in (pattern.outline, *pattern.holes)
    ]
    sheet = clipping.sheet(contours[0], contours[1:])
    reach = max(finish.allowance for finish in finishes.values()) + 4.0 * thickness
    drawn: list[Edge] = []
    for run in _runs(net, turned):
        inner = [replace(offset_edge(edge, -thickness), name=MARK) for edge in run]
        inner = [_forward(edge) for edge in inner]
        ends = (_prolonged(inner[0], 0, reach), _prolonged(inner[-1], -1, reach))
        parts = [part for edge in (ends[0], *inner, ends[1]) for part in sheet.edge(edge)]
        drawn += [part for part in parts if length_bound(part) > FINE]
    words = ", ".join(turned)
    note = f"skive from the marked line to the edge before turning: {words}"
    return replace(pattern, drawings=(*pattern.drawings, *drawn)), (note,)


def _runs(net: tuple[Edge, ...], names: Sequence[str]) -> list[list[Edge]]:
    """The edges of these names with length, one list for each name."""
    runs = [[edge for edge in net if edge.name == name] for name in names]
    return [run for run in runs if sum(map(length_bound, run)) > 0.0]


def _forward(edge: Edge) -> Edge:
    """The same line run over an increasing parameter from 0."""
    first, last = float(edge.u[0]), float(edge.u[-1])
    way = 1.0 if last >= first else -1.0

    def curve(s: Array) -> tuple[Array, Array]:
        points, slopes = edge.curve(first + way * s)
        return points, way * slopes

    return Edge(edge.name, curve, way * (edge.u - first))


def _prolonged(edge: Edge, end: int, reach: float) -> Edge:
    """The straight line from an end of an edge on, along its tangent."""
    points, slopes = edge.curve(edge.u[[0, -1]])
    way = slopes[end] / np.hypot(*slopes[end])
    if end == 0:
        return line(points[0] - reach * way, points[0], edge.name)
    return line(points[-1], points[-1] + reach * way, edge.name)


def layer_figures(panel: Panel, finishes: Mapping[EdgeName, EdgeFinish]) -> dict[str, float]:
    """``outer_layer``: by how many mm a second layer outside of a lapped or turned base or top is
    longer than the panel there; nothing where no such edge is bent.

    The panel's own pattern stays as it is: which of two pieces lies outside is not among what a
    job says, and a piece that does is to be described with its own, larger radius.
    """
    layered = any(finishes[name].finish in ("lap", "turned") for name in RIMS if name in finishes)
    if not layered or panel.thickness <= 0.0:
        return {}
    longer = outer_layer(panel.blank.middle if panel.blank else panel.chain, panel.thickness)
    return {"outer_layer": longer} if longer > 0.0 else {}


def outer_layer(chain: Chain, thickness: float) -> float:
    """By how much longer a layer is that lies outside of this sheet along its base or top, mm.

    The sheet turns by theta along them; two layers of one thickness have their middles one
    thickness apart, so the outer one is longer by theta x thickness: exactly, whatever the
    bending, where it all goes one way; where it goes both ways this is the most, for the layers
    change places. Folds at creases count too.
    """
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
    total = sum(abs(joint.angle) for joint in chain.joints)
    if chain.closing is not None:
        total += abs(chain.closing.angle)
    for patch in chain.patches:
        for low, high in pairwise(patch.segments.tolist()):
            ends = np.linspace(low, high, PARTS + 1)
            half = 0.5 * (ends[1] - ends[0])
            t = (0.5 * (ends[1:] + ends[:-1]) + half * nodes[:, None]).T.ravel()
            c = patch.frame(t).c.reshape(PARTS, -1)
            total += half * float((np.abs(c) @ weights).sum())
    return float(total) * thickness
