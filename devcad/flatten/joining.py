"""The pattern of sheets that hang together along straight edges, laid side by side.

Each is developed by itself; those that share a straight edge are laid against each other along
it. Where two of them meet under an angle the edge is a bend.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from devcad.errors import GeometryError
from devcad.flatten.green import bounds, enclosed_area
from devcad.flatten.loops import cross
from devcad.flatten.pattern import CUTOUT, Edge, Line, Pattern
from devcad.flatten.sheetlines import joint_line, reference_lines
from devcad.flatten.sheets import Laid, Sheet, ends_of, lay
from devcad.flatten.verify import overlap_area
from devcad.geometry.taylor import Array

STRAIGHT = 1e-9
"""Of the size: an edge as near to its chord is straight, two ends as near are one."""
SAME_LENGTH = 1e-6
"""Relative: two images of one edge may differ by as much, where its faces are fitted."""
OVERLAP_LIMIT = 1e-9
"""Of the area: what the pattern may cover twice."""

Place = tuple[int, int, int]
"""The number of a sheet, of a loop on it and of a side in that."""


@dataclass(frozen=True, slots=True)
class Joint:
    """A straight edge that two sheets share: for each of them (sheet, loop, place in it); the
    angle between them in radians, positive towards the front."""

    sides: tuple[Place, Place]
    angle: float


def unrolled(sheets: Sequence[Sheet], tolerance: float) -> Pattern:
    """The pattern of sheets that hang together along straight edges, front towards the viewer.

    The first sheet lies as it is developed: at the start of its patch c0 is the origin, the
    ruling is +x and t grows towards +y. A ring of sheets stays open where it comes back to the
    first; edges that come to lie on each other all the same are joined. Lines: joints (rulings
    where tangential, else bends) and a ruling about every 15 degrees of bending.

    Args:
        tolerance: the largest gap in mm between neighbouring edges of a border that is closed.
    Raises:
        GeometryError: a border is open, the area is not the sheets', they do not hang together,
            show opposite sides, or the pattern would cover itself.
    """
    laid = [lay(sheet, tolerance) for sheet in sheets]
    joints = _joints(laid)
    placed, used = _assembled(laid, joints)
    loops = _spliced(placed, used)
    areas = [enclosed_area(loop) for loop in loops]
    if sum(area > 0.0 for area in areas) != 1:
        pieces = sum(area > 0.0 for area in areas)
        raise GeometryError(
            f"the faces unroll to {pieces} pieces",
            value=pieces,
            limit=1,
            remedy="unroll each piece by itself; faces hang together along straight edges that "
            "they share",
        )
    outline = _from_its_start(loops.pop(int(np.argmax(areas))))
    holes = [tuple(replace(edge, name=CUTOUT) for edge in loop) for loop in loops]
    lines = _joint_lines(placed, used)
    lines += [line for each in placed for line in reference_lines(each)]
    pattern = Pattern(outline, tuple(lines), sum(areas), bounds(outline), tuple(holes))
    _refuse_overlap(pattern)
    return pattern


def _refuse_overlap(pattern: Pattern) -> None:
    """Raise where the pattern covers itself."""
    over = overlap_area(pattern)
    if over > OVERLAP_LIMIT * pattern.area:
        raise GeometryError(
            f"the pattern would cover {over:.6g} mm2 twice",
            value=over,
            limit=OVERLAP_LIMIT * pattern.area,
            remedy="unroll the faces in two groups",
        )


def _joints(laid: Sequence[Laid]) -> list[Joint]:
    """The straight edges that two sheets share, in the order of the sheets.

    Raises:
        GeometryError: the sheets at such an edge show opposite sides.
    """
    uses: dict[int, list[Place]] = {}
    for i, each in enumerate(laid):
        for j, loop in enumerate(each.sides):
            for k, side in enumerate(loop):
                uses.setdefault(side.key, []).append((i, j, k))
    found = []
    for sides in uses.values():
        if len(sides) != 2 or sides[0][0] == sides[1][0]:
            continue
        edges = [laid[i].edges[j][k] for i, j, k in sides]
        lengths = [_straight_length(edge) for edge in edges]
        if min(lengths) > 0.0 and abs(lengths[0] - lengths[1]) <= SAME_LENGTH * lengths[0]:
            found.append(Joint((sides[0], sides[1]), _angle(laid, sides)))

    def order(joint: Joint) -> tuple[int, int, bool]:
        (i, j, k), (other, _, _) = joint.sides
        return i, other, laid[i].edges[j][k].name != "end"  # a ring of two opens at its start

    return sorted(found, key=order)


def _straight_length(edge: Edge) -> float:
    """The length of a straight edge, 0 where it is not straight."""
    points = edge.curve(np.linspace(edge.u[0], edge.u[-1], 9))[0]
    chord = points[-1] - points[0]
    length = float(np.hypot(*chord))
    off = np.abs(cross(chord, points - points[0])).max()
    return length if off <= STRAIGHT * length**2 else 0.0


def _angle(laid: Sequence[Laid], sides: list[Place]) -> float:
    """The angle by which the sheets fold at their edge, radians, positive towards the front."""
    fronts, ways = [], []
    for i, j, k in sides:
        edge, side = laid[i].edges[j][k], laid[i].sides[j][k]
        t, v, _, _ = side.track(np.linspace(edge.u[0], edge.u[-1], 3))
        patch = laid[i].sheet.patch
        t = np.clip(t, *patch.domain)
        place = patch.point(t, v)
        ways.append((place[2] - place[0]) / np.linalg.norm(place[2] - place[0]))
        fronts.append(patch.frame(t[1:2]).n[0])
    if ways[0] @ ways[1] > 0.0:
        first, second = sides[0][0], sides[1][0]
        raise GeometryError(
            f"the faces {first} and {second} show opposite sides",
            value=f"{first}, {second}",
            remedy="reverse one of them, so that all show their front",
        )
    turn = np.cross(fronts[0], fronts[1]) @ -ways[0]
    return float(np.arctan2(turn, fronts[0] @ fronts[1]))


def _assembled(laid: Sequence[Laid], joints: list[Joint]) -> tuple[list[Laid], list[Joint]]:
    """The sheets laid against each other, and the joints at which they are.

    From the first sheet from neighbour to neighbour, so that a ring is followed to its end.
    Sheets that cannot be reached stay where they are.
    """
    out = list(laid)
    used: list[Joint] = []
    reached: set[int] = set()
    for root in range(len(laid)):
        path = [root] if root not in reached else []
        reached.add(root)
        while path:
            step = _way_on(joints, path[-1], reached)
            if step is None:
                path.pop()
                continue
            joint, (i, j, k), (other, loop, place) = step
            against = ends_of(out[i].edges[j][k])
            out[other] = _against(laid[other], ends_of(laid[other].edges[loop][place]), against)
            used.append(joint)
            reached.add(other)
            path.append(other)
    return out, used + [joint for joint in joints if joint not in used and _meets(out, joint)]


def _way_on(
    joints: list[Joint], sheet: int, reached: set[int]
) -> tuple[Joint, Place, Place] | None:
    """The first joint from a sheet to one that is not laid yet, with the sides here and there."""
    for joint in joints:
        for here, there in (joint.sides, joint.sides[::-1]):
            if here[0] == sheet and there[0] not in reached:
                return joint, here, there
    return None


def _against(laid: Laid, ends: Array, other: Array) -> Laid:
    """A sheet so that its edge between ``ends`` lies on the ``other``, which runs against it."""
    way, goal = ends[1] - ends[0], other[0] - other[1]
    turn = float(np.arctan2(cross(way, goal), way @ goal))
    cos, sin = np.cos(turn), np.sin(turn)
    middle = np.array([[cos, -sin], [sin, cos]]) @ (0.5 * (ends[0] + ends[1]))
    return laid.moved(turn, 0.5 * (other[0] + other[1]) - middle)


def _meets(laid: Sequence[Laid], joint: Joint) -> bool:
    """Whether the two images of a joint lie on each other."""
    first, second = (ends_of(laid[i].edges[j][k]) for i, j, k in joint.sides)
    size = max(float(np.abs(x).max()) for x in (first, second))
    return bool(np.abs(first - second[::-1]).max() <= STRAIGHT * size)


def _spliced(laid: Sequence[Laid], used: Sequence[Joint]) -> list[tuple[Edge, ...]]:
    """The borders of the whole, each with the sheets on its left: all edges but the joints."""
    partner = {a: b for joint in used for a, b in (joint.sides, joint.sides[::-1])}

    def following(place: Place) -> Place:
        i, j, k = place
        after = (i, j, (k + 1) % len(laid[i].edges[j]))
        while after in partner:
            i, j, k = partner[after]
            after = (i, j, (k + 1) % len(laid[i].edges[j]))
        return after

    places = [
        (i, j, k)
        for i, each in enumerate(laid)
        for j, loop in enumerate(each.edges)
        for k in range(len(loop))
    ]
    left = dict.fromkeys(place for place in places if place not in partner)
    loops = []
    while left:
        start = here = next(iter(left))
        ring = []
        while True:
            del left[here]
            ring.append(laid[here[0]].edges[here[1]][here[2]])
            here = following(here)
            if here == start:
                break
        loops.append(tuple(ring))
    return loops


def _from_its_start(loop: tuple[Edge, ...]) -> tuple[Edge, ...]:
    """The same loop begun at its first edge named start."""
    first = next((k for k, edge in enumerate(loop) if edge.name == "start"), 0)
    return loop[first:] + loop[:first]


def _joint_lines(laid: Sequence[Laid], used: Sequence[Joint]) -> list[Line]:
    """The joints as lines."""
    out = []
    for joint in used:
        i, j, k = joint.sides[0]
        start, end = ends_of(laid[i].edges[j][k])
        out.append(joint_line(start, end, joint.angle))
    return out
