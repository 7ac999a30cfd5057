"""Trimming: what a plane leaves of a strip of rulings, as patches again.

A ruling c0 + v e meets the plane N.P = d at v = (d - N.c0) / (N.e), a Taylor series wherever c0
and e are. Where the plane leaves a ruling at one of its ends the patch is split, so that both
ends of every extent stay smooth; a ruling that is wholly cut off ends the sheet, in a tip or
along a ruling that lies in the plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry import chebyshev, taylor
from devcad.geometry.chain import JOINED, TIP
from devcad.geometry.drawing import Drawing
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array

IN_PLANE = 1e-12
"""Of the panel's size: a point as near to the plane lies in it."""
SNAP = 1e-9
"""Of a patch's domain: places as near to one another, or to its end, are one."""
REAL = 1e-5
"""Imaginary part, of a panel's half width, of a root that may be where the plane only touches."""
INSIDE = (0.29, 0.5, 0.77)
"""Where a stretch between two such places is looked at, as shares of it."""
NEWTON = 3
"""Steps from a root of the polynomial to the root of the function."""

State = Literal["whole", "to", "from", "off"]
"""What is left of a ruling: all, all up to the plane, all from the plane on, nothing."""


@dataclass(frozen=True, slots=True)
class Trimmed:
    """The patches that are left, in order; patch k is a part of the old patch ``sources[k]`` with
    its parameters. ``base_closed`` is False where the trim opened a closed surface."""

    patches: tuple[Patch, ...]
    base_closed: bool
    sources: tuple[int, ...]

    def carried(self, drawings: Sequence[Drawing]) -> tuple[Drawing, ...]:
        """Drawings on the old patches, on the new ones: each shows its part."""
        return tuple(
            replace(drawing, patch=k)
            for drawing in drawings
            for k, source in enumerate(self.sources)
            if source == drawing.patch
        )


def trimmed(
    patches: tuple[Patch, ...], point: Array, normal: Array, *, base_closed: bool
) -> Trimmed:
    """What is left of a chain of patches on the side of a plane that its normal points away from.

    Args:
        point, normal: (3,) of the plane, the normal of any length, in the patches' own units.
        base_closed: whether the base curve returns to its start; where the last ruling is the
            first one too, what is left may run over the seam.
    Raises:
        GeometryError: the plane leaves nothing, several pieces, or everything; or it meets a
        ruling that lies in it.
    """
    plane = _Plane(np.asarray(point, dtype=float), _unit(normal), _size(patches, point))
    pieces = [piece for k, patch in enumerate(patches) for piece in _pieces(patch, k, plane)]
    if all(piece.state == "whole" for piece in pieces):
        raise GeometryError(
            "the plane cuts nothing off",
            remedy="move it, or turn its normal round: kept is the side it points away from",
        )
    runs = _runs([piece for piece in pieces if piece.state != "off"])
    if not runs:
        raise GeometryError(
            "the plane cuts everything off",
            remedy="turn its normal round: kept is the side it points away from",
        )
    first, last = runs[0][0], runs[-1][-1]
    over_seam = (
        base_closed
        and first.starts_patch(0)
        and last.ends_patch(len(patches) - 1)
        and _closes(patches, plane.size)
        and not first.point_like(0)
        and not last.point_like(-1)
    )
    if over_seam and len(runs) > 1:
        runs = [*runs[1:-1], runs[-1] + runs[0]]
    if len(runs) > 1:
        where = ", ".join(f"{run[0].low:.6g}" for run in runs)
        raise GeometryError(
            f"the plane leaves {len(runs)} pieces, beginning at t = {where}",
            value=float(len(runs)),
            limit=1.0,
            remedy="make a panel of each piece, with a second plane that cuts the others off",
        )
    (run,) = runs
    complete = len(run) == len(pieces) and run[0] is pieces[0]
    return Trimmed(
        tuple(piece.made() for piece in run),
        base_closed and complete and (over_seam or not _closes(patches, plane.size)),
        tuple(piece.number for piece in run),
    )


@dataclass(frozen=True, slots=True)
class _Plane:
    """A plane; ``size`` is that of what it cuts, and of the numbers that say where."""

    point: Array
    normal: Array
    size: float

    def along(self, jet: RulingJet) -> tuple[Array, Array]:
        """The series of the height over the plane at v = 0 and of its growth along the ruling."""
        away = jet.c0.copy()
        away[0] -= self.point
        return away @ self.normal, jet.e @ self.normal

    def heights(self, patch: Patch, t: Array, order: int = 0) -> Array:
        """The series of the heights of both ends of the rulings at t, (order + 1, n, 2)."""
        jet = patch.field(t, order)
        height, growth = self.along(jet)
        ends = [height + taylor.mul(v, growth) for v in (jet.v_from, jet.v_to)]
        return np.stack(ends, axis=-1)

    def state(self, patch: Patch, low: float, high: float) -> State:
        """What is left of the rulings between two places where that changes."""
        seen = self.heights(patch, low + (high - low) * np.array(INSIDE))[0]
        ends = seen[np.abs(seen).argmax(axis=0), (0, 1)]
        start, end = np.where(np.abs(ends) <= IN_PLANE * self.size, 0.0, ends).tolist()
        if max(start, end) <= 0.0:
            return "whole"
        if min(start, end) >= 0.0:
            return "off"
        return "to" if end > 0.0 else "from"


@dataclass(frozen=True, slots=True)
class _Piece:
    """The part of patch ``number`` from ``low`` to ``high`` with one state throughout."""

    plane: _Plane
    patch: Patch
    number: int
    low: float
    high: float
    state: State

    def starts_patch(self, number: int) -> bool:
        """Whether it begins where patch ``number`` does."""
        return self.number == number and self.low == self.patch.domain[0]

    def ends_patch(self, number: int) -> bool:
        """Whether it ends where patch ``number`` does."""
        return self.number == number and self.high == self.patch.domain[1]

    def follows(self, before: _Piece) -> bool:
        """Whether it is joined to a piece along a ruling."""
        same = self.number == before.number and self.low == before.high
        next_patch = before.ends_patch(self.number - 1) and self.starts_patch(self.number)
        return (same or next_patch) and not self.point_like(0) and not before.point_like(-1)

    def point_like(self, end: int) -> bool:
        """Whether what is left of the first (0) or last (-1) ruling is a point."""
        t = self.high if end else self.low
        jet = self.patch.field(np.array([t]), 0)
        v_from, v_to = float(jet.v_from[0, 0]), float(jet.v_to[0, 0])
        if self.state == "to":
            v_to = self.meets(t)
        elif self.state == "from":
            v_from = self.meets(t)
        return v_to - v_from <= TIP * self.plane.size

    def meets(self, t: float) -> float:
        """Where the plane meets the ruling at t, an end of the piece: at the ruling's own end, if
        it is that within rounding.

        Raises:
            GeometryError: the ruling lies in the plane.
        """
        jet = self.patch.field(np.array([t]), 0)
        height, growth = (float(x[0, 0]) for x in self.plane.along(jet))
        ends = float(jet.v_from[0, 0]), float(jet.v_to[0, 0])
        if abs(growth) * (ends[1] - ends[0]) <= IN_PLANE * self.plane.size < ends[1] - ends[0]:
            raise GeometryError(
                f"the ruling at t = {t:.6g} lies in the plane, which others cross",
                value=t,
                remedy="turn or move the plane a little",
            )
        v = -height / growth if growth else ends[0]
        nearest = min(ends, key=lambda end: abs(v - end))
        return nearest if abs(v - nearest) <= SNAP * self.plane.size else v

    def made(self) -> Patch:
        """The piece as a patch of its own, the same parameters."""
        part = self.patch.restricted(self.low, self.high)
        if self.state == "whole":
            return part
        plane, field, state = self.plane, self.patch.field, self.state
        ends = [(t, self.meets(t)) for t in (self.low, self.high)]

        def cut(t: Array, order: int) -> RulingJet:
            jet = field(t, order)
            height, growth = plane.along(jet)
            v = taylor.div(-height, growth)
            for at, exact in ends:  # shared with a neighbour, or the point of a tip: to the bit
                v[0] = np.where(t == at, exact, v[0])
            return replace(jet, v_to=v) if state == "to" else replace(jet, v_from=v)

        return replace(part, field=cut)


def _pieces(patch: Patch, number: int, plane: _Plane) -> list[_Piece]:
    """The parts of a patch with one state each, in order; neighbours of one state are one, unless
    they hang together in a point."""
    ends = [patch.domain[0], *_places(patch, plane), patch.domain[1]]
    out: list[_Piece] = []
    for low, high in pairwise(ends):
        state = plane.state(patch, low, high)
        piece = _Piece(plane, patch, number, low, high, state)
        if out and out[-1].state == state and (state == "off" or not out[-1].point_like(-1)):
            piece = replace(piece, low=out.pop().low)
        out.append(piece)
    return out


def _places(patch: Patch, plane: _Plane) -> list[float]:
    """Parameters inside the domain where the plane passes, or touches, an end of the ruling."""

    def heights(t: Array) -> Array:
        return np.asarray(plane.heights(patch, t)[0])

    found: list[float] = []
    series = chebyshev.resolve(heights, patch.segments, scale=plane.size)
    for low, high, table in zip(
        series.knots[:-1], series.knots[1:], series.coefficients, strict=True
    ):
        for end in (0, 1):
            roots = _roots(table[:, end], plane.size)
            t = 0.5 * (low + high) + 0.5 * (high - low) * roots
            found += _polished(patch, plane, np.clip(t, low, high), end).tolist()
    start, *_, stop = patch.ends
    near = SNAP * (stop - start)
    places: list[float] = []
    for root in sorted(found):
        t = next((end for end in patch.ends if abs(root - end) <= near), root)
        if start < t < stop and not (places and t - places[-1] <= near):
            places.append(t)
    return places


def _roots(coefficients: Array, size: float) -> Array:
    """The real roots of a Chebyshev series on [-1, 1], and where it nearly has a double one."""
    seen = np.flatnonzero(np.abs(coefficients) > 1e-15 * size)
    if not len(seen) or seen[-1] == 0:
        return np.zeros(0)
    roots = np.polynomial.chebyshev.chebroots(coefficients[: seen[-1] + 1])
    real = (np.abs(roots.imag) <= REAL) & (np.abs(roots.real) <= 1.0 + REAL)
    return np.asarray(np.unique(roots.real[real]))


def _polished(patch: Patch, plane: _Plane, t: Array, end: int) -> Array:
    """Roots to rounding by Newton's method; where the slope vanishes, those of the slope."""
    if not len(t):
        return t
    low, high = patch.domain
    start = t
    for _ in range(NEWTON):
        h = plane.heights(patch, t, 2)[..., end]
        value, slope, bend = h[0], h[1], 2.0 * h[2]
        # a touch: the parabola's top is within a thousandth of the domain
        with np.errstate(divide="ignore", invalid="ignore"):
            top = np.abs(slope / bend) <= 1e-6 * (high - low)
            step = np.where(top, slope / bend, value / slope)
        t = np.clip(t - np.where(np.isfinite(step), step, 0.0), low, high)
    lost = np.abs(t - start) > 1e-3 * (high - low)
    return np.asarray(np.where(lost, start, t))


def _runs(pieces: list[_Piece]) -> list[list[_Piece]]:
    """The pieces in runs that hang together along rulings."""
    runs: list[list[_Piece]] = []
    for piece in pieces:
        if runs and piece.follows(runs[-1][-1]):
            runs[-1].append(piece)
        else:
            runs.append([piece])
    return runs


def _closes(patches: tuple[Patch, ...], size: float) -> bool:
    """Whether the last ruling is the first one."""
    ends = []
    for patch, t in ((patches[0], patches[0].domain[0]), (patches[-1], patches[-1].domain[1])):
        jet = patch.field(np.array([t]), 0)
        ends.append(np.stack([jet.rail(jet.v_from)[0, 0], jet.rail(jet.v_to)[0, 0]]))
    return bool(np.abs(ends[0] - ends[1]).max() <= JOINED * size)


def _size(patches: tuple[Patch, ...], point: Array) -> float:
    """The size of the patches and of the numbers that they and the plane are told in."""
    points = [np.asarray(point, dtype=float)[None]]
    for patch in patches:
        jet = patch.field(np.linspace(*patch.domain, 17), 0)
        points += [jet.rail(jet.v_from)[0], jet.rail(jet.v_to)[0]]
    return float(np.abs(np.concatenate(points)).max())


def _unit(normal: Array) -> Array:
    vector = np.asarray(normal, dtype=float)
    vector = vector / np.abs(vector).max()
    return np.asarray(vector / np.linalg.norm(vector))
