"""The zones of bends with an inside radius: strips along the bend lines, and facets between them.

A bend by the angle theta takes a strip of theta (Ri + K T) of the blank, half of it on either side
of its bend line. The strips' borders run along their bend lines, so that the facets between two
of them have rulings of their own: straight lines from the one rail to the other, at equal shares
of the rails' parameters. All edges are the blank's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from devcad.errors import GeometryError
from devcad.flatten.bending import Bend, Rulings, Sheet
from devcad.flatten.brake import Curl, Zone
from devcad.flatten.neutral import MIDDLE, Fibre
from devcad.geometry import chebyshev, taylor
from devcad.geometry.chain import Chain
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array

HALVINGS = 60
NODES = 17
"""Places of a strip at which its rails are solved for beforehand."""
SETTLED = 1e-14
"""Of the parameter: a shorter step is rounding."""
KNOWN = 1e-14
"""Of the pattern's size: as near the solutions beforehand are exact."""
KEPT = 512
"""Looks at a patch of the pattern that are kept: zones ask for the same places again and again."""
POLISH = 3
"""Newton's steps from there."""
TIP = 1e-9
"""Of the pattern's size: a shorter ruling is a point."""
EDGES = ("base", "top")

Ends = tuple[float, float]
"""Where a line meets the base and the top: parameters counted through all patches."""


@dataclass(frozen=True, slots=True)
class _Rails:
    """Both rails of a pattern, their parameter counted through all patches from ``starts`` on."""

    flat: Chain
    starts: Array

    def of(self, patch: int, t: float) -> float:
        """The parameter of a ruling."""
        return float(self.starts[patch] + t - self.flat.patches[patch].domain[0])

    def patch(self, at: float) -> int:
        """The patch of a parameter."""
        last = len(self.starts) - 1
        return int(np.clip(np.searchsorted(self.starts, at, side="right") - 1, 0, last))

    def t(self, patch: int, at: Array) -> Array:
        """The patch's own parameter."""
        low, high = self.flat.patches[patch].domain
        return np.asarray(np.clip(low + (at - self.starts[patch]), low, high))

    def jet(self, side: int, patch: int, at: Array, order: int) -> Array:
        """The series of a rail of one patch in the pattern, (order + 1, n, 3)."""
        jet = self.flat.patches[patch].jet(self.t(patch, at), order)
        return jet.rail(jet.v_to if side else jet.v_from)

    def points(self, side: int, at: Array) -> Array:
        """Points of a rail, (n, 3)."""
        return np.asarray(self.moving(side, at, 0)[:, 0])

    def moving(self, side: int, at: Array, order: int) -> Array:
        """The series of a rail, (n, order + 1, 3)."""
        number = np.clip(np.searchsorted(self.starts, at, side="right") - 1, 0, None)
        return Rulings(number, at).of(lambda k, x: self.jet(side, k, x, order).swapaxes(0, 1))

    def behind(self, side: int, line: _Line, aim: Array, low: float, high: float) -> Array:
        """Where, between two places, a rail is so far behind a line, (n,): Newton's steps, or
        halvings where they lead away."""
        a, b = np.full(len(aim), low), np.full(len(aim), high)
        at = 0.5 * (a + b)
        for _ in range(HALVINGS):
            rail = self.moving(side, at, 1)
            away = line.away(rail[:, 0]) - aim
            a, b = np.where(away < 0.0, at, a), np.where(away < 0.0, b, at)
            with np.errstate(divide="ignore", invalid="ignore"):
                tried = at - away / (rail[:, 1] @ line.m)
            good = (tried >= a) & (tried <= b)
            step = np.where(good, tried, 0.5 * (a + b)) - at
            at = at + step
            if np.abs(step).max() <= SETTLED * max(abs(low), abs(high)):
                break
        return np.asarray(at)


@dataclass(frozen=True, slots=True)
class _Line:
    """A bend line in the pattern: its bend, its parameter, a point, the directions along it and
    across (3,), and the ``width`` of its strip."""

    bend: Bend
    at: float
    point: Array
    e: Array
    m: Array
    width: float

    def away(self, points: Array) -> Array:
        """How far points (n, 3) lie behind the line, (n,)."""
        return np.asarray((points - self.point) @ self.m)


def rounded(
    smooth: Sheet, made: Sequence[Bend], fibre: Fibre | None, thickness: float, inside: float
) -> list[Zone]:
    """The zones of bends with the inside radius ``inside`` in mm.

    Raises:
        GeometryError: strips overlap, or reach over a crease, an edge or another bend.
    """
    spans = [patch.domain[1] - patch.domain[0] for patch in smooth.flat.patches]
    flat = replace(smooth.flat, patches=tuple(_remembered(p) for p in smooth.flat.patches))
    rails = _Rails(flat, np.concatenate([[0.0], np.cumsum(spans)[:-1]]))
    k = MIDDLE
    if fibre is not None and thickness:
        k = float(fibre.law(np.array([inside / thickness]))[0])
    neutral, middle = inside + k * thickness, inside + 0.5 * thickness
    out: list[Zone] = []
    for first, last in _runs(smooth.middle):
        joint = smooth.middle.joints[first - 1] if first else None
        crease = joint.angle if joint is not None and not joint.smooth else 0.0
        if smooth.middle.patches[first].inside_radius is not None:
            patch = smooth.flat.patches[first]
            out.append(Zone(patch, (first, *patch.domain), crease, kept=True))
            continue
        lines = [_line(rails, bend, neutral) for bend in made if first <= bend.patch <= last]
        ends = rails.starts[first], rails.starts[last] + spans[last]
        zones = _run(rails, lines, (float(ends[0]), float(ends[1])), middle / neutral, inside)
        zones[0] = Zone(zones[0].flat, zones[0].home, crease, exact=zones[0].exact)
        out += zones
    return out


def _remembered(patch: Patch) -> Patch:
    """The patch, its last series kept."""
    seen: dict[bytes, tuple[int, RulingJet]] = {}

    def field(t: Array, order: int) -> RulingJet:
        key = np.asarray(t, dtype=float).tobytes()
        had, jet = seen.get(key, (-1, None))
        if jet is None or had < order:
            if len(seen) >= KEPT:
                seen.pop(next(iter(seen)))
            jet = patch.field(t, order)
            seen[key] = order, jet
        k = order + 1
        return RulingJet(jet.c0[:k], jet.e[:k], jet.v_from[:k], jet.v_to[:k])

    return replace(patch, field=field)


def _runs(chain: Chain) -> list[tuple[int, int]]:
    """The patches from first to last that follow one another smoothly, each that is a bend
    already by itself."""
    out: list[tuple[int, int]] = []
    for k, patch in enumerate(chain.patches):
        alone = patch.inside_radius is not None
        before = k and chain.patches[k - 1].inside_radius is not None
        if not k or alone or before or not chain.joints[k - 1].smooth:
            out.append((k, k))
        else:
            out[-1] = (out[-1][0], k)
    return out


def _line(rails: _Rails, bend: Bend, neutral: float) -> _Line:
    jet = rails.flat.patches[bend.patch].jet([bend.t], 0)
    e = jet.e[0, 0]
    at = rails.of(bend.patch, bend.t)
    return _Line(bend, at, jet.c0[0, 0], e, np.array([-e[1], e[0], 0.0]), abs(bend.angle) * neutral)


def _run(
    rails: _Rails, lines: Sequence[_Line], ends: Ends, growth: float, inside: float
) -> list[Zone]:
    """The zones of a run of patches between two parameters."""
    stops = [ends[0], *(line.at for line in lines), ends[1]]
    borders = [
        (_border(rails, line, stops[k], -1.0), _border(rails, line, stops[k + 2], 1.0))
        for k, line in enumerate(lines)
    ]
    for (one, (_, end)), (other, (start, _)) in pairwise(zip(lines, borders, strict=True)):
        for side in (0, 1):
            if end[side] > start[side]:
                room = float(one.away(rails.points(side, np.array([other.at])))[0])
                raise _overlap(rails, side, other, room, 0.5 * (one.width + other.width))
    out: list[Zone] = []
    before: Ends = (ends[0], ends[0])
    for line, (start, end) in zip(lines, borders, strict=True):
        out += _facets(rails, before, start, ends)
        out += _strip(rails, line, start, end, growth, inside)
        before = end
    return out + _facets(rails, before, (ends[1], ends[1]), ends)


def _border(rails: _Rails, line: _Line, stop: float, sign: float) -> Ends:
    """Where a strip's border before (-1) or behind (1) its line meets the rails, the neighbour or
    the end of the run being at ``stop``."""
    out = []
    for side in (0, 1):
        room = sign * float(line.away(rails.points(side, np.array([stop])))[0])
        if not room > 0.5 * line.width:
            raise _overlap(rails, side, line, room, 0.5 * line.width)
        aim = np.array([sign * 0.5 * line.width])
        out.append(float(rails.behind(side, line, aim, *sorted((line.at, stop)))[0]))
        seen = np.linspace(line.at, out[-1], 9)
        if (np.diff(sign * line.away(rails.points(side, seen))) <= 0.0).any():
            raise GeometryError(
                f"bends: the {EDGES[side]} edge runs back along the bend line at "
                f"t = {line.bend.t:.6g}",
                remedy="give the bends no inside radius, or a smaller one",
            )
    return out[0], out[1]


def _overlap(rails: _Rails, side: int, line: _Line, room: float, need: float) -> GeometryError:
    x, y = rails.points(side, np.array([line.at]))[0, :2].tolist()
    return GeometryError(
        f"bends: no room for a bend of this inside radius on the {EDGES[side]} edge at "
        f"t = {line.bend.t:.6g}, ({x:.6g}, {y:.6g}) in the pattern: the next bend, crease or edge "
        f"is {max(room, 0.0):.4g} mm away, {need:.4g} mm are needed",
        value=max(room, 0.0),
        limit=need,
        remedy="use a smaller inside radius, fewer bends, or a wider sheet there",
    )


def _facets(rails: _Rails, first: Ends, last: Ends, run: Ends) -> list[Zone]:
    """The plane zones between two lines across the pattern, divided at the joints of patches."""
    joints = [x for x in rails.starts.tolist() if run[0] < x < run[1]]
    stations = [first, *((x, x) for x in joints if max(first) < x < min(last)), last]
    size = float(np.abs(rails.points(0, np.array(run)) - rails.points(1, np.array(run))).max())
    if first[0] == first[1] != run[1] and len(set(stations[1])) == 2 and _tip(rails, first, size):
        stations.insert(1, (0.5 * (first[0] + min(stations[1])),) * 2)
    if last[0] == last[1] and len(set(stations[-2])) == 2 and _tip(rails, last, size):
        stations.insert(-1, (0.5 * (last[0] + max(stations[-2])),) * 2)
    out = []
    for a, b in pairwise(stations):
        shares = {
            (x - a[side]) / (b[side] - a[side]): (side, x)
            for side in (0, 1)
            for x in joints
            if a[side] < x < b[side]
        }
        ends = [a]
        for share, (side, x) in sorted(shares.items()):
            between = [a[k] + share * (b[k] - a[k]) for k in (0, 1)]
            between[side] = x
            ends.append((between[0], between[1]))
        out += [_facet(rails, low, high) for low, high in pairwise([*ends, b])]
    return out


def _tip(rails: _Rails, at: Ends, size: float) -> bool:
    ends = [rails.points(side, np.array([at[side]]))[0] for side in (0, 1)]
    return float(np.linalg.norm(ends[1] - ends[0])) <= TIP * size


def _home(rails: _Rails, low: Ends, high: Ends) -> tuple[int, float, float]:
    number = rails.patch(0.25 * (sum(low) + sum(high)))
    t = rails.t(number, 0.5 * np.array([sum(low), sum(high)]))
    return number, float(t[0]), float(t[1])


def _facet(rails: _Rails, low: Ends, high: Ends) -> Zone:
    """A plane zone with straight lines between places of the rails, within one patch on each."""
    number = [rails.patch(0.5 * (low[k] + high[k])) for k in (0, 1)]
    if low[0] == low[1] and high[0] == high[1]:
        t = rails.t(number[0], np.array([low[0], high[0]])).tolist()
        return Zone(rails.flat.patches[number[0]].restricted(*t), (number[0], *t))
    domain = 0.5 * sum(low), 0.5 * sum(high)
    rates = [(high[k] - low[k]) / (domain[1] - domain[0]) for k in (0, 1)]

    def field(t: Array, order: int) -> RulingJet:
        ends = []
        for k in (0, 1):
            rail = rails.jet(k, number[k], low[k] + rates[k] * (t - domain[0]), order)
            ends.append(rail * (rates[k] ** np.arange(order + 1))[:, None, None])
        way = ends[1] - ends[0]
        return RulingJet(ends[0], taylor.unit(way), np.zeros(way.shape[:2]), taylor.norm(way))

    breaks = []
    for k in (0, 1):
        at = [rails.of(number[k], x) for x in rails.flat.patches[number[k]].breaks]
        breaks += [domain[0] + (x - low[k]) / rates[k] for x in at if low[k] < x < high[k]]
    flat = Patch(field, domain, _apart(breaks, domain))
    return Zone(flat, _home(rails, low, high), exact=False)


def _apart(breaks: Sequence[float], domain: Ends) -> tuple[float, ...]:
    """Breaks of both rails, increasing, those that are one to rounding told once."""
    near = 1e-12 * (domain[1] - domain[0])
    out: list[float] = []
    for x in sorted(breaks):
        if x - (out[-1] if out else domain[0]) > near and domain[1] - x > near:
            out.append(x)
    return tuple(out)


def _strip(
    rails: _Rails, line: _Line, start: Ends, end: Ends, growth: float, inside: float
) -> list[Zone]:
    """The zones of a strip, divided where a rail goes from patch to patch."""
    half = 0.5 * line.width
    cuts = {-half: start, half: end}
    for side in (0, 1):
        for x in rails.starts.tolist():
            if start[side] < x < end[side]:
                away = float(line.away(rails.points(side, np.array([x])))[0])
                near = [s for s in cuts if abs(s - away) <= 1e-9 * half]
                cuts.setdefault(near[0] if near else away, (np.nan, np.nan))
    out = []
    for a, b in pairwise(sorted(cuts)):
        out.append(_part(rails, line, (a, b), start, end, growth, inside))
    return out


def _part(
    rails: _Rails,
    line: _Line,
    reach: Ends,
    start: Ends,
    end: Ends,
    growth: float,
    inside: float,
) -> Zone:
    """The part of a strip from one distance behind its line to another."""
    nodes, size = chebyshev.nodes(*reach, NODES), float(np.abs(line.point).max()) + line.width
    tables, numbers = [], []
    for side in (0, 1):
        at = rails.behind(side, line, nodes, start[side], end[side])
        numbers.append(rails.patch(float(at[NODES // 2])))
        table = chebyshev.transform(NODES) @ at
        tables.append(chebyshev.Piecewise(np.array(reach), table[None, :, None]))
    seen = 0.5 * (nodes[1:] + nodes[:-1])
    known = [
        np.abs(line.away(rails.points(k, tables[k](seen)[:, 0])) - seen).max() <= KNOWN * size
        for k in (0, 1)
    ]
    corners = [[float(table(np.array([s]))[0, 0]) for table in tables] for s in reach]
    low, high = (corners[0][0], corners[0][1]), (corners[1][0], corners[1][1])
    domain = 0.5 * sum(low), 0.5 * sum(high)
    rate = (reach[1] - reach[0]) / (domain[1] - domain[0])

    def extent(side: int, s: Array, order: int) -> Array:
        """v of a rail as a series of s."""
        at = tables[side](s)[:, 0]
        for _ in range(0 if known[side] else POLISH):
            rail = rails.jet(side, numbers[side], at, 1)
            at = at - (line.away(rail[0]) - s) / (rail[1] @ line.m)
        rail = rails.jet(side, numbers[side], at, order)
        rail[0] -= line.point
        inner = taylor.invert(rail @ line.m)
        return taylor.compose(rail @ line.e, inner)

    def field(t: Array, order: int) -> RulingJet:
        s = reach[0] + rate * (t - domain[0])
        powers = (rate ** np.arange(order + 1))[:, None]
        v_from, v_to = (powers * extent(side, s, order) for side in (0, 1))
        c0 = np.zeros((order + 1, len(t), 3))
        c0[0] = line.point + s[:, None] * line.m
        if order:
            c0[1] = rate * line.m
        return RulingJet(c0, taylor.constant_vector(line.e, order, len(t)), v_from, v_to)

    breaks = []
    for side in (0, 1):
        patch = rails.flat.patches[numbers[side]]
        at = np.array([rails.of(numbers[side], x) for x in patch.breaks])
        at = at[(at > low[side]) & (at < high[side])]
        if at.size:
            away = line.away(rails.points(side, at))
            breaks += (domain[0] + (away - reach[0]) / rate).tolist()
    width = reach[1] - reach[0]
    curl = Curl(
        line.bend.angle * width / line.width,
        width,
        line.e,
        line.point + reach[0] * line.m,
        width * (growth - 1.0),
        inside,
    )
    flat = Patch(field, domain, _apart(breaks, domain))
    return Zone(flat, _home(rails, low, high), curl=curl, exact=False)
