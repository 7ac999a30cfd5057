"""Cuts: the lines along which a sheet is cut inside its edges, given on the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.drawing import Drawing
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Track:
    """One smooth stretch of a line on patch number ``patch`` of a chain.

    ``series`` gives its places (t, v) at u, from its first knot to its last. Between knots the
    line is analytic; at an inner knot it is tangent continuous (it crosses a break of the patch).
    """

    patch: int
    series: Piecewise

    def __call__(self, u: Array) -> tuple[Array, Array, Array, Array]:
        """t, v and their derivatives dt/du, dv/du at u, each (n,)."""
        places, slopes = self.series(u), self.series.derivative()(u)
        return places[:, 0], places[:, 1], slopes[:, 0], slopes[:, 1]

    @property
    def u(self) -> tuple[float, float]:
        """The first and the last parameter."""
        return float(self.series.knots[0]), float(self.series.knots[-1])

    def drawn(self, layer: str) -> Drawing:
        """The same stretch as a drawing on a layer of the pattern."""
        return Drawing(layer, self.patch, self, self.u)


@dataclass(frozen=True, slots=True)
class Cut:
    """A contour on the sheet, the sheet on its left as the front shows it: round a hole clockwise.

    Each of the ``tracks`` begins where the one before ends, within rounding: on the same patch
    (a corner), or across the ruling between two patches, the seam of a tube included. A contour
    that is not ``closed`` begins and ends on the sheet's edges: a notch.
    """

    name: str
    tracks: tuple[Track, ...]
    closed: bool


def opened(cuts: tuple[Cut, ...], patches: tuple[Patch, ...]) -> tuple[Cut, ...]:
    """The cuts of a tube on the same patches when its first and last rulings have come apart: a
    cut that ran over the seam is a notch in either end, each of its stretches one."""
    return tuple(part for cut in cuts for part in _opened(cut, patches))


def _opened(cut: Cut, patches: tuple[Patch, ...]) -> list[Cut]:
    count = len(cut.tracks)
    pairs = [(cut.tracks[k], cut.tracks[(k + 1) % count]) for k in range(count)]
    after = [k for k, (one, other) in enumerate(pairs) if _over_seam(one, other, patches)]
    if not cut.closed:
        after = [k for k in after if k < count - 1]
    if not after:
        return [cut]
    turned = cut.tracks
    if cut.closed:
        turned = cut.tracks[after[-1] + 1 :] + cut.tracks[: after[-1] + 1]
        after = [(k - after[-1] - 1) % count for k in after]
    ends = [*(k + 1 for k in sorted(after)), count]
    starts = [0, *ends[:-1]]
    return [Cut(cut.name, turned[a:b], False) for a, b in zip(starts, ends, strict=True) if a < b]


def _over_seam(one: Track, other: Track, patches: tuple[Patch, ...]) -> bool:
    """Whether a line goes on from the last patch's end to the first patch's start, or back."""
    last = len(patches) - 1
    if {one.patch, other.patch} - {0, last}:
        return False
    t = float(one.series(np.array([one.u[1]]))[0, 0])
    later = float(other.series(np.array([other.u[0]]))[0, 0])

    def ends(patch: int, at: float) -> bool:
        low, high = patches[patch].domain
        return high - at < at - low

    if last == 0:  # on one patch the parameter jumps
        low, high = patches[0].domain
        return abs(later - t) > 0.5 * (high - low)
    if one.patch == other.patch:
        return False
    forward = one.patch == last and ends(last, t) and not ends(0, later)
    return forward or (one.patch == 0 and not ends(0, t) and ends(last, later))
