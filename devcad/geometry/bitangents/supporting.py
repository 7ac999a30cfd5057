"""Which bitangent planes support both curves: those that bound the convex hull.

The distances of all points from the plane of a pair, divided by the squares that vanish at the
two points of contact, must have one sign. Where that ends a third point touches the plane, or
the end of an open curve lies in it.
"""

from __future__ import annotations

import itertools

import numpy as np

from devcad.geometry import chebyshev, taylor
from devcad.geometry.bitangents.bitangent import Pairs
from devcad.geometry.bitangents.monotone import Piece
from devcad.geometry.bitangents.rails import Rail
from devcad.geometry.taylor import Array, rows_dot

POINTS = 768
"""Points of a curve looked at from each plane."""
PLANES = 129
"""Planes looked at on a piece."""
NARROWED = 24
"""Steps of the golden section search for narrow parts: to 1e-5 of the distance of planes."""
GOLDEN = 0.6180339887498949
CLOSEST = 1e-3
"""Share of a curve's domain next to a point of contact where its curvature answers instead."""
ROUGH = 1e-7
"""A distance below this share of the largest is none, until it is polished."""

FLAT = 1e-9
"""Distances from a plane below this share of the curve's size are rounding."""


def supported(pairs: Pairs, piece: Piece) -> list[tuple[float, float, float]]:
    """The parts (from, to, side) of a piece whose planes support both curves.

    side is +1 where all points lie on the side of a'(s) x e, else -1.
    """
    sigma = _looked_at(pairs, piece)
    side = _sides(pairs, piece, sigma)
    out = []
    start = 0
    for value, run in itertools.groupby(side.tolist()):
        stop = start + len(list(run))
        if value:
            low, high = piece.domain
            if start:
                low = _end(pairs, piece, sigma[start], sigma[start - 1], value)
            if stop < len(sigma):
                high = _end(pairs, piece, sigma[stop - 1], sigma[stop], value)
            out.append((low, high, value))
        start = stop
    return out


def _looked_at(pairs: Pairs, piece: Piece) -> Array:
    """Parameters between which the support changes at most once: evenly chosen ones, and where
    it is best or worst among its neighbours, so that no narrow part is missed."""
    sigma = chebyshev.nodes(*piece.domain, PLANES)[1:-1]
    low, high = _reach(pairs, piece, sigma)
    extremes = []
    for bound in (low, -high):  # supported where one of them is positive
        holds = bound >= -ROUGH
        for sign in (1.0, -1.0):
            value = sign * bound
            k = 1 + np.flatnonzero((value[1:-1] > value[:-2]) & (value[1:-1] >= value[2:]))
            k = k[~holds[k] if sign > 0.0 else holds[k]]
            a, b = sigma[k - 1], sigma[k + 1]
            for _ in range(NARROWED if len(k) else 0):
                c, d = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
                one, two = (sign * _bound(pairs, piece, x, bound is low) for x in (c, d))
                a, b = np.where(one < two, c, a), np.where(one < two, b, d)
            extremes.append(0.5 * (a + b))
    return np.unique(np.concatenate([sigma, *extremes]))


def _bound(pairs: Pairs, piece: Piece, sigma: Array, lowest: bool) -> Array:
    """The smallest distance from each plane, or the negative of the largest, (n,)."""
    low, high = _reach(pairs, piece, sigma)
    return low if lowest else -high


def _plane(pairs: Pairs, piece: Piece, sigma: Array, order: int) -> tuple[Array, ...]:
    """The series of s, t, of the point a(s) and of the normal a'(s) x e, made unit."""
    s, t = piece.at(sigma, order)
    c0, e, _ = piece.rulings(pairs, sigma, order)
    tangents = [pairs.first.along(s, 1)[1], pairs.second.along(t, 1)[1]]
    normals = [taylor.cross(x, e) for x in tangents]
    sizes = [
        np.linalg.norm(n[0], axis=1) / np.linalg.norm(x[0], axis=1)
        for n, x in zip(normals, tangents, strict=True)
    ]
    same = np.where(rows_dot(normals[0][0], normals[1][0]) < 0.0, -1.0, 1.0)
    better = (sizes[1] > sizes[0])[None, :, None]
    normal = np.where(better, normals[1] * same[None, :, None], normals[0])
    return s, t, c0, taylor.unit(normal)


def _sides(pairs: Pairs, piece: Piece, sigma: Array) -> Array:
    """+1 or -1 where the plane supports both curves on that side of its normal, else 0."""
    low, high = _reach(pairs, piece, sigma)
    return np.where(low >= -ROUGH, 1.0, np.where(high <= ROUGH, -1.0, 0.0))


def _reach(pairs: Pairs, piece: Piece, sigma: Array) -> tuple[Array, Array]:
    """The smallest and the largest distance of the curves' points from each plane, over the
    squares that vanish, as shares of the largest one's size."""
    s, t, c0, normal = (x[0] for x in _plane(pairs, piece, sigma, 0))
    low, high = np.full(len(sigma), np.inf), np.full(len(sigma), -np.inf)
    contacts = (
        [(pairs.first, (s, t))] if pairs.same else [(pairs.first, (s,)), (pairs.second, (t,))]
    )
    for rail, touching in contacts:
        values = _deflated(rail, touching, c0, normal)
        size = np.abs(values).max(axis=1, keepdims=True)
        # a curve that lies in the plane itself, to rounding, is on neither side
        values = values / np.where(size > FLAT * _curving(rail, len(touching)), size, np.inf)
        low, high = np.minimum(low, values.min(axis=1)), np.maximum(high, values.max(axis=1))
    return low, high


def _deflated(rail: Rail, contacts: tuple[Array, ...], c0: Array, normal: Array) -> Array:
    """Distances from each plane over the squares that vanish at its contacts, (n, points)."""
    offsets = np.linspace(0.0, 1.0, POINTS)
    span = rail.curve.domain[1] - rail.curve.domain[0]
    u = rail.curve.domain[0] + span * offsets
    points = rail.jet(u, 0)[0]
    distance = points @ normal.T - rows_dot(c0, normal)  # (points, n)
    inside = np.ones_like(distance, bool)
    for contact in contacts:
        gap = np.abs(_gap(rail, u[:, None], contact))
        inside &= gap > CLOSEST * span
        distance = distance / np.maximum(gap, CLOSEST * span) ** 2
    columns = [np.where(inside, distance, 0.0).T]
    for k, contact in enumerate(contacts):
        curved = rows_dot(rail.jet(contact, 2)[2], normal)
        for other in contacts[:k] + contacts[k + 1 :]:
            gap = np.abs(_gap(rail, contact, other))
            curved = curved / np.maximum(gap, 1e-9 * span) ** 2
        columns.append(curved[:, None])
    return np.hstack(columns)


def _curving(rail: Rail, contacts: int) -> float:
    """The size of a curve over the squares that its distances are divided by."""
    points = rail.curve.point(rail.places)
    span = rail.curve.domain[1] - rail.curve.domain[0]
    return float(np.linalg.norm(np.ptp(points, axis=0))) / span ** (2 * contacts)


def _gap(rail: Rail, u: Array, contact: Array) -> Array:
    """The distance of parameters; on a closed curve like the sine of half of it."""
    if not rail.period:
        return u - contact
    return np.sin(np.pi * (u - contact) / rail.period) * rail.period / np.pi


def _end(pairs: Pairs, piece: Piece, inside: float, outside: float, side: float) -> float:
    """Where the support ends between two parameters: bisected, then polished."""
    first, second = inside, outside
    for _ in range(40):
        middle = 0.5 * (inside + outside)
        holds = _sides(pairs, piece, np.array([middle]))[0] == side
        inside, outside = (middle, outside) if holds else (inside, middle)
    polished = _touched(pairs, piece, 0.5 * (inside + outside), side)
    low, high = min(first, second), max(first, second)
    return polished if polished is not None and low <= polished <= high else inside


def _touched(pairs: Pairs, piece: Piece, sigma: float, side: float) -> float | None:
    """The parameter near sigma whose plane a third point touches; None if Newton strays."""
    s, t, c0, normal = _plane(pairs, piece, np.array([sigma]), 0)
    best: tuple[float, Rail, float] | None = None
    contacts = (
        [(pairs.first, (s, t))] if pairs.same else [(pairs.first, (s,)), (pairs.second, (t,))]
    )
    for rail, touching in contacts:
        low, high = rail.curve.domain
        u = np.linspace(low, high, POINTS)
        distance = side * (rail.jet(u, 0)[0] - c0[0, 0]) @ normal[0, 0]
        for contact in touching:
            distance = distance / np.maximum(np.abs(_gap(rail, u, contact[0, 0])), 1e-9) ** 2
            distance[np.abs(_gap(rail, u, contact[0, 0])) < 5e-3 * (high - low)] = np.inf
        k = int(np.argmin(distance))
        if best is None or distance[k] < best[0]:
            best = float(distance[k]), rail, float(u[k])
    if best is None:
        return None
    _, rail, u0 = best
    at_end = not rail.period and u0 in rail.curve.domain
    x, y = sigma, u0
    for _ in range(20):
        _, _, point, n = _plane(pairs, piece, np.array([x]), 1)
        jet = rail.jet(np.array([y]), 2)
        way, slope = jet[0, 0] - point[0, 0], jet[1, 0]
        f = np.array([way @ n[0, 0], slope @ n[0, 0]])
        matrix = np.array(
            [
                [way @ n[1, 0] - point[1, 0] @ n[0, 0], f[1]],
                [slope @ n[1, 0], 2.0 * jet[2, 0] @ n[0, 0]],
            ]
        )
        if at_end:
            matrix[1], f[1] = (0.0, 1.0), 0.0
        try:
            step = -np.linalg.solve(matrix, f)
        except np.linalg.LinAlgError:
            return None
        x, y = float(np.clip(x + step[0], *piece.domain)), y + float(step[1])
        if abs(step[0]) <= 1e-15 * (piece.domain[1] - piece.domain[0]):
            break
    return x if abs(x - sigma) <= 1e-3 * (piece.domain[1] - piece.domain[0]) else None
