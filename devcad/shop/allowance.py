"""Allowances: what a pattern has beyond its seam lines, so that it can be sewn, turned or glued.

What a corner does between two edges, of which one or both have an allowance:

- mitre: the cuts are prolonged until they meet, at most four allowances from the corner, else cut
  off at right angles to its bisector. Beside an edge without allowance the end follows that
  edge, prolonged straight; so do the sides of a notch, whatever the corner.
- square: the allowance of the edge that asks for it ends at right angles to its seam line, where
  that, prolonged, meets the neighbour's cut. Where both ask, the first or last ruling does so,
  for it is sewn before the rims; between two rims or two pieces of one edge it is a mitre.
- round: an arc about the corner; beside an edge without allowance a mitre.
- Where two edges ask differently, square goes before round and round before mitre. An edge
  without allowance has no say.
- turned: the flap ends along the mirror image of the neighbour's cut about the fold (on a curved
  fold, about its tangent at the corner), so that it lies on the sheet when folded. Two turned
  edges: along the mirrored bisector, so that the flaps meet; with square, at corners of up to
  110 degrees, along the mirrored neighbours, so that they overlap. So do the parts of one turned
  edge at a corner of 15 degrees or more.
- A hollow corner: cuts end where they cross (a straight step joins them where they do not, at very
  different distances); beside an edge without allowance the strip ends on
  the bisector of the hollow, so that the edge can be cut to its end.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np

from devcad.errors import GeometryError
from devcad.flatten.green import bounds, enclosed_area
from devcad.flatten.pattern import Edge, Pattern, length_bound
from devcad.geometry.taylor import Array
from devcad.shop.corners import CLOSED, SMOOTH, Joint, Side, place
from devcad.shop.flaps import End, end_between, turn
from devcad.shop.offset import crossing_at, left_of, side_of, size_of
from devcad.shop.settings import EDGES, EdgeFinish, EdgeName, Finish
from devcad.shop.tabs import Tab, bevel, parted, tabs

RULINGS = ("start", "end")
LINES: Mapping[Finish, str] = {"raw": "SEW", "turned": "SEW", "lap": "MARK", "tab": "SCORE"}
"""The role of the old edge: where it is sewn or folded over, where the mate's edge comes to lie,
where paper is folded."""
STRAIGHT = 1e-3
"""rad; edges that turn by less are one edge, its tabs parted by a V."""
KINK = np.radians(15.0)
"""A turned edge that turns by less at a corner of its own is folded over it without a cut."""
OVERLAPPING = np.radians(110.0)
"""The largest angle of a sheet at which flaps mirrored to either side have room; 120 degrees is
where they meet."""
PLAIN: tuple[End, End] = ("plain", "plain")


@dataclass(frozen=True, slots=True)
class Flap:
    """What an edge has beyond its seam line: its finish, how far it reaches outwards in mm, and
    the seam line, the edges of the pattern before, in the order of the run."""

    name: EdgeName
    finish: Finish
    distance: float
    seam: tuple[Edge, ...]


@dataclass(frozen=True, slots=True)
class Allowed:
    """A pattern with its allowances, and of each edge that has one what it is."""

    pattern: Pattern
    flaps: tuple[Flap, ...]


@dataclass(frozen=True, slots=True)
class _Row:
    """A side of the outline and what was asked for it, None without allowance."""

    side: Side
    asked: EdgeFinish | None

    @property
    def offset(self) -> EdgeFinish | None:
        """What was asked for a side that moves; tabs stand on theirs."""
        return None if self.asked is None or self.asked.finish == "tab" else self.asked


def allowed(pattern: Pattern, finishes: Mapping[EdgeName, EdgeFinish]) -> Allowed:
    """The pattern with an allowance beyond each edge that ``finishes`` name.

    A cut with an allowance is the parallel curve of its edge and keeps its name; ends, corners
    and tabs are named "corner". Holes stay. The edges that moved are drawn where they were: SEW
    (the seam, or the fold of a turned edge), MARK (where the mate of a lapped edge ends), SCORE
    (the fold of tabs, with their glue areas, GLUE).

    Raises:
        GeometryError: an allowance folds over itself in a hollow, or meets another part of the
            outline; it names the edge.
    """
    moved = {name: each for name, each in finishes.items() if each.allowance > 0.0}
    _refuse_inner_rim(pattern, moved)
    if not any(edge.name in moved for edge in pattern.outline):
        return Allowed(pattern, ())
    size = size_of(pattern.outline)
    rows = [
        _row(edge, moved.get(edge.name) if edge.name in EDGES else None)
        for edge in pattern.outline
        if length_bound(edge) > CLOSED * size
    ]
    outline, glue = _new_outline(rows, size)
    area = enclosed_area(outline) + sum(enclosed_area(hole) for hole in pattern.holes)
    seams = (edge for row in rows for edge in _seam(row))
    drawings = (*pattern.drawings, *seams, *glue)
    finished = replace(pattern, outline=outline, area=area, bbox=bounds(outline), drawings=drawings)
    return Allowed(finished, _flaps(rows, moved))


def _refuse_inner_rim(pattern: Pattern, moved: Mapping[EdgeName, EdgeFinish]) -> None:
    """GeometryError where the inner rim of a flat ring, which is a hole, is to move."""
    for hole in pattern.holes:
        name = next((edge.name for edge in hole if edge.name in moved), None)
        if name is not None:
            raise GeometryError(
                f"the edge {name} goes round a hole of the pattern, and holes have no allowance",
                place=name,
                value=next(each.allowance for key, each in moved.items() if key == name),
                limit=0.0,
                remedy="leave it out, or give the surface a gap, so that the ring is cut open",
            )


def _new_outline(rows: Sequence[_Row], size: float) -> tuple[tuple[Edge, ...], tuple[Edge, ...]]:
    """The outline with all allowances, and the glue areas of its tabs."""
    after = [*rows[1:], rows[0]]
    joints = [_joint(a, b, size) for a, b in zip(rows, after, strict=True)]
    kept = [_kept(row, joints[k - 1], joints[k]) for k, row in enumerate(rows)]
    teeth = {k: _teeth(rows[k - 1], row, after[k]) for k, row in enumerate(rows) if _tabbed(row)}
    old = tuple(row.side.source for row in rows)
    made = _outline(kept, joints, teeth)
    found = crossing_at(made, old, size)
    if found is not None and teeth:
        lower = parted(list(teeth.values()), _outline(kept, joints, {}))
        teeth = dict(zip(teeth, lower, strict=True))
        made = _outline(kept, joints, teeth)
        found = crossing_at(made, old, size)
    if found is not None:
        _refuse_overlap(rows, *found)
    return made, tuple(edge for row in teeth.values() for tab in row for edge in tab.glue())


def _row(edge: Edge, asked: EdgeFinish | None) -> _Row:
    distance = 0.0 if asked is None or asked.finish == "tab" else asked.allowance
    return _Row(side_of(edge, distance), asked)


def _flaps(rows: Sequence[_Row], moved: Mapping[EdgeName, EdgeFinish]) -> tuple[Flap, ...]:
    seams = {
        name: tuple(row.side.source for row in rows if row.side.source.name == name)
        for name in moved
    }
    return tuple(
        Flap(name, each.finish, each.allowance, seams[name])
        for name, each in moved.items()
        if seams[name]
    )


def _tabbed(row: _Row) -> bool:
    return row.asked is not None and row.asked.finish == "tab"


def _seam(row: _Row) -> tuple[Edge, ...]:
    """What is drawn where a side was."""
    if row.asked is None:
        return ()
    source = row.side.source
    return (Edge(LINES[row.asked.finish], source.curve, np.sort(source.u)),)


def _kept(row: _Row, before: Joint, after: Joint) -> Edge:
    """What its joints leave of a side's cut."""
    if row.offset is None:
        return row.side.edge
    try:
        return left_of(row.side, before, after)
    except GeometryError as error:
        raise _named(error, row) from None


def _outline(
    kept: Sequence[Edge], joints: Sequence[Joint], teeth: Mapping[int, tuple[Tab, ...]]
) -> tuple[Edge, ...]:
    """The cuts, or the tabs on them, and what joins them, in the order of the run."""
    out: list[Edge] = []
    for k, (edge, joint) in enumerate(zip(kept, joints, strict=True)):
        out += [part for tab in teeth[k] for part in tab.outline()] if k in teeth else [edge]
        out += joint.links
    return tuple(out)


def _teeth(before: _Row, row: _Row, after: _Row) -> tuple[Tab, ...]:
    """The tabs on a side that has some."""
    height = row.asked.allowance if row.asked else 0.0
    bevels = _bevel(before, row, before), _bevel(row, after, after)
    return tabs(row.side.source, height, bevels)


def _bevel(before: _Row, after: _Row, other: _Row) -> float | None:
    """The angle of a tab's end at the corner between two sides, of which the ``other`` is not the
    tab's; None at a smooth one."""
    bend = turn(before.side, after.side)
    if abs(bend) < STRAIGHT:
        return None
    sheet = np.pi - bend
    void = 2.0 * np.pi - sheet
    if bend < 0.0 or _tabbed(other):
        return bevel(sheet, 0.5 * void)
    ends, _ = _ends(before, after)
    room = {"mirror": void - sheet, "square": void - 0.5 * np.pi, "plain": void}
    return bevel(sheet, min(room[end] for end in ends))


# --- corners -------------------------------------------------------------------------------


def _joint(before: _Row, after: _Row, size: float) -> Joint:
    """The joint of two sides, by what was asked for both."""
    ends, kind = _ends(before, after)
    try:
        return end_between(before.side, after.side, ends, kind, size)
    except GeometryError as error:
        raise _named(error, *(row for row in (before, after) if row.offset)) from None


def _ends(before: _Row, after: _Row) -> tuple[tuple[End, End], str]:
    """How the strips of two sides end, and the kind of corner of plain ends."""
    one, other = before.offset, after.offset
    if one is None and other is None:
        return PLAIN, "mitre"
    words = {asked.corner for asked in (one, other) if asked is not None}
    if turn(before.side, after.side) < -SMOOTH:
        if one is not None and other is not None:
            return PLAIN, "mitre"
        return _at("bisector", one is not None), "mitre"
    same = before.side.source.name == after.side.source.name
    folds = [asked is not None and asked.finish == "turned" for asked in (one, other)]
    if any(folds) and not (same and turn(before.side, after.side) < KINK):
        if not all(folds):
            return _at("mirror", folds[0]), "mitre"
        pointed = np.pi - turn(before.side, after.side) <= OVERLAPPING
        both: End = "mirror" if "square" in words and pointed else "half"
        return (both, both), "mitre"
    if "square" in words and not same and "cutout" not in _names(before, after):
        which = _squared(before, after)
        return PLAIN if which is None else _at("square", which), "mitre"
    alone = one is None or other is None
    return PLAIN, "round" if "round" in words and not alone else "mitre"


def _squared(before: _Row, after: _Row) -> bool | None:
    """Whether it is the first of two sides that ends square; None where neither does."""
    asks = [row.offset is not None and row.offset.corner == "square" for row in (before, after)]
    if not all(asks):
        return asks[0]
    sewn = [name in RULINGS for name in _names(before, after)]
    return None if sewn[0] == sewn[1] else sewn[0]


def _names(before: _Row, after: _Row) -> tuple[str, str]:
    return before.side.source.name, after.side.source.name


def _at(end: End, first: bool) -> tuple[End, End]:
    """The ends of two sides of which one is not plain."""
    return (end, "plain") if first else ("plain", end)


# --- refusals ------------------------------------------------------------------------------


def _named(error: GeometryError, *rows: _Row) -> GeometryError:
    """An error of the offset in the words of the edges that it is about."""
    words = [f"{row.side.source.name} ({row.asked.allowance:.4g} mm)" for row in rows if row.asked]
    names = " and ".join(dict.fromkeys(words))
    error.what = f"the allowance of edge {names} does not fit: {error.what}, at {error.place}"
    error.place = ""
    error.remedy = "use a smaller allowance, or give the outline more room there"
    return error


def _refuse_overlap(rows: Sequence[_Row], point: Array, width: float) -> NoReturn:
    """GeometryError of an outline that crosses or touches itself at a point."""
    asked = [(row.side.source, row.asked) for row in rows if row.asked is not None]
    edge, finish = min(asked, key=lambda each: _away(each[0], point))
    raise GeometryError(
        f"the allowance of edge {edge.name} ({finish.allowance:.4g} mm) runs into another part of "
        f"the outline at {place(point)}, where its sides are {width:.4g} mm apart",
        value=finish.allowance,
        limit=width,
        remedy="use a smaller allowance, or move the edges apart",
    )


def _away(edge: Edge, point: Array) -> float:
    """About how far a point is from an edge."""
    u = np.concatenate([np.linspace(a, b, 33) for a, b in zip(edge.u, edge.u[1:], strict=False)])
    return float(np.hypot(*(edge.curve(u)[0] - point).T).min())
