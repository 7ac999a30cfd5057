"""What comes off the press brake: the blank folded along its bend lines, isometric to it.

The blank is divided into zones: plane facets, which a fold on their first ruling may turn against
the zone before; strips that are bent about their bend line to a cylinder; and patches that are
bends already. A walk from the first ruling on carries every zone to its place in space.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from devcad.flatten.bending import Bend, Sheet
from devcad.geometry import taylor
from devcad.geometry.chain import Chain, link
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array

CLOSED = 1e-8
"""Of its size: a tube whose ends are further apart is open. Kernels take no wider gap for none."""


@dataclass(frozen=True, slots=True)
class Curl:
    """How a strip is bent: by ``angle`` in radians over its ``width`` in mm, positive towards the
    front, about the direction ``axis`` (3,) of the bend line; ``begin`` (3,) is a point of the
    strip's first border. The middle of the sheet is ``longer`` than its pattern by so many mm;
    ``inside`` is the inside radius."""

    angle: float
    width: float
    axis: Array
    begin: Array
    longer: float
    inside: float


@dataclass(frozen=True, slots=True)
class Zone:
    """A zone of the blank: its plane patch ``flat``; the angle of the ``crease`` on its first
    ruling in radians; what bends it; and ``home``, the smooth patch that it is of, with the
    parameters near its first and last rulings. ``kept`` patches are bends already. A zone is
    ``exact`` where its rulings are those of the smooth patch, t and v alike."""

    flat: Patch
    home: tuple[int, float, float]
    crease: float = 0.0
    curl: Curl | None = None
    kept: bool = False
    exact: bool = True


def facets(smooth: Sheet, made: Sequence[Bend]) -> list[Zone]:
    """The zones between sharp bends."""
    out: list[Zone] = []
    for number, patch in enumerate(smooth.flat.patches):
        joint = smooth.middle.joints[number - 1] if number else None
        crease = joint.angle if joint is not None and not joint.smooth else 0.0
        here = [bend for bend in made if bend.patch == number]
        low, high = patch.domain
        inner = [bend for bend in here if low < bend.t < high]
        crease += sum(bend.angle for bend in here if bend.t <= low)
        ends = [low, *(bend.t for bend in inner), high]
        turns = [crease, *(bend.angle for bend in inner)]
        kept = smooth.middle.patches[number].inside_radius is not None
        for (a, b), turn in zip(pairwise(ends), turns, strict=True):
            out.append(Zone(patch.restricted(a, b), (number, a, b), turn, kept=kept))
    return out


def folded(
    zones: Sequence[Zone],
    smooth: Chain,
    start: Array,
    bend: float,
    *,
    tolerance: float,
) -> Chain:
    """The blank folded along its zones: the middle of the part in space, every angle ``bend`` times
    what it is in the end.

    Args:
        smooth: the smooth part, bent as far; of it the kept patches are taken.
        start: the motion (4, 4) of the pattern's plane with which the walk begins.
        tolerance: in mm; a tube stays one where its last ruling meets the first within a
            hundredth of it, and within 1e-8 of the part's size.
    """
    motion, patches = start, []
    for zone in zones:
        if zone.crease:
            motion = motion @ _turn(zone.flat, bend * zone.crease)
        if zone.kept:
            patch, motion = _carried(smooth.patches[zone.home[0]], zone.flat, motion)
            patches.append(patch)
        elif zone.curl is not None and bend:
            patches.append(_curled(zone.flat, zone.curl, motion, bend))
            motion = motion @ _end(zone.curl, bend)
        else:
            patches.append(zone.flat.transformed(motion))
    corners = np.concatenate([patch.jet(patch.domain, 0).c0[0] for patch in patches])
    near = CLOSED * float(np.linalg.norm(np.ptp(corners, axis=0)))
    chain = link(tuple(patches), base_closed=False, tolerance=min(tolerance, 100.0 * near))
    return chain if smooth.closed else replace(chain, closing=None, closes=None)


def pattern_motion(flat: Patch, patch: Patch) -> Array:
    """The motion (4, 4) that carries the plane of a pattern to the tangent plane of a patch at
    its first ruling."""
    return _placed(patch, 0) @ np.linalg.inv(_placed(flat, 0))


def _placed(patch: Patch, end: int) -> Array:
    """The frame at the first (0) or last (1) ruling as a motion, (4, 4)."""
    low, high = patch.domain
    at = np.nextafter(high, low) if end else np.nextafter(low, high)
    frame = patch.frame([at])
    origin = patch.jet([patch.domain[end]], 0).c0[0, 0]
    out = np.eye(4)
    out[:3] = np.column_stack([frame.e[0], frame.m[0], frame.n[0], origin])
    return out


def _turn(patch: Patch, angle: float) -> Array:
    """The rotation by ``angle`` about the first ruling of a plane patch, (4, 4)."""
    jet = patch.jet([patch.domain[0]], 0)
    return rotation(jet.e[0, 0], jet.c0[0, 0], angle)


def rotation(axis: Array, point: Array, angle: float) -> Array:
    """The rotation by ``angle`` about an axis (3,), unit, through a point (3,), (4, 4)."""
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    out = np.eye(4)
    out[:3, :3] += np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    out[:3, 3] = point - out[:3, :3] @ point
    return out


def _carried(patch: Patch, flat: Patch, motion: Array) -> tuple[Patch, Array]:
    """A bend that is made already, moved to where the walk has come, and the motion behind it."""
    rigid = motion @ _placed(flat, 0) @ np.linalg.inv(_placed(patch, 0))
    moved = patch.transformed(rigid)
    return moved, _placed(moved, 1) @ np.linalg.inv(_placed(flat, 1))


def _radius(curl: Curl, bend: float) -> float:
    """The radius of the middle of a strip that is bent so far, negative towards the back."""
    return float((curl.width + bend * curl.longer) / (bend * curl.angle))


def _end(curl: Curl, bend: float) -> Array:
    """The motion (4, 4) of the plane behind a strip, in the plane before it."""
    across = np.cross([0.0, 0.0, 1.0], curl.axis)
    radius, angle = _radius(curl, bend), bend * curl.angle
    end = curl.begin + radius * (
        np.sin(angle) * across + (1.0 - np.cos(angle)) * np.array([0.0, 0.0, 1.0])
    )
    out = rotation(curl.axis, curl.begin + curl.width * across, angle)
    out[:3, 3] += end - curl.begin - curl.width * across
    return out


def _curled(flat: Patch, curl: Curl, motion: Array, bend: float) -> Patch:
    """A strip bent about its bend line: its plane patch, whose rulings run along that line, on the
    cylinder."""
    across = np.cross([0.0, 0.0, 1.0], curl.axis)
    radius, rate = _radius(curl, bend), bend * curl.angle / curl.width

    def field(t: Array, order: int) -> RulingJet:
        jet = flat.field(t, order)
        away = jet.c0.copy()
        away[0] -= curl.begin
        sin, cos = taylor.sin_cos(rate * (away @ across))
        rise = -radius * cos
        rise[0] += radius
        along = away @ curl.axis
        c0 = along[..., None] * curl.axis + (radius * sin)[..., None] * across
        c0[..., 2] += rise
        c0[0] += curl.begin
        return replace(jet, c0=c0)

    return replace(flat, field=field, inside_radius=curl.inside).transformed(motion)
