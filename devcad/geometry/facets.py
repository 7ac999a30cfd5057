"""Plane facets of a chain, trimmed parallel to the creases at their ends and ruled anew."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry import taylor
from devcad.geometry.layers import straight_sided
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array

POINT = 1e-9
"""Of the facet's size: a rail shorter than this is a point."""
SAME = 1e-11
"""Of the domain: parameters of both rails that are one, as where rulings run along the crease."""
GRID = 33
"""Places on each piece of a rail among which it is seen to leave the strip beside a crease."""
STEPS = 40
"""Newton's steps to the place where it does; a straight rail needs two."""
SIDES = ("base", "top")
"""The rails at v_from and at v_to."""


@dataclass(frozen=True, slots=True)
class Line:
    """The line through ``point`` along the unit ``way`` in the plane of a facet; ``inward`` is
    square to it and points into the facet. What is nearer to it than ``setback`` is cut off."""

    point: Array
    way: Array
    inward: Array
    setback: float = 0.0

    def meets(self, other: Line) -> Array:
        """Where the lines at the setbacks cross, (3,). Two parallel ones do not: inf or nan."""
        rows = np.stack([self.inward, other.inward])
        aim = np.array(
            [
                self.inward @ self.point + self.setback,
                other.inward @ other.point + other.setback,
            ]
        )
        middle = 0.5 * (self.point + other.point)
        with np.errstate(all="ignore"):  # both lie in the plane of the facet: the least step does
            return np.asarray(middle + np.linalg.pinv(rows) @ (aim - rows @ middle))


Span = tuple[float, float]
"""From which parameter of the facet to which a rail is left."""


def border(patch: Patch, end: int, setback: float = 0.0) -> Line:
    """The line of the first (0) or last (1) ruling of a plane facet."""
    low, high = patch.domain
    frame = patch.frame([np.nextafter(high, low) if end else np.nextafter(low, high)])
    jet = patch.jet([patch.domain[end]], 0)
    return Line(jet.c0[0, 0], frame.e[0], (-1.0 if end else 1.0) * frame.m[0], setback)


def is_point(patch: Patch, side: int) -> bool:
    """Whether the rail at v_from (0) or v_to (1) stands still."""
    ends = [_rail(patch, k, np.linspace(*patch.domain, 9))[0] for k in (0, 1)]
    size = float(np.linalg.norm(np.ptp(np.concatenate(ends), axis=0)))
    return float(np.linalg.norm(np.ptp(ends[side], axis=0))) <= POINT * size


def left_of(patch: Patch, side: int, lines: tuple[Line, Line]) -> Span | None:
    """What is left of a rail between the lines at the ends of a facet; None where nothing is."""
    low, high = patch.domain
    start = low if not lines[0].setback else _leaves(patch, side, lines[0], from_end=False)
    end = high if not lines[1].setback else _leaves(patch, side, lines[1], from_end=True)
    return None if start is None or end is None or start >= end else (start, end)


def room(patch: Patch, side: int, lines: tuple[Line, Line]) -> tuple[float, float]:
    """How much the setbacks take of a rail and how much there is, mm: square to the crease that
    takes more."""
    own = max(lines, key=lambda line: line.setback)
    points = _rail(patch, side, np.linspace(*patch.domain, GRID))[0]
    away = float(((points - own.point) @ own.inward).max())
    # what the other takes on the same rail, along the same direction
    far, other = points[-1 if own is lines[0] else 0], lines[1 if own is lines[0] else 0]
    slope = abs(float((points[-1] - points[0]) @ other.inward))
    across = abs(float((far - points[0 if own is lines[0] else -1]) @ own.inward))
    return own.setback + (other.setback * across / slope if slope else 0.0), max(away, 0.0)


def trimmed(patch: Patch, spans: tuple[Span | None, Span | None], corner: Array | None) -> Patch:
    """What is left of a plane facet: its rails over ``spans``, one of which may be the point
    ``corner`` (3,) instead, joined by straight rulings.

    Rulings that were parallel stay; else each rail runs evenly in its own parameter, so that the
    jets are exact. The parameter goes from the mean of the spans' starts to that of their ends.
    """
    known = [span for span in spans if span is not None]
    low, high = (float(np.mean([span[k] for span in known])) for k in (0, 1))
    reach = SAME * (patch.domain[1] - patch.domain[0])
    if corner is None and max(abs(span[k] - (low, high)[k]) for span in known for k in (0, 1)) <= (
        reach
    ):
        return patch.restricted(low, high)
    steady = _steady(patch, (low, high), spans)
    anchor = 0 if spans[0] is not None else 1

    def field(t: Array, order: int) -> RulingJet:
        ends = [_moved(patch, k, spans[k], (low, high), corner, t, order) for k in (0, 1)]
        ray = ends[1][0] - ends[0][0]
        if steady is None:
            e, length = taylor.unit(ray), taylor.norm(ray)
        else:
            e = taylor.constant_vector(steady, order, len(t))
            length = taylor.dot(ray, e)
        v = ends[anchor][1]
        v_from, v_to = (v - length, v) if anchor else (v, v + length)
        return RulingJet(ends[anchor][0] - taylor.mul(v, e), e, v_from, v_to)

    return Patch(field, (low, high), _breaks(patch, known, (low, high)), patch.causal)


def _steady(patch: Patch, domain: Span, spans: tuple[Span | None, Span | None]) -> Array | None:
    """The direction of all rulings of a facet that begins or ends in a tip, else None."""
    both = [_rail(patch, k, np.array(patch.domain))[0] for k in (0, 1)]
    lengths = np.linalg.norm(both[1] - both[0], axis=1)
    tips = lengths <= POINT * lengths.max()
    if not tips.any():
        return None
    if not straight_sided(patch) or None in spans:
        raise GeometryError(
            f"a crease at t = {domain[0]:.6g} bends a facet that ends in a tip with curved sides",
            remedy="let the extent begin behind the tip, or leave inside_radius out",
        )
    k = 1 if tips[0] else 0
    ends = [
        _rail(patch, side, np.array([span[k]]))[0][0] for side, span in enumerate(spans) if span
    ]
    return np.asarray((ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0]))


def _moved(
    patch: Patch,
    side: int,
    span: Span | None,
    domain: Span,
    corner: Array | None,
    t: Array,
    order: int,
) -> tuple[Array, Array]:
    """The series of a rail that runs over its span while t runs over the domain, and of its v."""
    if span is None:
        assert corner is not None
        return taylor.constant_vector(corner, order, len(t)), taylor.constant(0.0, order, len(t))
    pace = (span[1] - span[0]) / (domain[1] - domain[0])
    near = t - domain[0] < domain[1] - t  # so that both ends are met exactly
    at = np.where(near, span[0] + pace * (t - domain[0]), span[1] - pace * (domain[1] - t))
    points, v = _rail(patch, side, np.clip(at, *span), order)
    powers = pace ** np.arange(order + 1)
    return points * powers[:, None, None], v * powers[:, None]


def _rail(patch: Patch, side: int, t: Array, order: int | None = None) -> tuple[Array, Array]:
    """The points and v of a rail at t; with an ``order`` their series."""
    jet = patch.jet(t, order or 0)
    v = jet.v_to if side else jet.v_from
    points = jet.rail(v)
    return (points, v) if order is not None else (points[0], v[0])


def _breaks(patch: Patch, spans: list[Span], domain: Span) -> tuple[float, ...]:
    """Where the rails that run over the spans are less smooth."""
    found = sorted(
        domain[0] + (at - span[0]) * (domain[1] - domain[0]) / (span[1] - span[0])
        for span in spans
        for at in patch.breaks
        if span[0] < at < span[1]
    )
    apart = SAME * (domain[1] - domain[0])
    return tuple(at for before, at in pairwise([domain[0], *found]) if at - before > apart)


def _leaves(patch: Patch, side: int, line: Line, *, from_end: bool) -> float | None:
    """The first parameter from an end at which a rail is as far as the setback from a line."""
    t = np.concatenate([np.linspace(a, b, GRID) for a, b in pairwise(patch.ends)])[
        :: -1 if from_end else 1
    ]
    beyond = _rail(patch, side, t)[0]
    far = (beyond - line.point) @ line.inward - line.setback
    k = int(np.argmax(far >= 0.0))
    if not far[k] >= 0.0 or k == 0 or far[k:].min() < -POINT * line.setback:
        return None
    low, high = sorted((float(t[k - 1]), float(t[k])))
    at = float(t[k] - far[k] * (t[k] - t[k - 1]) / (far[k] - far[k - 1]))
    for _ in range(STEPS):
        points, _ = _rail(patch, side, np.array([at]), 1)
        rest = float((points[0, 0] - line.point) @ line.inward) - line.setback
        step = rest / float(points[1, 0] @ line.inward)
        before, at = at, float(np.clip(at - step, low, high))
        if abs(at - before) <= 4.0 * np.spacing(max(abs(low), abs(high))):
            break
    return at
