"""Lines, arcs, screws and what is put together from them, with exact derivatives.

A screw is r(s) = origin + slope s + U cos(omega s + phase) + V sin(omega s + phase); a line, a
circle, an ellipse and a helix are one screw each, a polyline with rounded corners is several.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from devcad.errors import JobError
from devcad.geometry.curve import SAME_DIRECTION, Curve, angles, ends_meet, size
from devcad.geometry.taylor import Array

ORIGIN = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Screw:
    """One screw; (3,) each."""

    origin: npt.ArrayLike
    slope: npt.ArrayLike = ORIGIN
    u: npt.ArrayLike = ORIGIN
    v: npt.ArrayLike = ORIGIN
    omega: float = 0.0
    phase: float = 0.0


@dataclass(frozen=True, slots=True)
class _Table:
    """Screws one after the other: ``starts`` (m,), all else (m, 3) or (m,)."""

    starts: Array
    origin: Array
    slope: Array
    u: Array
    v: Array
    omega: Array
    phase: Array

    def jet(self, t: Array, order: int) -> Array:
        """The Taylor coefficients (order + 1, n, 3) at t (n,); the later screw at a start."""
        i = np.maximum(np.searchsorted(self.starts, t, side="right") - 1, 0)
        s = t - self.starts[i]
        angle = self.omega[i] * s + self.phase[i]
        wave = np.stack([np.cos(angle), np.sin(angle)])  # its k-th derivative turns by k 90 deg
        factor = np.ones_like(s)
        out = np.zeros((order + 1, len(t), 3))
        for k in range(order + 1):
            factor = factor * self.omega[i] / k if k else factor
            cosine, sine = factor * wave
            out[k] = cosine[:, None] * self.u[i] + sine[:, None] * self.v[i]
            wave = np.stack([-wave[1], wave[0]])
        out[0] += self.origin[i] + s[:, None] * self.slope[i]
        if order:
            out[1] += self.slope[i]
        return out


def screw(part: Screw, domain: tuple[float, float]) -> Curve:
    """One screw over the domain, s = 0 at its start."""
    curve = Curve(_table([part], np.array([domain[0]])).jet, domain)
    return replace(curve, closed=ends_meet(curve))


def _table(parts: Sequence[Screw], starts: Array) -> _Table:
    def column(name: str) -> Array:
        return np.array([getattr(part, name) for part in parts], dtype=float)

    return _Table(starts, *(column(n) for n in ("origin", "slope", "u", "v", "omega", "phase")))


def line(start: npt.ArrayLike, end: npt.ArrayLike) -> Curve:
    """The straight line from start to end; the parameter is the fraction of its length."""
    a, b = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    return screw(Screw(a, slope=b - a), (0.0, 1.0))


def polyline(points: Array, *, closed: bool, radius: float) -> Curve:
    """The polyline through the points (n, 3), its corners rounded by arcs of ``radius``.

    The parameter is the fraction of the length. Arcs touch both sides; radius 0 keeps the
    corners. Vertices where the direction turns by less than 1e-9 rad are none. A closed polyline
    (first point not repeated) starts at the first point, or where the arc there ends. That
    neighbouring points differ is not checked.

    Raises:
        JobError: the radius does not fit; the message gives the largest that does.
    """
    points = _without_straight_vertices(points, closed)
    vertices = np.concatenate([points, points[:1]]) if closed else points
    edges = np.diff(vertices, axis=0)
    lengths = np.linalg.norm(edges, axis=1)
    along = edges / lengths[:, None]
    turn = np.zeros(len(vertices))
    turn[1:-1] = angles(along[:-1], along[1:])
    if closed:
        turn[[0, -1]] = angles(along[-1], along[0])
    turn[turn <= SAME_DIRECTION] = 0.0
    if radius == 0.0:
        return _joined(_straight(vertices, along, lengths), turn[1:-1] > 0.0)
    _check_radius(radius, turn, lengths)
    parts = _rounded(vertices, along, lengths, turn, radius)
    return _joined(parts, np.zeros(len(parts) - 1, dtype=bool))


def _without_straight_vertices(points: Array, closed: bool) -> Array:
    """The points where the polyline turns; the first and the last always stay."""
    after = np.concatenate([points[1:], points[:1]]) if closed else points[1:]
    edges = after - points[: len(after)]
    turn = angles(edges[:-1], edges[1:])  # at points[1], points[2], ...
    keep = np.ones(len(points), dtype=bool)
    keep[1 : 1 + len(turn)] = turn > SAME_DIRECTION
    return points[keep]


Part = tuple[Screw, float]
"""A screw per unit of length, and its length."""


def _straight(vertices: Array, along: Array, lengths: Array) -> list[Part]:
    """The edges."""
    return [
        (Screw(p, slope=d), float(length))
        for p, d, length in zip(vertices[:-1], along, lengths, strict=True)
    ]


def _rounded(
    vertices: Array, along: Array, lengths: Array, turn: Array, radius: float
) -> list[Part]:
    """The edges shortened at both ends, each followed by the arc at its end."""
    setback = radius * np.tan(0.5 * turn)
    smallest = 1e-12 * size(vertices)  # shorter edges are used up by the arcs
    parts: list[Part] = []
    for i, d in enumerate(along):
        rest = float(lengths[i] - setback[i] - setback[i + 1])
        if rest > smallest:
            parts.append((Screw(vertices[i] + setback[i] * d, slope=d), rest))
        if setback[i + 1] > 0.0:
            after = along[(i + 1) % len(along)]
            inward = after - (after @ d) * d
            inward = inward / np.linalg.norm(inward)
            touch = vertices[i + 1] - setback[i + 1] * d
            arc = Screw(
                touch + radius * inward, u=-radius * inward, v=radius * d, omega=1.0 / radius
            )
            parts.append((arc, float(radius * turn[i + 1])))
    return parts


def _check_radius(radius: float, turn: Array, lengths: Array) -> None:
    """Refuse a radius whose arcs do not fit on an edge."""
    if turn.max(initial=0.0) >= np.pi - SAME_DIRECTION:
        vertex = int(np.argmax(turn))
        raise JobError(
            f"the polyline turns straight back at vertex {vertex % len(lengths)} (counted from 0)",
            value=180.0,
            limit=180.0,
            remedy="no arc fits there: move the vertex, or set corner_radius = 0",
        )
    need = np.tan(0.5 * turn[:-1]) + np.tan(0.5 * turn[1:])
    used = np.flatnonzero(need > 0.0)
    if not used.size:
        return
    largest = lengths[used] / need[used]
    worst = int(np.argmin(largest))
    if radius > largest[worst] * (1.0 + 1e-12):
        edge = int(used[worst])
        raise JobError(
            f"corner_radius {radius:.9g} does not fit on the side from vertex {edge} to"
            f" {(edge + 1) % len(lengths) if turn[-1] else edge + 1} (counted from 0),"
            f" the largest possible is {largest[worst]:.9g}",
            value=radius,
            limit=float(largest[worst]),
            remedy="make corner_radius smaller or the side longer",
        )


def _joined(parts: list[Part], corner: npt.NDArray[np.bool_]) -> Curve:
    """The parts one after the other by fraction of the total length."""
    lengths = np.array([length for _, length in parts])
    ends = np.cumsum(lengths)
    total = float(ends[-1])
    starts = np.concatenate([[0.0], ends[:-1]]) / total
    scaled = [
        replace(part, slope=total * np.asarray(part.slope), omega=total * part.omega)
        for part, _ in parts
    ]
    curve = Curve(
        _table(scaled, starts).jet,
        (0.0, 1.0),
        tuple(starts[1:][~corner].tolist()),
        tuple(starts[1:][corner].tolist()),
    )
    return replace(curve, closed=ends_meet(curve))
