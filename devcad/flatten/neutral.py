"""The neutral fibre: the pattern of a sheet that is bent with force, not of its middle surface.

Where a sheet of thickness T bends at the rate c about its rulings, the fibre that keeps its
length lies (1/2 - K) T from the middle on the inner side. Its pattern is developed with
q - (1/2 - K) T |c| in the place of q; a and p stay. Both ways of bending and their change at an
inflection are in this one formula.

Source: geometry.md, 13; Ri + K T is the radius of the fibre in every bend allowance table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.classify import panels, sample_parameters
from devcad.geometry.patch import Frame, FrameJet, Patch
from devcad.geometry.regularity import smallest_radius
from devcad.geometry.taylor import Array

MIDDLE = 0.5
"""K of the middle of a sheet."""
GRID = 129
"""Places on each panel of a patch among which a change of the law is seen."""
HALVINGS = 52
FLAT = 1e9
"""A bend of so many thicknesses is none."""
NONE = 1e-9
"""Of its size: a condition that is less is none, its sign is rounding."""
JUMP = 1e-9
"""Of the width across a ruling: the pattern's speed jumps where it changes by more."""


@dataclass(frozen=True, slots=True)
class Law:
    """K as a function of the smallest inside radius over the thickness.

    ``series`` takes and gives a Taylor series (K + 1, n) of the ratio, its first row finite and
    not negative; ``kinks`` are the ratios where it is only continuous, increasing; between them
    it rises or falls. ``last`` is K of a sheet that hardly bends.
    """

    series: Callable[[Array], Array]
    last: float
    kinks: tuple[float, ...] = ()

    def __call__(self, ratio: Array) -> Array:
        """K at ratios (n,), which may be inf."""
        return np.asarray(self.jet(np.asarray(ratio, dtype=float)[None])[0])

    def jet(self, ratio: Array) -> Array:
        """The series of K, its last value where the ratio has no bound."""
        out = np.zeros_like(ratio)
        out[0] = self.last
        bent = np.isfinite(ratio[0]) & (ratio[0] < FLAT)
        if bent.any():
            out[:, bent] = self.series(ratio[:, bent])
        return out

    def between(self, low: Array, high: Array) -> tuple[Array, Array]:
        """The least and the largest K at ratios from ``low`` to ``high``, each (n,)."""
        ends = np.stack([low, high, *(np.clip(kink, low, high) for kink in self.kinks)])
        values = self(ends.ravel()).reshape(ends.shape)
        return values.min(axis=0), values.max(axis=0)


@dataclass(frozen=True, slots=True)
class Fibre:
    """The neutral fibre of a sheet of ``thickness`` in mm.

    ``words`` tell where its law is from. ``share`` of the shift is left: less than 1 on a sheet
    that is partly bent already.
    """

    thickness: float
    law: Law
    words: str = ""
    share: float = 1.0

    def shift(self, frame: Frame) -> Array:
        """(1/2 - K) T |c| at the frame's parameters, (n,): how much slower the pattern grows."""
        k = self.law(self._ratio(frame))
        return np.asarray(self.share * (MIDDLE - k) * self.thickness * np.abs(frame.c))

    def _ratio(self, frame: Frame) -> Array:
        """The smallest inside radius of each ruling over the thickness, (n,); inf where flat."""
        return np.asarray(inside_ratios(frame, self.thickness).min(axis=0))

    def shift_jet(self, jet: FrameJet) -> Array:
        """The Taylor series of :meth:`shift`, (K + 1, n)."""
        bending = np.where(jet.c[0] < 0.0, -jet.c, jet.c)
        ends = [jet.q + taylor.mul(v, jet.a) for v in (jet.ruling.v_from, jet.ruling.v_to)]
        width = np.where(ends[0][0] <= ends[1][0], ends[0], ends[1])
        ratio = np.full_like(bending, np.inf)
        bent = bending[0] * FLAT * self.thickness > width[0]
        with np.errstate(all="ignore"):
            ratio[:, bent] = taylor.div(width[:, bent], self.thickness * bending[:, bent])
        ratio[0] = np.maximum(ratio[0] - 0.5, 0.0)
        share = -self.law.jet(ratio)
        share[0] += MIDDLE
        return self.share * self.thickness * taylor.mul(share, bending)

    def pattern(self, jet: FrameJet, tips: tuple[bool, bool]) -> tuple[Array, Array, Array]:
        """The series of the pattern's q, v_from and v_to; an end of the extent that is an apex,
        as ``tips`` say of both, is moved to the pattern's own."""
        shift = self.shift_jet(jet)
        q, ends = jet.q - shift, [jet.ruling.v_from, jet.ruling.v_to]
        if any(tips):
            beyond = taylor.div(shift, jet.a)  # q + v a = 0 at the old end, = shift at the new
            ends = [v + beyond if tip else v for v, tip in zip(ends, tips, strict=True)]
        return q, ends[0], ends[1]

    def acts(self, patch: Patch) -> bool:
        """Whether the pattern of a patch is another than its middle's."""
        tightest = smallest_radius(patch).value / self.thickness - 0.5
        if not tightest < FLAT:
            return False
        least, most = self.law.between(np.array([max(tightest, 0.0)]), np.array([np.inf]))
        return bool(least[0] != MIDDLE or most[0] != MIDDLE)

    def breaks(self, patch: Patch) -> tuple[float, ...]:
        """The parameters inside the domain where the pattern is less smooth than the patch: where
        the bending changes its sign, the law its formula, or the tighter end of the ruling."""
        return _breaks(self, patch)

    def conditions(self, patch: Patch, t: Array, most: float) -> tuple[Array, Array]:
        """What changes its sign where the formula changes, and how large it may be, each
        (n, conditions); ``most`` is the patch's sharpest bending."""
        frame = patch.frame(t)
        values, sizes = [frame.c], [np.full(len(t), most)]
        if self.law.kinks:
            width = np.minimum(frame.q + frame.v_from * frame.a, frame.q + frame.v_to * frame.a)
            reach = np.abs(frame.q) + np.abs(frame.a) * np.abs(frame.v_to)
            for kink in self.law.kinks:
                values.append(np.abs(frame.c) * (kink + 0.5) * self.thickness - width)
                sizes.append(reach)
            values.append(frame.a * (frame.v_to - frame.v_from))
            sizes.append(reach)
        return np.stack(values, axis=1), np.stack(sizes, axis=1)

    def jumps(self, patch: Patch) -> tuple[float, ...]:
        """The breaks of a patch across which the shift jumps: there a line that is smooth in the
        pattern has a corner on the sheet."""
        at = np.array(patch.breaks)
        if not at.size:
            return ()
        sides = [patch.frame(np.nextafter(at, way)) for way in (-np.inf, np.inf)]
        ratios = [1.0 - self.shift(frame) / _width(frame) for frame in sides]
        return tuple(at[np.abs(ratios[1] - ratios[0]) > JUMP].tolist())


@lru_cache(maxsize=32)  # the development and the pattern ask for the same
def _breaks(fibre: Fibre, patch: Patch) -> tuple[float, ...]:
    found: list[float] = []
    most = float(np.abs(patch.frame(sample_parameters(patch, 17)).c).max())
    for low, high in pairwise(panels(patch)):
        t = np.linspace(low, high, GRID)
        t[0], t[-1] = np.nextafter(low, high), np.nextafter(high, low)
        values, sizes = fibre.conditions(patch, t, most)
        signs = np.where(np.abs(values) > NONE * sizes, np.sign(values), 0.0)
        for column in range(signs.shape[1]):
            told = np.flatnonzero(signs[:, column])
            before = signs[told, column]
            change = np.flatnonzero(before[1:] != before[:-1])
            a, b, sign = t[told[change]], t[told[change + 1]], before[change]
            for _ in range(HALVINGS if change.size else 0):
                middle = 0.5 * (a + b)
                same = fibre.conditions(patch, middle, most)[0][:, column] * sign > 0.0
                a, b = np.where(same, middle, a), np.where(same, b, middle)
            found += (0.5 * (a + b)).tolist()
    return tuple(sorted({*found, *patch.breaks}))


def _width(frame: Frame) -> Array:
    """The speed across the rulings at the middle of the extent, (n,)."""
    return np.asarray(frame.q + 0.5 * (frame.v_from + frame.v_to) * frame.a)


def end_radii(frame: Frame) -> Array:
    """The radius of curvature at v_from and at v_to in mm, (2, n); inf where flat."""
    width = frame.q + np.stack([frame.v_from, frame.v_to]) * frame.a
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.nan_to_num(width / np.abs(frame.c), nan=np.inf, posinf=np.inf)


def inside_ratios(frame: Frame, thickness: float) -> Array:
    """The inside radius over the thickness at v_from and at v_to, (2, n); inf where flat."""
    return np.asarray(np.maximum(end_radii(frame) / thickness - 0.5, 0.0))


def least_k(fibre: Fibre, patches: tuple[Patch, ...]) -> float:
    """The least K on the rulings of patches; that of a flat sheet where none bends."""
    found: list[float] = []
    for patch in patches:
        tightest = smallest_radius(patch).value / fibre.thickness - 0.5
        if tightest < FLAT:
            ratios = inside_ratios(patch.frame(sample_parameters(patch, 65)), fibre.thickness)
            least = np.append(ratios.min(axis=0), max(tightest, 0.0))
            found += fibre.law(least[least < FLAT]).tolist()
    return min(found, default=fibre.law.last)


def left_over(fibre: Fibre, patch: Patch) -> float:
    """By how much mm the neutral fibre is longer or shorter than its pattern at most, because K is
    one number along each ruling: theta T |dK|, the integral of the bending times the thickness
    times the difference of K along the ruling."""
    if not fibre.law.kinks or smallest_radius(patch).value >= FLAT * fibre.thickness:
        return 0.0
    t = sample_parameters(patch, 65)
    frame = patch.frame(t)
    low, high = np.sort(inside_ratios(frame, fibre.thickness), axis=0)
    least, most = fibre.law.between(low, high)
    own = fibre.law(low)
    rate = fibre.thickness * np.abs(frame.c) * np.maximum(most - own, own - least)
    ends = np.clip(t[[0, -1]], *patch.domain)
    inner = float(np.sum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t)))
    # samples keep a rounding or a millionth away from the ends
    aside = ends[0] - patch.domain[0], patch.domain[1] - ends[1]
    return inner + float(rate[0] * aside[0] + rate[-1] * aside[1])
