"""Tabs of paper and card: flaps that are folded along an edge and glued under its mate.

A straight edge has one trapezium. A curved one has a row of teeth between V cuts that go down to
the edge, so that each folds along a nearly straight root: the arc of a root stands at most about
a hundredth of the tab's height off its chord (w^2 / 8 R for a root w), but no tooth is narrower
than a quarter of its height. Teeth that would meet in a narrow hollow are lower, or left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from devcad.flatten.loops import cross
from devcad.flatten.pattern import Edge
from devcad.flatten.polygons import places
from devcad.flatten.shapes import line
from devcad.flatten.trace import evaluate, turns, unit_tangents
from devcad.geometry.taylor import Array
from devcad.shop.corners import CORNER, between
from devcad.shop.polygons import fine_polygon

GLUE = "GLUE"
"""The role of glue areas."""
BEVEL = float(np.radians(45.0))
"""The angle between a tab's end and its root, where the corner leaves room for it."""
FLATTEST = 1e-9
"""rad; a bevel of nothing, which leaves no tab."""
SHARE = 0.8
"""Of the room that a corner leaves: what a tab's end takes; the rest parts it from the others."""
SAGITTA = 0.01
"""Of the height: how far the arc of a root stands off its chord."""
NARROWEST = 0.25
"""Of the height: the smallest root of a tooth in a row."""
TOP = 0.25
"""Of the root: the least that a tab's outer side keeps; the tab is lower where it must be."""
SPREAD = 1.1
"""Of the angle between the roots of two teeth in a hollow: what the V between them opens."""
LOWEST = 0.05
"""Of the height asked for: a lower tab is left out."""
MARGIN = 1.0
"""mm between a tab's outline and its glue area, less on tabs below 5 mm."""
LOWER = (0.5, 0.5, 0.0)
"""How teeth give way that meet: twice to half their height, then they are left out."""
MEETING = 1e-6
"""Of the smaller of two teeth: an overlap is one from here on."""
FINER, TRIES = 1.15, 12
ROUGH = 2.0  # times the sagitta: what a root that is bent at one end only may have


@dataclass(frozen=True, slots=True)
class Tab:
    """A tab on the piece ``edge`` of an outline, ``root`` its ends (2, 2); ``insets``
    (2,) say by how much its outer side is shorter at either end at the full ``height`` in mm,
    ``share`` how much of both it has."""

    edge: Edge
    root: Array
    insets: Array
    height: float
    share: float

    @property
    def there(self) -> bool:
        """Whether it is high enough to be made."""
        return self.share >= LOWEST

    def corners(self) -> Array:
        """Its corners, (4, 2), counterclockwise, the ends of the root first and last."""
        a, b = self.root
        along = (b - a) / np.hypot(*(b - a))
        out = self.height * np.array([along[1], -along[0]])
        first, last = self.insets
        return np.array(
            [a, a + self.share * (first * along + out), b - self.share * (last * along - out), b]
        )

    def outline(self) -> tuple[Edge, ...]:
        """What is cut over the root, from its start to its end."""
        if not self.there:
            return (self.edge,)
        return tuple(line(p, q, CORNER) for p, q in pairwise(self.corners()))

    def glue(self) -> tuple[Edge, ...]:
        """The glue area, a closed contour of four straight edges."""
        if not self.there:
            return ()
        tab = self.corners()
        root = float(np.hypot(*(tab[3] - tab[0])))
        area = _inside(tab, min(MARGIN, 0.2 * self.share * self.height, 0.125 * root))
        return tuple(line(p, q, GLUE) for p, q in pairwise([*area, area[0]]))


def bevel(sheet: float, room: float) -> float:
    """The angle between a tab's end and its root at a corner: 45 degrees, less where the sheet is
    more pointed (``sheet``, its angle there) or where there is less ``room``; radians."""
    return max(min(BEVEL, sheet, SHARE * room), FLATTEST)


def tabs(edge: Edge, height: float, bevels: tuple[float | None, float | None]) -> tuple[Tab, ...]:
    """The tabs on an edge of a counterclockwise outline, ``height`` mm to the right of its run.

    ``bevels`` are the angles between the ends of the row and their roots, radians, None where
    the edge goes on smoothly and a V parts its tabs.
    """
    u, hollow = _roots(edge, height)
    points = edge.curve(u)[0]
    chords = np.hypot(*np.diff(points, axis=0).T)
    x = height * hollow
    slope = np.minimum(height, chords * np.maximum(0.25 * (1.0 + x), 0.5 * SPREAD * x))
    insets = np.column_stack([slope, slope])
    insets[0, 0] = _inset(bevels[0], height, insets[0, 0])
    insets[-1, 1] = _inset(bevels[1], height, insets[-1, 1])
    low = np.minimum(1.0, (1.0 - TOP) * chords / insets.sum(axis=1))
    return tuple(
        Tab(between(edge, u[k], u[k + 1]), points[k : k + 2], insets[k], height, float(low[k]))
        for k in range(len(chords))
    )


def parted(rows: Sequence[tuple[Tab, ...]], rest: Sequence[Edge]) -> list[tuple[Tab, ...]]:
    """The same rows, the teeth lower that reach into each other or into the ``rest`` of the outline
    (counterclockwise, without tabs), left out where there is no room: at the end of a narrow
    hollow. A tab that has its edge to itself keeps its height, and so does a row of which more
    than half would be lower.
    """
    made = [list(row) for row in rows]
    body = fine_polygon(tuple(rest), 1e-3 * min(row[0].height for row in rows))[0]
    for factor in LOWER:
        places = [(r, k) for r, row in enumerate(made) for k, tab in enumerate(row) if tab.there]
        hit = _colliding([made[r][k] for r, k in places], body)
        if not hit:
            break
        for at in hit:
            r, k = places[at]
            if len(made[r]) > 1:
                made[r][k] = replace(made[r][k], share=factor * made[r][k].share)
    lower = [
        sum(a.share != b.share for a, b in zip(*pair, strict=True))
        for pair in zip(made, rows, strict=True)
    ]
    return [
        tuple(new) if 2 * count <= len(row) else row
        for new, row, count in zip(made, rows, lower, strict=True)
    ]


def _colliding(teeth: Sequence[Tab], body: Array) -> list[int]:
    """The tabs that reach into another one or over the outline without tabs (k, 2)."""
    import shapely

    corners = [tab.corners() for tab in teeth]
    shapes = np.array([shapely.Polygon(points) for points in corners])
    tree = shapely.STRtree(shapes)
    one, other = tree.query(shapes, predicate="intersects")
    different = one < other
    one, other = one[different], other[different]
    met = shapely.area(shapely.intersection(shapes[one], shapes[other]))
    over = met > MEETING * np.minimum(shapely.area(shapes[one]), shapely.area(shapes[other]))
    sides = [shapely.LineString(_raised(points)) for points in corners]
    inside = np.flatnonzero(shapely.intersects(np.array(sides), shapely.Polygon(body)))
    return sorted({*one[over].tolist(), *other[over].tolist(), *inside.tolist()})


def _raised(tab: Array) -> Array:
    """The sides of a tab away from its root, which the sheet passes by the root's sagitta."""
    return np.array(
        [tab[0] + 0.2 * (tab[1] - tab[0]), tab[1], tab[2], tab[3] + 0.2 * (tab[2] - tab[3])]
    )


def _inset(angle: float | None, height: float, smooth: float) -> float:
    """How much shorter than its root a tab of that height is at the row's end."""
    return smooth if angle is None else float(height / np.tan(angle))


def _inside(tab: Array, margin: float) -> Array:
    """The corners of a convex counterclockwise polygon (n, 2) with its sides moved inwards."""
    along = np.roll(tab, -1, axis=0) - tab
    along = along / np.hypot(*along.T)[:, None]
    before = np.roll(along, 1, axis=0)
    # the point at the distance of both sides: margin (t - b) / (b x t) from the corner
    turn = cross(before, along)
    return np.asarray(tab + margin * (along - before) / turn[:, None])


def _roots(edge: Edge, height: float) -> tuple[Array, Array]:
    """The parameters of a row's roots in the order of the run, (n + 1,), and how much the edge
    curls outwards over each at most, 1/mm, at least 0, (n,)."""
    u = _dense(edge, height)
    points, slopes = evaluate(edge, u)
    tangents, _ = unit_tangents(edge, points, slopes)
    steps = np.hypot(*np.diff(points, axis=0).T)
    bent = -turns(tangents)  # to the right, that is outwards
    wanted = np.sqrt(np.abs(bent) * steps / (8.0 * SAGITTA * height))
    wanted = np.minimum(wanted, steps / (NARROWEST * height))
    run = np.concatenate([[0.0], np.cumsum(wanted)])
    number = max(1, int(np.ceil(run[-1] - 1e-6)))
    for _ in range(TRIES):
        at = np.interp(np.linspace(0.0, run[-1], number + 1), run, np.arange(len(u)))
        at[[0, -1]] = 0.0, len(u) - 1.0
        if _straight(points, at, height) or number * NARROWEST * height > steps.sum():
            break
        number = int(np.ceil(FINER * number))
    rate = np.divide(bent, steps, out=np.zeros_like(bent), where=steps > 0.0)
    low, high = np.floor(at[:-1]).astype(int), np.ceil(at[1:]).astype(int)
    curl = np.array([max(0.0, float(rate[a:b].max())) for a, b in zip(low, high, strict=True)])
    return np.interp(at, np.arange(len(u)), u), curl


def _dense(edge: Edge, height: float) -> Array:
    """Parameters in the order of the run, many for a tooth."""
    return places(Edge(CORNER, edge.curve, edge.u), 1e-4 * height)


def _straight(points: Array, at: Array, height: float) -> bool:
    """Whether the samples over every root are as near to its chord as they should be."""
    for low, high in zip(np.floor(at[:-1]).astype(int), np.ceil(at[1:]).astype(int), strict=True):
        chord, away = points[high] - points[low], points[low : high + 1] - points[low]
        off = np.abs(cross(chord, away)).max() / max(float(np.hypot(*chord)), np.finfo(float).tiny)
        if off > ROUGH * SAGITTA * height:
            return False
    return True
