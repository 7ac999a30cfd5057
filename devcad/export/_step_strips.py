"""A panel cut into strips, one for each face, and the edges of its layers at any parameter.

A sheet body has one layer, the surface itself; a solid has two, its skins at -T/2 and +T/2.
Stations are the rulings where strips begin and end. Sides: 0 = from, 1 = to.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from devcad.errors import GeometryError
from devcad.export._step_borders import clear, extents, parted
from devcad.geometry import taylor
from devcad.geometry.classify import Shape, classify
from devcad.geometry.conic import arc_borders
from devcad.geometry.fit import FLOOR, Course
from devcad.geometry.layers import pull_of
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array
from devcad.part import Panel

if TYPE_CHECKING:  # only thick sheets with creases have one
    from devcad.geometry.pull import Pull

FITTED_PARTS = 4  # general-purpose area and volume rules need closed surfaces in quarters
ANALYTIC_PARTS = 2  # no seam edge, no face of a whole turn
SMOOTH_SPEED = 1e-7  # relative jump of the derivative that a C1 spline may smooth over
ASIDE = 0.25  # of a part: how far a border of ours moves to be clear of holes
MOST_BREAKS = 64  # a curve through hundreds of points is no chain of lines and arcs
SAMPLES = 257


@dataclass(frozen=True, slots=True)
class Strip:
    """The part of a patch that becomes one face (and its walls), over ``course`` in t.

    ``first`` and ``last`` are its stations; ``tips`` tells for each side whether the middle
    surface ends there in one point, the apex. The patch is number ``number`` of the chain;
    ``pull`` draws the layers of a plane with curved edges to its mitres.
    """

    patch: Patch
    shape: Shape
    layers: tuple[float, ...]
    course: Course
    first: int
    last: int
    tips: tuple[bool, bool]
    number: int = 0
    pull: Pull | None = None

    @property
    def ends(self) -> Array:
        """The parameters of the first and the last ruling, (2,)."""
        return self.course.t[[0, -1]]

    @property
    def ruled(self) -> bool:
        """Whether the face is fitted."""
        return not self.shape.analytic

    def rails(self, t: Array) -> Array:
        """The edges at t: points (n, 2 sides, layers, 3).

        A layer at distance d over an apex ends where q + v a - d c = 0 (design.md, section 7).
        """
        if self.layers == (0.0,):
            jet = self.patch.jet(t, 0)
            v = np.stack([jet.v_from[0], jet.v_to[0]], axis=1)
            return np.asarray((jet.c0[0][:, None] + v[..., None] * jet.e[0][:, None])[:, :, None])
        f = self.patch.frame(t)
        v = np.stack([f.v_from, f.v_to], axis=1)[:, :, None]  # (n, 2, 1)
        d = np.array(self.layers)
        tip = np.where(self.tips, (f.c / np.where(f.a == 0.0, 1.0, f.a))[:, None], 0.0)
        v = v + tip[:, :, None] * d
        along = v[..., None] * f.e[:, None, None]
        rails = f.c0[:, None, None] + along + d[:, None] * f.n[:, None, None]
        if self.pull is not None:
            rails += d[:, None] * self.pull.rails(t)[:, :, None]
        return np.asarray(rails)

    def end_slopes(self) -> Array:
        """d/dt of ``rails`` at both ends, from inside, (2 ends, 2 sides, layers, 3).

        At a break the patch may give the other side's derivatives, so three places inside are
        carried on to the end, to third order.
        """
        start, end = self.ends
        step = 1e-4 * np.arange(1.0, 4.0)
        first, last = np.diff(self.course.t)[[0, -1]]
        inside = self.slopes(np.concatenate([start + step * first, end - step * last]))
        carry = np.array([3.0, -3.0, 1.0])
        return np.stack([np.tensordot(carry, inside[k : k + 3], 1) for k in (0, 3)])

    def slopes(self, t: Array) -> Array:
        """d/dt of ``rails``, (n, 2 sides, layers, 3)."""
        if self.layers == (0.0,):
            jet = self.patch.jet(t, 1)
            return np.stack([jet.rail(v)[1] for v in (jet.v_from, jet.v_to)], axis=1)[:, :, None]
        f = self.patch.frame_jet(t, 1)
        out = np.zeros((t.size, 2, len(self.layers), 3))
        for side, v in enumerate((f.ruling.v_from, f.ruling.v_to)):
            for k, d in enumerate(self.layers):
                height = v + d * taylor.div(f.c, f.a) if self.tips[side] else v
                out[:, side, k] = (f.ruling.rail(height) + d * f.n)[1]
        if self.pull is not None:
            out += np.array(self.layers)[:, None] * self.pull.slopes(t)[:, :, None]
        return out


def strips(panel: Panel) -> tuple[list[Strip], int]:
    """The strips of a panel in order, and the number of its stations.

    A tube's last strip ends at station 0. A non-orientable band stays open in the topology: its
    faces cannot all show the front at the seam.
    """
    layers = (-0.5 * panel.thickness, 0.5 * panel.thickness) if panel.thickness else (0.0,)
    chain = panel.chain
    around = chain.closed and chain.orientable
    out: list[Strip] = []
    size = panel_size(panel)
    for number, (patch, shape) in enumerate(zip(chain.patches, panel.shapes, strict=True)):
        tips = _tips(patch, size)
        pull = pull_of(chain, number, layers[-1]) if shape.type == "plane" else None
        whole = Strip(patch, shape, layers, _plain(patch.segments), 0, 1, tips, number, pull)
        holes = extents(panel.cuts, number)
        for kind, piece in _pieces(whole, around and len(chain.patches) == 1, holes):
            for course in parted(piece, holes):
                k = len(out)
                out.append(replace(whole, shape=kind, course=course, first=k, last=k + 1))
    count = len(out) if around else len(out) + 1
    out[-1] = replace(out[-1], last=out[-1].last % count)
    return out, count


def panel_size(panel: Panel) -> float:
    """The diagonal of the box around samples of the panel's edges, mm."""
    points = []
    for patch in (patch for each in panel.chains for patch in each.chain.patches):
        t = np.linspace(*patch.domain, 33)
        jet = patch.jet(t, 0)
        points += [jet.rail(v)[0] for v in (jet.v_from, jet.v_to)]
    box = np.ptp(np.concatenate(points), axis=0)
    return float(np.linalg.norm(box))


def smooth_courses(slopes: Callable[[Array], Array], breaks: Array, cuts: Array) -> list[Course]:
    """Courses between the cuts, cut again at every break where no scaling of t makes the curves
    C1; ``slopes`` gives d/dt of all of them, (n, k)."""
    runs: list[list[float]] = [[float(cuts[0])]]
    scales: list[list[float]] = [[]]
    borders = np.unique(np.concatenate([breaks, cuts]))
    borders = borders[(borders >= cuts[0]) & (borders <= cuts[-1])]
    scale = 1.0
    for k, (a, b) in enumerate(pairwise(borders)):
        if k:
            ratio = None if a in cuts else _speed_ratio(slopes, borders[k - 1], a, b)
            if ratio is None:
                runs.append([float(a)])
                scales.append([])
                scale = 1.0
            else:
                scale *= ratio
        runs[-1].append(float(b))
        scales[-1].append(scale)
    return [
        Course(np.array(t), t[0] + np.concatenate([[0.0], np.cumsum(np.diff(t) * w)]))
        for t, w in zip(runs, scales, strict=True)
    ]


def _speed_ratio(
    slopes: Callable[[Array], Array], before: float, at: float, after: float
) -> float | None:
    """|slope after| / |slope before| at a break, or None where their directions differ."""
    step = 1e-5 * min(at - before, after - at)
    near = slopes(at + step * np.array([-1.0, -2.0, -3.0, 1.0, 2.0, 3.0]))
    carry = np.array([3.0, -3.0, 1.0])  # error of third order: the ratio is good to rounding
    left, right = carry @ near[:3], carry @ near[3:]
    sizes = float(np.linalg.norm(left)), float(np.linalg.norm(right))
    if min(sizes) == 0.0:
        return None
    ratio = sizes[1] / sizes[0]
    if np.linalg.norm(right - ratio * left) > SMOOTH_SPEED * sizes[1]:
        return None
    return 1.0 if abs(ratio - 1.0) <= SMOOTH_SPEED else ratio


def _analytic_cuts(strip: Strip, alone: bool, holes: Array) -> Array:
    """Where a plane, cylinder or cone is cut: in halves of its turning when it closes alone, and
    into pieces below a whole turn."""
    start, end = strip.ends
    t = np.linspace(start, end, SAMPLES)
    turning = _turning(strip.patch, t)
    parts = ANALYTIC_PARTS if alone else 1
    if turning[-1] >= 2.0 * np.pi * (1.0 - 1e-6):
        parts = max(parts, int(np.ceil(turning[-1] / np.pi - 1e-6)))
    inner = np.interp(turning[-1] * np.arange(1, parts) / parts, turning, t)
    reach = ASIDE * (end - start) / parts
    return np.array([start, *(clear(place, holes, reach) for place in inner.tolist()), end])


def _turning(patch: Patch, t: Array) -> Array:
    """The accumulated angle about the axis of a cylinder, cone or plane fan along t, (n,).

    On a cone of half angle h the rulings turn by sin h and the normals by cos h of that angle.
    """
    f = patch.frame(t)
    steps = [
        np.arctan2(np.linalg.norm(np.cross(x[:-1], x[1:]), axis=1), np.sum(x[:-1] * x[1:], axis=1))
        for x in (f.n, f.e)
    ]
    return np.concatenate([[0.0], np.cumsum(np.hypot(*steps))])


def _pieces(whole: Strip, alone: bool, holes: Array) -> list[tuple[Shape, Course]]:
    """The faces of a patch: what each is, and its course in t; where only we cut, clear of the
    ``holes`` (n, 2)."""
    segments = whole.patch.segments
    if whole.pull is not None:
        segments = np.unique(np.concatenate([segments, whole.pull.breaks]))
    if whole.shape.analytic:
        cuts = _analytic_cuts(whole, alone, holes)
        return [(whole.shape, _plain(_within(segments, a, b))) for a, b in pairwise(cuts)]
    runs = [part for run in _runs(whole) for part in _arcs_apart(whole, run)]
    pieces = _smooth_pieces(whole, runs, [])
    if alone and len(pieces) < FITTED_PARTS:
        pieces = _smooth_pieces(whole, runs, _quarters(whole, holes))
    return pieces


@dataclass(frozen=True, slots=True)
class _Run:
    """A stretch of a patch with its borders; ``exact`` where it is one face as it stands."""

    shape: Shape
    borders: Array
    exact: bool


def _runs(whole: Strip) -> list[_Run]:
    """Stretches of a general patch between breaks that are planes, circular cylinders or right
    circular cones for themselves (the sides and corners of a rounded box), and those that are
    not, each with its borders."""
    patch, segments = whole.patch, whole.patch.segments
    if not 0 < len(patch.breaks) <= MOST_BREAKS:
        return [_Run(whole.shape, segments, False)]
    runs: list[_Run] = []
    for a, b in pairwise(segments):
        shape = classify(patch.restricted(a, b))
        shape = shape if shape.analytic else whole.shape
        if runs and runs[-1].exact == shape.analytic:
            joined = np.append(runs[-1].borders, b)
            both = classify(patch.restricted(joined[0], b)) if shape.analytic else shape
            if both.analytic == shape.analytic:
                runs[-1] = _Run(both, joined, shape.analytic)
                continue
        runs.append(_Run(shape, np.array([a, b]), shape.analytic))
    return runs


def _arcs_apart(whole: Strip, run: _Run) -> list[_Run]:
    """A run of a sheet body, every part of it between breaks that is a surface between arcs of
    conics for itself: one face for each quarter turn, for knots with a kink in the weights would
    make the face C0 to the kernels."""
    if run.exact or len(whole.layers) > 1 or len(run.borders) > MOST_BREAKS + 2:
        return [run]
    out: list[_Run] = []
    for a, b in pairwise(run.borders):
        found = arc_borders(lambda t: _flat(whole.rails(t)), a, b)
        if found is not None:
            out += [_Run(run.shape, np.array(part), True) for part in pairwise(found)]
        elif out and not out[-1].exact:
            out[-1] = _Run(run.shape, np.append(out[-1].borders, b), False)
        else:
            out.append(_Run(run.shape, np.array([a, b]), False))
    return out


def _smooth_pieces(whole: Strip, runs: list[_Run], cuts: list[float]) -> list[tuple[Shape, Course]]:
    """The runs, the fitted ones cut at ``cuts`` and wherever they are not C1."""
    out: list[tuple[Shape, Course]] = []
    for run in runs:
        borders = run.borders
        if run.exact:
            out.append((run.shape, _plain(borders)))
            continue
        inner = [c for c in cuts if borders[0] < c < borders[-1]]
        places = np.array([borders[0], *inner, borders[-1]])
        courses = smooth_courses(lambda t: _flat(whole.slopes(t)), borders, places)
        out += [(run.shape, course) for course in courses]
    return out


def _quarters(whole: Strip, holes: Array) -> list[float]:
    """Parameters at the quarters of a patch's length, or at a break close by, clear of holes."""
    start, end = whole.ends
    t = np.linspace(start, end, SAMPLES)
    middle = whole.rails(t).mean(axis=(1, 2))
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(middle, axis=0), axis=1))])
    share = np.arange(1, FITTED_PARTS) / FITTED_PARTS
    cuts = np.interp(share * length[-1], length, t)
    for b in whole.patch.breaks:  # a knot that is there already costs nothing
        near = int(np.argmin(np.abs(cuts - b)))
        if abs(cuts[near] - b) < 0.05 * (end - start):
            cuts[near] = b
    reach = ASIDE * float(np.diff(cuts).min())
    return [clear(float(c), holes, reach) for c in np.unique(cuts)]


def _tips(patch: Patch, size: float) -> tuple[bool, bool]:
    """Whether the from side and the to side are drawn together in one point."""
    jet = patch.jet(np.linspace(*patch.domain, 17), 0)
    rails = (jet.rail(v)[0] for v in (jet.v_from, jet.v_to))
    low, high = (bool(np.abs(x - x[0]).max() <= FLOOR * size) for x in rails)
    if low and high:
        raise GeometryError("both long edges of a patch are drawn together in a point")
    return low, high


def _plain(t: Array) -> Course:
    return Course(t, t)


def _within(borders: Array, a: float, b: float) -> Array:
    inner = borders[(borders > a) & (borders < b)]
    return np.concatenate([[a], inner, [b]])


def _flat(x: Array) -> Array:
    return x.reshape(len(x), -1)
