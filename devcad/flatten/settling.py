"""Cutouts settled among one another: none meets another, or their union is cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.errors import GeometryError
from devcad.flatten.clashes import Sampled, close_pairs, inside, meetings, sampled
from devcad.flatten.cover import Cover
from devcad.flatten.meeting import Meeting
from devcad.flatten.union import Contour, union
from devcad.geometry.cuts import Cut, Track
from devcad.geometry.taylor import Array

APART = 1e-6
"""Of the pattern's size: tracks whose ends are as near follow one another in the plane."""


@dataclass(frozen=True, slots=True)
class Laid:
    """What became of one feature: its name, whether it may cross edges and other cutouts, and
    its runs of tracks: one closed one, or open ones from edge to edge and the whole contour as
    polygons in the pattern."""

    name: str
    notch: bool
    closed: bool
    runs: list[tuple[Track, ...]]
    polygons: tuple[Array, ...] = ()


def settled(found: Sequence[Laid], sheet: Cover) -> tuple[Cut, ...]:
    """The cuts of all cutouts together.

    Where cutouts meet or lie in one another and one of the two may, their union is cut.

    Raises:
        GeometryError: two meet and neither may; a contour crosses itself; a cut would part the
            panel in two.
    """
    flat = [
        (owner, run, track) for owner, one in enumerate(found) for run in one.runs for track in run
    ]
    if not flat:
        return ()
    polygons = {owner: one.polygons for owner, one in enumerate(found) if one.polygons}
    tracks, owners = [track for _, _, track in flat], [owner for owner, _, _ in flat]
    samples = sampled(tracks, owners, polygons, sheet)
    names = [one.name for one in found]
    _refuse_crossing_itself(found, samples)
    all_met = meetings(samples, close_pairs(samples))
    nested = inside(samples) if len(found) > 1 else []
    pairs = [(int(samples.owner[m.first]), int(samples.owner[m.second])) for m in all_met] + nested
    for a, b in pairs:
        if not (found[a].notch or found[b].notch):
            raise _meet(names[a], names[b], (a, b) in nested)
    groups = _groups(len(found), pairs)
    cuts: list[Cut] = []
    for group in groups:
        own = _cuts(group, found, samples, all_met, names)
        if len(group) > 1:
            _refuse_islands(own, sheet)
        cuts += own
    _refuse_parting(cuts, sheet)
    return tuple(cuts)


def _meet(first: str, second: str, nested: bool) -> GeometryError:
    what = f"{first} lies in {second}" if nested else f"{first} and {second} touch or cross"
    return GeometryError(
        f"cutout-crosses-edge: {what}",
        remedy="move one of them, leave it out, or give one notch = true: then their union is cut",
    )


def _groups(number: int, pairs: Sequence[tuple[int, int]]) -> list[list[int]]:
    """The contours that hang together by pairs, in order."""
    home = list(range(number))
    for a, b in pairs:
        low, high = sorted((home[a], home[b]))
        home = [low if h == high else h for h in home]
    return [[k for k in range(number) if home[k] == h] for h in sorted(set(home))]


def _cuts(
    group: list[int],
    found: Sequence[Laid],
    samples: Sampled,
    places: Sequence[Meeting],
    names: Sequence[str],
) -> list[Cut]:
    """The cuts of contours that hang together."""
    if len(group) == 1:
        one = found[group[0]]
        runs = [(group[0], run, one.closed) for run in one.runs]
    else:
        contours = []
        for owner in group:
            numbers = iter(np.flatnonzero(samples.owner == owner).tolist())
            for run in found[owner].runs:
                own = tuple(next(numbers) for _ in run)
                contours.append(Contour(owner, run, own, found[owner].closed))
        here = [m for m in places if int(samples.owner[m.first]) in group]
        runs = union(contours, samples, here, names)
    seen: list[str] = []
    for owner, _, _ in runs:
        again = sum(name.split("#")[0] == names[owner] for name in seen)
        seen.append(f"{names[owner]}#{again + 1}" if again else names[owner])
    return [
        Cut(name.replace("#", "-"), run, closed)
        for name, (_, run, closed) in zip(seen, runs, strict=True)
    ]


def _refuse_crossing_itself(found: Sequence[Laid], samples: Sampled) -> None:
    """Refuse contours that cross themselves, in the plane or round a tube."""
    first = np.searchsorted(samples.owner, np.arange(len(found) + 1)).tolist()
    for owner, one in enumerate(found):
        own = range(first[owner], first[owner + 1])
        points = [samples.points[k] for k in own]
        if not points or _convex(points):
            continue
        a = np.concatenate([p[:-1] for p in points])
        b = np.concatenate([p[1:] for p in points])
        if _cross(a, b) or _met_itself(samples, own):
            raise GeometryError(
                f"cutout-crosses-edge: {one.name} crosses itself",
                remedy="give a contour that does not, or make two cutouts of it",
            )


def _met_itself(samples: Sampled, own: range) -> bool:
    """Whether tracks of one contour that do not follow one another touch."""
    low = np.array([samples.points[k].min(axis=0) for k in own]) - samples.cover.near
    high = np.array([samples.points[k].max(axis=0) for k in own]) + samples.cover.near
    number = np.arange(len(own))
    pairs: list[tuple[int, int]] = []
    for i in number.tolist():
        close = np.all((low <= high[i]) & (high >= low[i]), axis=1) & (number > i + 1)
        close &= (number - i) % len(own) != len(own) - 1
        pairs += [(own[i], own[j]) for j in np.flatnonzero(close).tolist()]
    patch = [track.patch for track in samples.tracks]
    return bool(meetings(samples, [(i, j) for i, j in pairs if patch[i] == patch[j]]))


def _convex(points: list[Array]) -> bool:
    """Whether a contour, not cut at a seam, turns one way only and once."""
    steps = np.concatenate([np.diff(p, axis=0) for p in points])
    size = float(np.abs(steps).max())
    for before, after in pairwise(points):
        if np.abs(after[0] - before[-1]).max() > APART * size:
            return False
    following = np.roll(steps, -1, axis=0)
    cross = steps[:, 0] * following[:, 1] - steps[:, 1] * following[:, 0]
    turn = np.arctan2(cross, (steps * following).sum(axis=1))
    one_way = bool((turn < 1e-9).all() or (turn > -1e-9).all())
    return one_way and abs(float(turn.sum())) < 3.0 * np.pi


def _cross(a: Array, b: Array) -> bool:
    """Whether two of the segments from a to b (n, 2) cross in their inner points."""
    d = b - a
    for i in range(0, len(a), 512):
        start, step = a[i : i + 512, None], d[i : i + 512, None]
        low = np.minimum(start, start + step)
        high = np.maximum(start, start + step)
        near = np.all((low <= np.maximum(a, b)) & (high >= np.minimum(a, b)), axis=2)
        row, column = np.nonzero(near)
        row_start, row_step = a[row + i], d[row + i]
        left = _side(row_step, a[column] - row_start), _side(row_step, b[column] - row_start)
        right = (
            _side(d[column], row_start - a[column]),
            _side(d[column], row_start + row_step - a[column]),
        )
        if ((left[0] * left[1] < 0) & (right[0] * right[1] < 0)).any():
            return True
    return False


def _side(d: Array, p: Array) -> Array:
    """On which side of directions d points p lie: 1, -1, or 0 within rounding."""
    cross = d[:, 0] * p[:, 1] - d[:, 1] * p[:, 0]
    size = np.hypot(*d.T) * np.hypot(*p.T)
    return np.asarray(np.where(np.abs(cross) <= 1e-9 * size, 0.0, np.sign(cross)))


def _refuse_islands(cuts: Sequence[Cut], sheet: Cover) -> None:
    """Refuse a union that goes round a piece of the sheet: a hole has the sheet around it."""
    for cut in cuts:
        if cut.closed and _area(cut, sheet) > 0.0:
            raise _parted(cut.name)


def _refuse_parting(cuts: Sequence[Cut], sheet: Cover) -> None:
    """Refuse open cuts that leave more than one loop of border, or on a tube one at each end."""
    opened = [cut for cut in cuts if not cut.closed]
    if opened and _loops(opened, sheet) > _allowed(opened, sheet):
        raise _parted(opened[0].name)


def _parted(name: str) -> GeometryError:
    return GeometryError(
        f"cutout-crosses-edge: {name} would part the panel in two",
        remedy="make it smaller, or make two panels",
    )


def _area(cut: Cut, sheet: Cover) -> float:
    """The area that a closed cut goes round counterclockwise, unrolled over the seam."""
    points = np.zeros((0, 2))
    share = np.linspace(0.0, 1.0, 65)
    shift, turn = np.zeros(2), np.eye(2)
    for track in cut.tracks:
        low, high = track.u
        places = track.series(low + (high - low) * share)
        flat = sheet.developments[track.patch].points(places[:, 0], places[:, 1])
        here = flat @ turn.T + shift
        if len(points) and np.abs(here[0] - points[-1]).max() > APART * sheet.size:
            options = [(turn @ r, turn @ s + shift) for r, s in (sheet.motion(1), sheet.motion(-1))]
            far = [float(np.abs(flat[0] @ r.T + s - points[-1]).max()) for r, s in options]
            turn, shift = options[int(np.argmin(far))]
            here = flat @ turn.T + shift
        points = np.concatenate([points, here])
    x, y = (points - points[0]).T
    return 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


def _loops(cuts: Sequence[Cut], sheet: Cover) -> int:
    """Into how many loops open cuts cut the border of the sheet."""
    ends = [(_border_place(cut, 0, sheet), _border_place(cut, -1, sheet)) for cut in cuts]
    ring = sheet.shift is not None
    follow = []
    for _, (rail, end) in ends:
        ahead = [
            ((start - end) % 1.0, k)
            for k, ((other, start), _) in enumerate(ends)
            if not ring or other == rail
        ]
        if not ahead:
            raise _parted(cuts[0].name)
        follow.append(min(ahead)[1])
    seen: set[int] = set()
    loops = 0
    for k in range(len(cuts)):
        loops += k not in seen
        while k not in seen:
            seen.add(k)
            k = follow[k]
    rails = {rail for pair in ends for rail, _ in pair}
    return loops + (2 - len(rails) if ring else 0)


def _allowed(cuts: Sequence[Cut], sheet: Cover) -> int:
    """How many loops of border one piece has: two on a tube that is not cut open."""
    if sheet.shift is None:
        return 1
    across = any(
        _border_place(cut, 0, sheet)[0] != _border_place(cut, -1, sheet)[0] for cut in cuts
    )
    return 1 if across else 2


def _border_place(cut: Cut, end: int, sheet: Cover) -> tuple[int, float]:
    """Where a cut begins (0) or ends (-1): on which rail (1 top, 3 base; 0 on an open sheet) and
    how far counterclockwise round the border, from 0 to 1."""
    track = cut.tracks[end]
    t, v = track.series(np.array([track.u[end]]))[0].tolist()
    patches = sheet.chain.patches
    patch = patches[track.patch]
    low, high = patch.domain
    share = (track.patch + (t - low) / (high - low)) / len(patches)
    jet = patch.jet([min(max(t, low), high)], 0)
    v_from, v_to = float(jet.v_from[0, 0]), float(jet.v_to[0, 0])
    top = v_to - v < v - v_from
    if sheet.shift is not None:
        return (1, share) if top else (3, 1.0 - share)
    height = (v - v_from) / (v_to - v_from)
    rooms = [share * len(patches), 1.0 - height, (1.0 - share) * len(patches), height]
    side = int(np.argmin(np.abs(rooms)))
    along = (height, share, 1.0 - height, 1.0 - share)[side]
    return 0, 0.25 * (side + along)
