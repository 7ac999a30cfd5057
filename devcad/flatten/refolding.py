"""What comes off the brake against its pattern: the facets' lengths, the bend lines' folding."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from devcad.flatten.alignment import feet
from devcad.flatten.bending import BendLine, Rulings, Sheet
from devcad.flatten.brake import Zone
from devcad.geometry.chain import Chain
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array

LOOKS = 5
"""Rulings of a zone at which it is looked at."""


def refolded(
    full: Chain, zones: Sequence[Zone], smooth: Sheet, lines: Sequence[BendLine]
) -> tuple[float, float, float]:
    """How far the zones are from isometric to their pattern, relative; how far the pattern folded
    along its bend lines misses them, in mm; and the size of the part in mm.

    Distances between points of a facet, and on a cylinder their chords, are compared with those
    of the pattern, and the zones' edges there with the smooth pattern's. The folding reads the
    bend lines alone: a sharp bend turns what lies behind it; one with a radius moves the two
    planes apart too, to tangents of its circle.
    """
    flat = np.stack([_points(zone.flat) for zone in zones])  # (zones, looks, 3)
    space = np.stack([_points(patch) for patch in full.patches])
    size = float(np.linalg.norm(np.ptp(space.reshape(-1, 3), axis=0)))
    stretched = 0.0
    for zone, plane, points in zip(zones, flat, space, strict=True):
        if not zone.kept:
            away = _distances(points) - _expected(zone, plane)
            stretched = max(stretched, float(np.abs(away).max()) / float(_distances(plane).max()))
        if not zone.exact:
            stretched = max(stretched, _off_edge(zone, smooth, plane) / size)
    passed = _passed(zones, smooth, lines)
    first = next(k for k, zone in enumerate(zones) if _plain(zone))
    motion = _motion(flat[first], space[first])
    missed = 0.0
    curls = _curls(zones, full, smooth, lines)
    at = passed[first]
    for k in range(first, len(zones)):
        while at < passed[k]:
            motion = motion @ _fold(lines[at], curls[at])
            at += 1
        if _plain(zones[k]):
            moved = flat[k] @ motion[:3, :3].T + motion[:3, 3]
            missed = max(missed, float(np.linalg.norm(moved - space[k], axis=1).max()))
    return stretched, missed, size


def _plain(zone: Zone) -> bool:
    return zone.curl is None and not zone.kept


def _points(patch: Patch) -> Array:
    """Points on both edges of a patch, (2 LOOKS, 3)."""
    t = np.linspace(*patch.domain, LOOKS)
    t[0], t[-1] = np.nextafter(t[0], t[-1]), np.nextafter(t[-1], t[0])
    jet = patch.jet(t, 0)
    return np.concatenate([jet.rail(v)[0] for v in (jet.v_from, jet.v_to)])


def _distances(points: Array) -> Array:
    return np.asarray(np.linalg.norm(points[:, None] - points[None], axis=2))


def _expected(zone: Zone, plane: Array) -> Array:
    """The distances in space between points whose places in the pattern are given."""
    if zone.curl is None:
        return _distances(plane)
    curl = zone.curl
    along = (plane[:, None] - plane[None]) @ curl.axis
    across = np.sqrt(np.maximum(_distances(plane) ** 2 - along**2, 0.0))
    radius = (curl.width + curl.longer) / abs(curl.angle)
    chord = 2.0 * radius * np.sin(0.5 * across * abs(curl.angle) / curl.width)
    return np.asarray(np.hypot(along, chord))


def _off_edge(zone: Zone, smooth: Sheet, plane: Array) -> float:
    """How far the edges of a zone lie off the smooth pattern's, mm."""
    number, low, high = zone.home
    near = Rulings(np.full(len(plane), number), np.tile(np.linspace(low, high, LOOKS), 2))
    found = feet(smooth.flat, plane, near)

    def ends(patch: int, t: Array) -> Array:
        jet = smooth.flat.patches[patch].jet(t, 0)
        return np.stack([jet.rail(v)[0] for v in (jet.v_from, jet.v_to)], axis=1)

    rails = found.of(ends)
    here = np.concatenate([rails[:LOOKS, 0], rails[LOOKS:, 1]])
    return float(np.linalg.norm(here - plane, axis=1).max())


def _passed(zones: Sequence[Zone], smooth: Sheet, lines: Sequence[BendLine]) -> list[int]:
    """How many of the bend lines lie before the middle of each zone."""
    number = np.array([zone.home[0] for zone in zones])
    middle = np.array([0.5 * (zone.home[1] + zone.home[2]) for zone in zones])
    along = smooth.along(Rulings(number, middle)).sum(axis=1)
    return [int(k) for k in np.searchsorted([sum(line.datum) for line in lines], along)]


def _motion(flat: Array, space: Array) -> Array:
    """The rigid motion (4, 4) that carries points of the plane to their places in space."""
    a, b = flat - flat.mean(axis=0), space - space.mean(axis=0)
    u, _, v = np.linalg.svd(b.T @ a)
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
    out = np.eye(4)
    out[:3, :3] = turn
    out[:3, 3] = space.mean(axis=0) - turn @ flat.mean(axis=0)
    return out


def _curls(
    zones: Sequence[Zone], full: Chain, smooth: Sheet, lines: Sequence[BendLine]
) -> list[tuple[float, float]]:
    """The width in the pattern and the middle's length across each bend line, 0 of a sharp one."""
    out = [(0.0, 0.0)] * len(lines)
    along = np.array([sum(line.datum) for line in lines])
    for zone, patch in zip(zones, full.patches, strict=True):
        if _plain(zone):
            continue
        here = Rulings(np.array([zone.home[0]]), np.array([0.5 * (zone.home[1] + zone.home[2])]))
        k = int(np.argmin(np.abs(along - smooth.along(here)[0].sum())))
        flat = zone.flat.frame([0.5 * (zone.flat.domain[0] + zone.flat.domain[1])])
        ends = zone.flat.jet(zone.flat.domain, 0).c0[0]
        width = float((ends[1] - ends[0]) @ flat.m[0])
        if zone.curl is not None:
            length = width * (1.0 + zone.curl.longer / zone.curl.width)
        else:
            frame = patch.frame([0.5 * (patch.domain[0] + patch.domain[1])])
            length = abs(float(frame.q[0] / frame.c[0]) * lines[k].line.angle)
        out[k] = out[k][0] + width, out[k][1] + length
    return out


def _fold(bend: BendLine, curl: tuple[float, float]) -> Array:
    """The motion (4, 4) of what lies behind a bend line, in the plane before it."""
    line, (width, length) = bend.line, curl
    e = np.append(line.end - line.start, 0.0)
    e /= np.linalg.norm(e)
    m, n = np.array([-e[1], e[0], 0.0]), np.array([0.0, 0.0, 1.0])
    cos, sin = np.cos(line.angle), np.sin(line.angle)
    turn = np.outer(e, e) + np.outer(cos * m + sin * n, m) + np.outer(cos * n - sin * m, n)
    apart = length / line.angle * np.tan(0.5 * line.angle) - 0.5 * width
    point = np.append(line.start, 0.0)
    out = np.eye(4)
    out[:3, :3] = turn
    out[:3, 3] = point + turn @ (apart * m - point) + apart * m
    return out
