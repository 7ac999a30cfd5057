"""Stitch holes along seams: as many on either side, hole k over hole k in space."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from devcad.checks import Check
from devcad.errors import GeometryError
from devcad.flatten.pattern import STITCH, Edge, Pattern
from devcad.flatten.rings import backwards
from devcad.flatten.shapes import arc, slot
from devcad.flatten.sheets import moved
from devcad.geometry.taylor import Array, rows_dot
from devcad.part import Part
from devcad.shop.corners import place
from devcad.shop.notches import Anchor
from devcad.shop.polygons import fine_polygon
from devcad.shop.seamends import Edges, allowance_of
from devcad.shop.seamlines import (
    Feet,
    Flags,
    Holes,
    SeamLine,
    at_length,
    face,
    feet,
    hole_centres,
    mates,
    seam_line,
)
from devcad.shop.settings import Stitch
from devcad.shop.spreading import LEAST, Spread, spread
from devcad.shop.stitchproof import prove

SLIT = 0.3
"""mm; how wide a slit is: cut files hold closed cuts alone. At most a third of its length."""
CLEAR = 0.75
"""Of a hole's width: across the seam nothing is drawn or notched so near to its middle."""
FINE = 1e-2
"""Of a hole's size: how finely it is drawn to see what it runs into."""

Contour = tuple[Edge, ...]


@dataclass(frozen=True, slots=True)
class Stitched:
    """What a part's seams are sewn with, by the panel's name.

    ``holes`` are closed contours, clockwise, their edges named "stitch"; ``anchors`` the places
    for notches; ``facts`` say of each edge its mate, its count and its pitch. ``seams`` has an
    entry for each of the part's: count (of each side), pitch_mm (the real one on average),
    pitch_off (the largest share by which a step misses the pitch asked for) and largest_gap_mm
    (in space, between the feet of two holes that belong together). ``checks`` are their proofs.
    """

    holes: dict[str, tuple[Contour, ...]] = field(default_factory=dict)
    anchors: dict[str, tuple[Anchor, ...]] = field(default_factory=dict)
    facts: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    seams: tuple[dict[str, Any], ...] = ()
    checks: tuple[Check, ...] = ()


def stitched(
    part: Part,
    edges: Edges,
    stitch: Stitch,
    *,
    reference: str = "middle",
    every: int = 0,
    pair: float = 0.0,
    pierced: bool = True,
) -> Stitched:
    """The stitch holes of all seams of a part, in the patterns as they are before allowances.

    The holes of a seam lie at equal lengths in space on both sides, as :func:`spread` says, and at
    ``inset`` from the edge that will be cut: (inset - allowance) inwards of the seam line, square
    to it, and at its corners on the bisector. Lengths are those of the face that the job
    describes, ``reference``; a place is carried to the pattern by the sheet's own parameters, so
    a thick sheet's pitch there differs as its fibres do. Where two seams meet in one corner of a
    panel the hole there belongs to the first; the later one begins with its next hole.

    Args:
        edges: by the panel's name, what is done with its edges.
        every: at every so-manieth hole there is an anchor for a notch; 0 for none.
        pair: the first of them are two, so far along the seam before and behind their hole, mm,
            so that mates are not turned round.
        pierced: whether there are holes; else there are only anchors.
    Raises:
        GeometryError: no room for a hole, edges that do not run along each other, holes that
            fold over, an edge that is cut away where a hole belongs, edges with two allowances.
    """
    _refuse_third_layers(part)
    panels = {panel.name: panel for panel in part.panels}
    named = {name for meeting in part.seams for name, _ in meeting.edges}
    faces = {name: face(panels[name], reference) for name in sorted(named)}
    taken: dict[str, Array] = defaultdict(lambda: np.empty((0, 2)))
    out: list[tuple[SeamLine, Spread, tuple[Holes, Holes]]] = []
    for meeting in part.seams:
        line = seam_line(meeting, panels, faces)
        found = spread(line, edges, stitch)
        sides = _both(line, found, edges, stitch)
        clash = _clashing(line, sides, taken, stitch) & found.end
        if clash.any():
            found = found.without(clash)
            sides = _both(line, found, edges, stitch)
        if not len(found.s):
            raise GeometryError(
                "stitch: all holes of the seam lie in those of other seams",
                place=line.place,
                value=line.length,
                remedy="use a smaller pitch, or leave the seam out",
            )
        for panel, side in zip(line.sides, sides, strict=True):
            taken[panel.name] = np.concatenate([taken[panel.name], side.centres])
        out.append((line, found, sides))
    return _told(out, edges, stitch, (every, pair), pierced)


def _refuse_third_layers(part: Part) -> None:
    """GeometryError for an edge that is sewn twice: its holes would be there already."""
    seen: dict[tuple[str, str], int] = {}
    for number, meeting in enumerate(part.seams, 1):
        for edge in meeting.edges:
            if edge in seen:
                raise GeometryError(
                    f"stitch: the edge {'.'.join(edge)} is in seam {seen[edge]} already",
                    place=f"seam {number}",
                    value=2,
                    limit=1,
                    remedy="leave this seam out; a further layer takes the holes of the first two",
                )
            seen[edge] = number


def _both(line: SeamLine, found: Spread, edges: Edges, stitch: Stitch) -> tuple[Holes, Holes]:
    """The holes of both sides of a seam in their patterns."""
    x = at_length(line.borders[0], found.s)
    x = np.where(found.corner, np.round(x), x)
    places = (x, mates(line, x, found.corner))
    first, second = (
        _side(line, side, there, found.corner, edges, stitch) for side, there in enumerate(places)
    )
    return first, second


def _side(
    line: SeamLine, side: int, x: Array, corner: Flags, edges: Edges, stitch: Stitch
) -> Holes:
    panel, edge = line.sides[side], line.borders[side]
    offset = allowance_of(edges, panel.name, edge.name) - stitch.inset
    holes = hole_centres(panel, edge, x, offset, corner)
    ahead = np.diff(holes.feet.points, axis=0)
    turned = np.flatnonzero(rows_dot(np.diff(holes.centres, axis=0), ahead) < 0.0)
    if turned.size:
        at = holes.feet.points[int(turned[0])]
        raise GeometryError(
            f"stitch: {abs(offset):.4g} mm beside the edge {edge.name} the holes run backwards: it "
            "curls there with a smaller radius",
            place=place(at),
            panel=panel.name,
            value=abs(offset),
            remedy="use an inset nearer to the allowance, or a larger radius",
        )
    return holes


def _clashing(
    line: SeamLine, sides: tuple[Holes, Holes], taken: dict[str, Array], stitch: Stitch
) -> Flags:
    """Which holes lie too near to those of earlier seams, on either side, (n,)."""
    near = max(LEAST * stitch.pitch, 2.0 * stitch.diameter)
    out = np.zeros(len(sides[0].centres), dtype=bool)
    for panel, holes in zip(line.sides, sides, strict=True):
        away = holes.centres[:, None] - taken[panel.name]
        out |= (np.hypot(away[..., 0], away[..., 1]) < near).any(axis=1)
    return out


def _told(
    sewn: Sequence[tuple[SeamLine, Spread, tuple[Holes, Holes]]],
    edges: Edges,
    stitch: Stitch,
    notches: tuple[int, float],
    pierced_too: bool,
) -> Stitched:
    """The contours, the anchors, what the report says, and the proofs."""
    contours: dict[str, list[Contour]] = defaultdict(list)
    anchors: dict[str, list[Anchor]] = defaultdict(list)
    facts: dict[str, list[dict[str, Any]]] = defaultdict(list)
    seams, checks = [], []
    for line, found, sides in sewn:
        proof = prove(line, (sides[0].centres, sides[1].centres))
        checks.append(proof.check)
        steps = found.step[1:][np.diff(found.stretch) == 0]
        pitch = float(steps.mean()) if steps.size else None
        off = float(np.abs(steps / stitch.pitch - 1.0).max()) if steps.size else None
        seams.append(
            {
                "count": len(found.s),
                "pitch_mm": pitch,
                "pitch_off": off,
                "largest_gap_mm": proof.apart if np.isfinite(proof.apart) else None,
            }
        )
        for side, (panel, holes) in enumerate(zip(line.sides, sides, strict=True)):
            edge, mate = line.names[side][1], line.names[1 - side]
            offset = allowance_of(edges, panel.name, edge) - stitch.inset
            if pierced_too:
                contours[panel.name] += _contours(holes, stitch)
                facts[panel.name].append(
                    {
                        "edge": edge,
                        "mate": ".".join(mate),
                        "count": len(found.s),
                        "pitch": pitch,
                        "hole": f"{stitch.hole} {stitch.diameter:g}",
                        "inset": stitch.inset,
                    }
                )
            hole = (offset if pierced_too else float("nan"), CLEAR * _across(stitch))
            anchors[panel.name] += [
                Anchor(edge, point, normal, *hole)
                for there in _notched(line, side, found, holes, notches)
                for point, normal in zip(there.points, there.normals, strict=True)
            ]
    return Stitched(
        {name: tuple(each) for name, each in contours.items()},
        {name: tuple(each) for name, each in anchors.items()},
        dict(facts),
        tuple(seams),
        tuple(checks),
    )


def _notched(
    line: SeamLine, side: int, found: Spread, holes: Holes, notches: tuple[int, float]
) -> list[Feet]:
    """The places for notches on one side: every so-manieth hole but the first, the last, and
    corners; in place of the first of them two, as far along the seam before and behind it."""
    every, pair = notches
    numbers = [
        k
        for k in (range(every, len(found.s) - 1, every) if every else ())
        if not found.corner[k] and not found.end[k]
    ]
    if not numbers:
        return []
    alone, at = numbers[1:] if pair else numbers, holes.feet
    out = [Feet(at.points[alone], at.tangents[alone], at.normals[alone])]
    if pair:
        s = found.s[numbers[0]] + np.array([-pair, pair])
        x = at_length(line.borders[0], np.mod(s, line.length) if line.borders[0].loop else s)
        x = mates(line, x, np.zeros(2, dtype=bool)) if side else x
        out.append(feet(line.sides[side], line.borders[side], x))
    return out


def _contours(holes: Holes, stitch: Stitch) -> list[Contour]:
    """The holes as contours, clockwise; slits along the seam."""
    if stitch.hole == "round":
        radius = 0.5 * stitch.diameter
        return [(arc(centre, radius, (2.0 * np.pi, 0.0), STITCH),) for centre in holes.centres]
    shape = [
        replace(edge, name=STITCH) for edge in backwards(slot(stitch.diameter, _across(stitch)))
    ]
    angles = np.arctan2(holes.feet.tangents[:, 1], holes.feet.tangents[:, 0])
    return [
        tuple(moved(edge, float(angle), centre) for edge in shape)
        for angle, centre in zip(angles, holes.centres, strict=True)
    ]


def _across(stitch: Stitch) -> float:
    """How wide a hole is across the seam, mm."""
    return stitch.diameter if stitch.hole == "round" else min(SLIT, stitch.diameter / 3.0)


def pierced(pattern: Pattern, holes: Sequence[Contour]) -> Pattern:
    """The pattern with stitch holes, its area without them."""
    if not holes:
        return pattern
    from devcad.flatten.green import enclosed_area

    each = enclosed_area(_about_origin(holes[0]))  # they are all alike
    area = pattern.area + each * len(holes)
    return replace(pattern, holes=(*pattern.holes, *holes), area=area)


def _about_origin(contour: Contour) -> Contour:
    """A contour near the origin, where its area is not lost in rounding."""
    start = contour[0].curve(contour[0].u[:1])[0][0]
    return tuple(moved(edge, 0.0, -start) for edge in contour)


def refuse_clashes(pattern: Pattern, panel: str = "") -> None:
    """GeometryError where a stitch hole runs into the outline, a cutout or another hole."""
    stitches = [hole for hole in pattern.holes if hole[0].name == STITCH]
    if not stitches:
        return
    import shapely

    others = [hole for hole in pattern.holes if hole[0].name != STITCH]
    width = float(np.ptp(fine_polygon(stitches[0], np.inf)[0], axis=0).max()) or 1.0
    fine = FINE * width
    sheet = shapely.Polygon(fine_polygon(pattern.outline, fine)[0])
    shapes = [shapely.Polygon(fine_polygon(hole, fine)[0]) for hole in (*stitches, *others)]
    shapely.prepare(sheet)
    outside = np.flatnonzero(~shapely.contains_properly(sheet, shapes[: len(stitches)]))
    if outside.size:
        _refuse(shapes[int(outside[0])], "the edge that is cut", panel)
    one, other = shapely.STRtree(shapes).query(shapes, predicate="intersects")
    pairs = sorted((int(i), int(j)) for i, j in zip(one, other, strict=True) if i < j)
    for i, j in pairs:
        if i < len(stitches):
            what = "another stitch hole" if j < len(stitches) else "a cutout"
            _refuse(shapes[i], what, panel)


def _refuse(hole: Any, what: str, panel: str) -> None:
    point = np.array([hole.centroid.x, hole.centroid.y])
    left, low, right, high = hole.bounds
    width = max(right - left, high - low)
    raise GeometryError(
        f"stitch: a hole of {width:.4g} mm runs into {what}",
        place=place(point),
        panel=panel,
        value=width,
        limit=0.0,
        remedy="change the pitch or the inset, use smaller holes, or move the cutout",
    )
