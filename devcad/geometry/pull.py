"""The pull of mitres: how the layers of a plane facet between two creases are drawn to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devcad.geometry.classify import EXACT
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array, rows_dot

BAND, POWER = 8.0, 6.0
"""The reach of a strong crease's pull, in its own shift, and the power by which it fades."""
GENTLE = np.tan(np.radians(10.0))
"""Shift of a layer at distance 1 by a crease of 20 degrees; an even pull between creases adds no
more, and a quarter of it half way: one crease alone is gentle up to 10 degrees."""
STEEPEST = 0.9
"""A fading pull may take this share of a facet's width where it is steepest."""
ROWS: Array = np.linspace(0.0, 1.0, 17)


@dataclass(frozen=True, slots=True)
class Pull:
    """What is added to n, in the plane of a facet, where its layers are drawn to its mitres.

    ``shifts`` (2, 3) is added on the first and on the last ruling, f shifts[0] + g shifts[1]
    between, where f = max(1 - x / reach, 0)^power, g the same of 1 - x, and x is the share of the
    facet: that of t, on a straight rail that of its length, along a ruling evenly between. So f
    and g follow one number, x, and 1/2 closed-integral of u x du vanishes along every border: what
    lies between two layers is area x thickness, holes and notches too.

    Between gentle or crowded creases the pull is even (reach = power = 1): straight rails stay
    straight, others smooth, and a wall leans by no more than the mitre does. Beside strong creases
    it fades within 8 shifts, and the walls beyond stand square to the sheet.
    """

    patch: Patch
    shifts: Array
    reach: float
    power: float
    straight: tuple[bool, bool]

    @property
    def breaks(self) -> tuple[float, ...]:
        """The parameters at which the pull of a crease ends."""
        if self.reach >= 1.0:
            return ()
        low, high = self.patch.domain
        at = (self.reach, 1.0 - self.reach)
        found = [low + x * (high - low) for x, s in zip(at, self.shifts, strict=True) if s.any()]
        return tuple(sorted(found))

    def __call__(self, t: Array, v: Array) -> Array:
        """What is added to n at the points (t, v), each (n,), (n, 3)."""
        return self._drawn(self._shares(t, v))

    def rails(self, t: Array) -> Array:
        """What is added to n at both ends of the rulings t, (n, 2, 3)."""
        shares, _ = self._rail_shares(t)
        return np.stack([self._drawn(x) for x in shares], axis=1)

    def slopes(self, t: Array) -> Array:
        """d/dt of ``rails``, (n, 2, 3)."""
        pairs = zip(*self._rail_shares(t), strict=True)
        return np.stack([self._slope(x) * dx[:, None] for x, dx in pairs], axis=1)

    def _drawn(self, x: Array) -> Array:
        f, g = (np.maximum(1.0 - s / self.reach, 0.0) ** self.power for s in (x, 1.0 - x))
        return np.asarray(f[:, None] * self.shifts[0] + g[:, None] * self.shifts[1])

    def _slope(self, x: Array) -> Array:
        """d/dx of what is added."""
        f, g = (
            self.power / self.reach * np.maximum(1.0 - s / self.reach, 0.0) ** (self.power - 1.0)
            for s in (x, 1.0 - x)
        )
        return np.asarray(g[:, None] * self.shifts[1] - f[:, None] * self.shifts[0])

    def _shares(self, t: Array, v: Array) -> Array:
        """The share of the facet at the points (t, v), (n,)."""
        if not any(self.straight):
            return self._even(t)
        (low, high), _ = self._rail_shares(t)
        jet = self.patch.jet(t, 0)
        length = jet.v_to[0] - jet.v_from[0]
        along = (v - jet.v_from[0]) / np.where(length > 0.0, length, 1.0)
        return np.asarray(low + along * (high - low))

    def _rail_shares(self, t: Array) -> tuple[list[Array], list[Array]]:
        """The shares at both ends of the rulings, and d/dt of them, (n,) each."""
        first, last = self.patch.domain
        x, speed = self._even(t), np.full(len(t), 1.0 / (last - first))
        shares, slopes = [x, x], [speed, speed]
        if any(self.straight):
            ends, here = self.patch.jet([first, last], 0), self.patch.jet(t, 1)
            sides = zip((ends.v_from, ends.v_to), (here.v_from, here.v_to), strict=True)
            for side, (at_ends, v) in enumerate(sides):
                start, end = ends.rail(at_ends)[0]
                square = float((end - start) @ (end - start))
                if self.straight[side] and square > 0.0:
                    rail = here.rail(v)
                    shares[side] = (rail[0] - start) @ (end - start) / square
                    slopes[side] = rail[1] @ (end - start) / square
        return shares, slopes

    def _even(self, t: Array) -> Array:
        first, last = self.patch.domain
        return np.asarray((t - first) / (last - first))


def even(patch: Patch, shifts: Array, straight: tuple[bool, bool]) -> Pull:
    """The pull that reaches evenly from one end of a plane patch to the other, where its mitres
    add ``shifts`` (2, 3) to n; ``straight`` tells which rails are."""
    return Pull(patch, shifts, 1.0, 1.0, straight)


def pulled(patch: Patch, shifts: Array, straight: tuple[bool, bool], distance: float) -> Pull:
    """The pull on the layers at +-``distance`` of a plane patch; the rest as for :func:`even`."""
    sizes = np.linalg.norm(shifts, axis=1)
    middle = 0.5 * float(np.linalg.norm(shifts.sum(axis=0)))
    if max(sizes.max(), 4.0 * middle) > GENTLE:
        band = BAND * distance * float(sizes.max())
        width = _least_width(patch)
        if 2.0 * band < width:
            fading = Pull(patch, shifts, band / width, POWER, straight)
            room, taken, _ = narrowest(fading, distance)
            if taken < STEEPEST * room:
                return fading
    return even(patch, shifts, straight)


def narrowest(pull: Pull, distance: float) -> tuple[float, float, float]:
    """Where the layers at +-``distance`` are narrowest against the facet: the facet's width there
    and what is taken off it, mm, and t. Taken >= width: a layer is turned inside out."""
    patch = pull.patch
    low, high = patch.domain
    t = np.unique(np.concatenate([low + (high - low) * ROWS, pull.breaks]))
    if pull.reach < 1.0:  # where it fades it is steep
        inner = pull.reach * (high - low) * ROWS
        t = np.unique(np.concatenate([t, low + inner, high - inner]))
    frame = patch.frame(np.clip(t, np.nextafter(low, high), np.nextafter(high, low)))
    across = frame.m[:-1] + frame.m[1:]
    across /= np.linalg.norm(across, axis=1)[:, None]
    shifts = distance * np.diff(pull.rails(t), axis=0)
    worst, found = -np.inf, (np.inf, 0.0, float(low))
    for side, v in enumerate((frame.v_from, frame.v_to)):
        steps = rows_dot(np.diff(frame.c0 + v[:, None] * frame.e, axis=0), across)
        taken = np.abs(rows_dot(shifts[:, side], across))
        width = float(steps.sum())
        if width <= EXACT * _span(patch):  # a tip: one layer has none, the other two
            return 0.0, float(taken.sum()), float(low)
        share = taken / np.maximum(steps, EXACT * width)
        k = int(share.argmax())
        if share[k] > worst:
            worst, found = float(share[k]), (width, float(share[k]) * width, float(t[k]))
    return found


def _least_width(patch: Patch) -> float:
    """The least distance of an end of a ruling from the other ruling's line."""
    low, high = patch.domain
    ends = patch.frame([np.nextafter(low, high), np.nextafter(high, low)])
    rails = [ends.c0 + v[:, None] * ends.e for v in (ends.v_from, ends.v_to)]
    return min(
        abs(float((rail[1 - row] - ends.c0[row]) @ ends.m[row])) for row in (0, 1) for rail in rails
    )


def _span(patch: Patch) -> float:
    jet = patch.jet(np.array(patch.domain), 0)
    return float(np.ptp(np.concatenate([jet.rail(jet.v_from)[0], jet.rail(jet.v_to)[0]]), 0).max())
