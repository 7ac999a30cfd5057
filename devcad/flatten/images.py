"""The tracks of cuts in the plane, and what they sweep on the surface; all of a patch at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from devcad.flatten.drawings import image
from devcad.flatten.pattern import Unrolled
from devcad.geometry.chebyshev import Piecewise, integration
from devcad.geometry.cuts import Track
from devcad.geometry.patch import Frame, Patch
from devcad.geometry.resolving import Panels, resolve_many
from devcad.geometry.taylor import Array

Length = tuple[Track, tuple[float, float]]
"""A track and from where to where."""
Between = Callable[[Frame, Array, Array], Array]
"""The area of the rulings between two heights, per t."""
Index = NDArray[np.intp]
INSIDE = 1e-13
"""Of a span: its ends are asked as little inside, where the patch answers for this side."""


@dataclass(frozen=True, slots=True)
class TrackImage:
    """The image of a track in the plane, as a series of its own: looked at often, made once.

    ``series`` has the components x, y, dx/du, dy/du.
    """

    track: Track
    series: Piecewise

    def __call__(self, u: Array) -> tuple[Array, Array]:
        """Points (n, 2) and derivatives (n, 2) at u (n,)."""
        knots, table = self.series.knots, self.series.coefficients
        panel = np.clip(np.searchsorted(knots, u, side="right") - 1, 0, len(table) - 1)
        low, high = knots[panel], knots[panel + 1]
        basis = _basis(((u - low) - (high - u)) / (high - low), table.shape[1])
        if len(table) == 1:
            values = basis @ table[0]
        else:
            values = np.einsum("nk,nkd->nd", basis, table[panel])
        return values[:, :2], values[:, 2:]


@dataclass(frozen=True, slots=True)
class _Spans:
    """Lengths of tracks between neighbouring knots: whose they are, (m,), from ``low`` to
    ``high`` (m,); and the polynomials there, (m, N, 4) for t, v, dt/dx, dv/dx over ``start`` to
    ``end`` (m,), x from -1 to 1."""

    owner: Index
    low: Array
    high: Array
    start: Array
    end: Array
    coefficients: Array

    def places(self, which: Index, u: Array) -> Array:
        """t, v, dt/du and dv/du at u (n,) on span which[i], (n, 4)."""
        start, end = self.start[which], self.end[which]
        basis = _basis(((u - start) - (end - u)) / (end - start), self.coefficients.shape[1])
        values = np.einsum("nk,nkd->nd", basis, self.coefficients[which])
        values[:, 2:] *= (2.0 / (end - start))[:, None]
        return np.asarray(values)


def within(knots: Array, low: float, high: float) -> Array:
    """The ends low and high with the knots between them."""
    inner = knots[(knots > low) & (knots < high)]
    return np.concatenate([[low], inner, [high]])


def track_images(
    lengths: Sequence[Length], pairs: Sequence[tuple[Patch, Unrolled]]
) -> list[TrackImage]:
    """The images of lengths of tracks, each over its length."""
    out: dict[int, TrackImage] = {}
    for number, (patch, unrolled) in enumerate(pairs):
        mine = [k for k, (track, _) in enumerate(lengths) if track.patch == number]
        if not mine:
            continue
        spans = _spans([lengths[k] for k in mine])
        panels = _resolved_images(spans, patch, unrolled)
        joined = _joined(panels.series(len(spans.low)), spans.owner, len(mine))
        for k, series in zip(mine, joined, strict=True):
            slopes = series.derivative().coefficients
            table = np.concatenate([series.coefficients, slopes], axis=2)
            out[k] = TrackImage(lengths[k][0], Piecewise(series.knots, table))
    return [out[k] for k in range(len(lengths))]


def swept_area(lengths: Sequence[Length], patches: Sequence[Patch], between: Between) -> float:
    """The integral along lengths of tracks, in dt, of the area between v_from and them, mm2."""
    total = 0.0
    for number, patch in enumerate(patches):
        mine = [length for length in lengths if length[0].patch == number]
        if not mine:
            continue
        spans = _spans(mine)
        f = patch.frame(np.linspace(*patch.domain, 9)[1:-1])
        # along a ruling nothing is swept: nothing beside a thousandth of the patch
        most = float(np.nanmax(np.abs(between(f, f.v_from, f.v_to)))) * np.ptp(patch.domain)
        panels = resolve_many(
            partial(_rate, patch=patch, spans=spans, between=between),
            spans.low,
            spans.high,
            scale=1e-3 * most / (spans.high - spans.low)[:, None],
        )
        weights = integration(panels.coefficients.shape[1]).sum(axis=0)  # T_k(1) = 1
        half = 0.5 * (panels.high - panels.low)
        total += float(half @ panels.coefficients[:, :, 0] @ weights)
    return total


def _rate(which: Index, u: Array, *, patch: Patch, spans: _Spans, between: Between) -> Array:
    """The area between v_from and the tracks, per u, (n, 1)."""
    low, high = spans.low[which], spans.high[which]
    margin = INSIDE * (high - low)
    t, v, dt, _ = spans.places(which, np.clip(u, low + margin, high - margin)).T
    f = patch.frame(np.clip(t, *patch.domain))
    return np.asarray(between(f, f.v_from, v) * dt)[:, None]


def _resolved_images(spans: _Spans, patch: Patch, unrolled: Unrolled) -> Panels:
    """The images of spans in the plane, x and y."""

    def sample(which: Index, u: Array) -> Array:
        places = tuple(spans.places(which, u).T)
        return image(lambda _: places, patch, unrolled)(u)[0]

    ends = [sample(np.arange(len(u)), u) for u in (spans.low, spans.high)]
    size = np.abs(np.concatenate(ends, axis=1)).max(axis=1)
    return resolve_many(sample, spans.low, spans.high, scale=np.column_stack([size, size]))


def _spans(lengths: Sequence[Length]) -> _Spans:
    """The lengths of tracks divided at their knots."""
    owner, rows, ends = [], [], []
    for k, (track, u) in enumerate(lengths):
        knots = track.series.knots
        cut = within(knots, *u)
        middles = 0.5 * (cut[1:] + cut[:-1])
        panel = np.clip(np.searchsorted(knots, middles, side="right") - 1, 0, len(knots) - 2)
        owner += [k] * len(panel)
        ends.append(np.column_stack([cut[:-1], cut[1:], knots[panel], knots[panel + 1]]))
        rows += list(track.series.coefficients[panel])
    table = np.zeros((len(rows), max(len(row) for row in rows), 2))
    for place, row in zip(table, rows, strict=True):
        place[: len(row)] = row
    # a panel of width 2 each: derivatives by x
    widths = np.arange(0.0, 2.0 * len(rows) + 1.0, 2.0)
    slopes = Piecewise(widths, table).derivative().coefficients
    low, high, start, end = np.concatenate(ends).T
    return _Spans(np.array(owner), low, high, start, end, np.concatenate([table, slopes], axis=2))


def _joined(series: list[Piecewise], owner: Index, number: int) -> list[Piecewise]:
    """The series of consecutive spans of one length as one."""
    first = np.searchsorted(owner, np.arange(number + 1)).tolist()
    return [_chained(series[a:b]) for a, b in pairwise(first)]


def _chained(parts: list[Piecewise]) -> Piecewise:
    if len(parts) == 1:
        return parts[0]
    table = np.zeros(
        (
            sum(len(part.coefficients) for part in parts),
            max(part.coefficients.shape[1] for part in parts),
            2,
        )
    )
    at = 0
    for part in parts:
        count, size = part.coefficients.shape[:2]
        table[at : at + count, :size] = part.coefficients
        at += count
    knots = [parts[0].knots[:1], *(part.knots[1:] for part in parts)]
    return Piecewise(np.concatenate(knots), table)


def _basis(x: Array, size: int) -> Array:
    """T_k(x) for k < size, (n, size): quicker than the recurrence for many points."""
    return np.asarray(np.cos(np.arccos(np.clip(x, -1.0, 1.0))[:, None] * np.arange(size)))
