"""Creases made bends: circular cylinders between the faces of a chain, with an inside radius.

A crease by theta between two planes becomes a cylinder that touches both at the setback
R tan(theta / 2) from the crease, R its radius on the surface that the chain describes. The
planes stay where they are. Source: fabrication.md, 4 (OSSB = (Ri + T) tan(theta / 2)).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry import taylor
from devcad.geometry.chain import Chain, Joint, link, with_gap
from devcad.geometry.classify import classify
from devcad.geometry.creases import Bend, bend_at, near
from devcad.geometry.drawing import Drawing
from devcad.geometry.facets import SIDES, Line, Span, border, is_point, left_of, room, trimmed
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array

SHORTEST = 0.01
"""A bend of fewer mm is none: the crease stays. CAD systems take such faces for edges."""


@dataclass(frozen=True, slots=True)
class Corner:
    """A point of a rail from which creases fan out, so that their bends part further in.

    ``tips`` are its places (patch, along, across) as the flats beside the bends see it: along e
    and m of the patch's first ruling from its c0. ``ends`` are the places (patch, t, v) where the
    sheet ends instead. Both in the order of the chain; a tube's first patch may follow its last.
    """

    tips: tuple[tuple[int, float, float], ...]
    ends: tuple[tuple[int, float, float], ...]


Folded = tuple[Chain, tuple[Corner, ...]]
"""A chain with its bends, and the corners where it wants relief."""


@dataclass(frozen=True, slots=True)
class _Flat:
    """Plane faces that continue each other about one point of a rail, and where bends beside them
    leave the first of it, (3,)."""

    faces: tuple[int, ...]
    corner: Array


def bends_made(
    chain: Chain,
    inside: float,
    thickness: float,
    reference: str,
    *,
    gap: float,
    drawings: Sequence[Drawing],
) -> Folded:
    """The chain :func:`filleted` after its ``gap`` (mm, 0: none) was left out: at a seam that stays
    open the sheet is not bent.

    Raises:
        GeometryError: as there, and where ``drawings`` belong to the surface: a face that is
            ruled anew would lose them. JobError: as :func:`devcad.geometry.chain.with_gap`.
    """
    if drawings:
        raise GeometryError(
            "lines that belong to the surface are drawn on a sheet whose creases get a radius",
            remedy="leave inside_radius out",
        )
    return filleted(with_gap(chain, gap) if gap else chain, inside, thickness, reference)


def filleted(chain: Chain, inside: float, thickness: float, reference: str = "middle") -> Folded:
    """The chain with a bend of the radius ``inside`` in place of every crease.

    ``inside`` (mm) is that of the sheet's skin; the chain is the sheet's ``reference`` face. The
    faces keep their places and their parameter; a bend has the parameters of what it replaces,
    its angle linear in them, and so are its rails: they are straight in its pattern, whatever its
    neutral fibre. The bend of a tube's own crease comes last, the tube opens beside it. Where
    creases fan out from a point of a rail, the sheet ends where its bends part (``corners``).

    Creases that would give a bend of 0.01 mm or less stay.

    Raises:
        GeometryError: a bend needs more than a face has; a crease beside a face that is neither
            plane nor a cylinder along it.
    """
    joints = chain.around
    faces = [classify(patch).type for patch in chain.patches]
    lift = {"front": 0.5 * thickness, "back": -0.5 * thickness}.get(reference, 0.0)
    bends: dict[int, Bend] = {}
    for k, joint in enumerate(joints):
        if not joint.smooth and abs(joint.angle) * (inside + 0.5 * thickness) > SHORTEST:
            radius = inside + 0.5 * thickness - np.sign(joint.angle) * lift
            other = (k + 1) % len(faces)
            pair = chain.patches[k], chain.patches[other]
            bends[k] = bend_at(pair, (faces[k], faces[other]), joint, float(radius))
    sheet = _Sheet(chain, joints, faces, bends)
    flats = [sheet.flats(side) for side in (0, 1)]
    corners = [{k: flat.corner for flat in found for k in flat.faces} for found in flats]
    left = [sheet.face(k, [of.get(k) for of in corners]) for k in range(len(faces))]
    patches: list[Patch] = []
    places: list[int] = []
    for k, face in enumerate(left):
        places.append(len(patches))
        patches.append(face)
        if k in bends:
            after = left[(k + 1) % len(left)]
            domain = _length_of(chain, k, face, after)
            patches.append(_cylinder(face, after, bends[k], domain, inside))
    made = link(tuple(patches), base_closed=chain.closes is not None, tolerance=np.inf)
    if not chain.closed:
        made = replace(chain, patches=made.patches, joints=made.joints)
    fans = [fan for side in (0, 1) for fan in _fans(sheet, side, flats[side], left)]
    return made, tuple(_renumbered(fan, places) for fan in fans)


@dataclass(frozen=True, slots=True)
class _Sheet:
    """A chain with what its faces are and the bends that replace its joints, by their number."""

    chain: Chain
    joints: tuple[Joint, ...]
    faces: list[str]
    bends: dict[int, Bend]

    def before(self, k: int) -> int | None:
        """The joint before face k, None at a free end."""
        return k - 1 if k else len(self.faces) - 1 if self.chain.closed else None

    def after(self, k: int) -> int | None:
        """The joint after face k, None at a free end."""
        return k if k < len(self.joints) else None

    def lines(self, first: int, last: int) -> tuple[Line, Line]:
        """The lines at both ends of a flat that consists of the faces from first to last."""
        patches = self.chain.patches
        bends = self.bend_before(first), self.bend_after(last)
        setbacks = [bend.setback[1 - k] if bend else 0.0 for k, bend in enumerate(bends)]
        return border(patches[first], 0, setbacks[0]), border(patches[last], 1, setbacks[1])

    def bend_before(self, k: int) -> Bend | None:
        """The bend in place of the joint before face k."""
        joint = self.before(k)
        return None if joint is None else self.bends.get(joint)

    def bend_after(self, k: int) -> Bend | None:
        """The bend in place of the joint after face k."""
        joint = self.after(k)
        return None if joint is None else self.bends.get(joint)

    def flats(self, side: int) -> list[_Flat]:
        """The flats that begin in a point of the rail, where bends leave nothing of it."""
        out: list[_Flat] = []
        seen: set[int] = set()
        for k, face in enumerate(self.faces):
            bent = self.bend_before(k) or self.bend_after(k)
            if k in seen or not bent or face != "plane":
                continue
            if not is_point(self.chain.patches[k], side):
                continue
            faces = self._flat_of(k, side)
            seen.update(faces)
            lines = self.lines(faces[0], faces[-1])
            out.append(_Flat(faces, lines[0].meets(lines[1])))
        return out

    def _flat_of(self, k: int, side: int) -> tuple[int, ...]:
        """The faces that lie in one plane with face k, about one point of the rail."""
        out = [k]
        while (joint := self.before(out[0])) is not None and joint not in self.bends:
            out.insert(0, self._about_point(joint, joint, side))
        while (joint := self.after(out[-1])) is not None and joint not in self.bends:
            out.append(self._about_point(joint, (joint + 1) % len(self.faces), side))
        return tuple(out)

    def _about_point(self, joint: int, k: int, side: int) -> int:
        """Face k beyond a joint, where it goes on smoothly and the rail is a point."""
        smooth = self.joints[joint].smooth
        patch = self.chain.patches[k]
        if not smooth or self.faces[k] != "plane" or not is_point(patch, side):
            raise GeometryError(
                f"a crease ends in the point of the {SIDES[side]} where the face at "
                f"t = {patch.domain[0]:.6g} to {patch.domain[1]:.6g} goes on without a bend: the "
                "bend would run into that face",
                remedy="open or round the sheet elsewhere, or leave inside_radius out",
            )
        return k

    def spans(self, k: int, corners: Sequence[Array | None]) -> tuple[Span | None, Span | None]:
        """What the bends leave of the rails of plane face k, None where they end in a corner."""
        patch, lines = self.chain.patches[k], self.lines(k, k)
        out: list[Span | None] = []
        for side in (0, 1):
            span = None if corners[side] is not None else left_of(patch, side, lines)
            if span is None and (corners[side] is None or None in out):
                needed, there = room(patch, side, lines)
                raise GeometryError(
                    f"the bends beside the face at t = {patch.domain[0]:.6g} to "
                    f"{patch.domain[1]:.6g} need {needed:.6g} mm of its {SIDES[side]}, which has "
                    f"{there:.6g} mm",
                    value=needed,
                    limit=there,
                    remedy="give a smaller inside_radius or a wider face",
                )
            out.append(span)
        return out[0], out[1]

    def face(self, k: int, corners: Sequence[Array | None]) -> Patch:
        """What the bends leave of face k; ``corners`` are where its flat ends on either side."""
        patch, bends = self.chain.patches[k], (self.bend_before(k), self.bend_after(k))
        known = [corner for corner in corners if corner is not None]
        if not any(bends) and not known:
            return patch
        if self.faces[k] == "plane":
            return trimmed(patch, self.spans(k, corners), known[0] if known else None)
        reach = [bend.t[1 - end] if bend else None for end, bend in enumerate(bends)]
        low, high = (patch.domain[end] if t is None else t for end, t in enumerate(reach))
        if low >= high:
            raise GeometryError(
                f"the bends beside the face at t = {patch.domain[0]:.6g} to "
                f"{patch.domain[1]:.6g} need more than it has: they meet at t = {high:.6g}",
                value=low,
                limit=high,
                remedy="give a smaller inside_radius or a wider face",
            )
        return patch.restricted(low, high)


def _fans(sheet: _Sheet, side: int, flats: list[_Flat], made: list[Patch]) -> list[Corner]:
    """The points of a rail from which creases fan out: one for each run of flats that end there,
    with the faces on both sides of it. A tip all round a tube is none: it has no rail."""
    count = len(sheet.faces)
    by_first = {flat.faces[0]: flat for flat in flats if sheet.bend_before(flat.faces[0])}
    following = {flat.faces[0]: by_first.get((flat.faces[-1] + 1) % count) for flat in flats}
    followers = {flat.faces[0] for flat in following.values() if flat}
    out = []
    for flat in flats:
        if flat.faces[0] in followers:
            continue
        run = [flat]
        while (later := following[run[-1].faces[0]]) is not None:
            run.append(later)
        sides: list[tuple[int, int]] = [(flat.faces[0], 0) for flat in run]
        if sheet.bend_before(run[0].faces[0]):
            sides.insert(0, ((run[0].faces[0] - 1) % count, 1))
        if sheet.bend_after(run[-1].faces[-1]):
            sides.append(((run[-1].faces[-1] + 1) % count, 0))
        point = _rail_end(sheet.chain.patches[run[0].faces[0]], side, 0)[1]
        tips = tuple((k, *_seen(made[k], point)) for k, _ in sides if sheet.faces[k] == "plane")
        ends = tuple((k, made[k].domain[end], _rail_end(made[k], side, end)[0]) for k, end in sides)
        out.append(Corner(tips, ends))
    return out


def _rail_end(patch: Patch, side: int, end: int) -> tuple[float, Array]:
    """v and the point (3,) where a rail begins (0) or ends (1)."""
    jet = patch.jet([patch.domain[end]], 0)
    v = jet.v_to if side else jet.v_from
    return float(v[0, 0]), jet.rail(v)[0, 0]


def _seen(patch: Patch, point: Array) -> tuple[float, float]:
    """A point of a plane face's plane along e and m of its first ruling, from its c0."""
    frame = patch.frame([near(patch, 0)])
    away = point - frame.c0[0]
    return float(away @ frame.e[0]), float(away @ frame.m[0])


def _length_of(chain: Chain, joint: int, before: Patch, after: Patch) -> tuple[float, float]:
    """The parameters that a bend takes over from what was cut off at its joint."""
    low = before.domain[1]
    ends = chain.patches[joint].domain[1], chain.patches[(joint + 1) % len(chain.patches)].domain[0]
    high = after.domain[0] if ends[0] == ends[1] else ends[0] + (after.domain[0] - ends[1])
    return low, high


def _cylinder(
    before: Patch, after: Patch, bend: Bend, domain: tuple[float, float], inside: float
) -> Patch:
    """The bend between two faces: from either end on, so that it meets both exactly."""
    ends = before.jet([before.domain[1]], 0), after.jet([after.domain[0]], 0)
    frames = before.frame([near(before, 1)]), after.frame([near(after, 0)])
    c0 = [jet.c0[0, 0] for jet in ends]
    e = [jet.e[0, 0] for jet in ends]
    v = [(float(jet.v_from[0, 0]), float(jet.v_to[0, 0])) for jet in ends]
    drift = float((c0[1] - c0[0]) @ e[0])
    angle, height = abs(bend.angle), float(np.sign(bend.angle)) * bend.radius
    low, high = domain

    def half(share: Array, end: int) -> RulingJet:
        """Seen from one end, ``share`` counted from there: 0 is the end itself."""
        m, n = frames[end].m[0], frames[end].n[0]
        sign = -1.0 if end else 1.0
        sin, cos = taylor.sin_cos(angle * share)
        rise = -cos
        rise[0] += 1.0
        along = taylor.constant_vector(e[end], len(share) - 1, share.shape[1])
        points = (
            sign * bend.radius * sin[..., None] * m
            + height * rise[..., None] * n
            + sign * drift * share[..., None] * e[end]
        )
        points[0] += c0[end]
        rails = [(v[1 - end][k] - v[end][k]) * share for k in (0, 1)]
        for k in (0, 1):
            rails[k][0] += v[end][k]
        return RulingJet(points, along, rails[0], rails[1])

    def field(t: Array, order: int) -> RulingJet:
        share = taylor.variable(t, order) / (high - low)
        early = t - low <= high - t
        share[0] = (t - low) / (high - low)
        rest = -share
        rest[0] = (high - t) / (high - low)
        one, other = half(share, 0), half(rest, 1)
        return RulingJet(
            np.where(early[None, :, None], one.c0, other.c0),
            np.where(early[None, :, None], one.e, other.e),
            np.where(early, one.v_from, other.v_from),
            np.where(early, one.v_to, other.v_to),
        )

    return Patch(field, domain, inside_radius=inside)


def _renumbered(corner: Corner, places: list[int]) -> Corner:
    """The corner with the numbers of the patches among the bends."""
    return Corner(
        tuple((places[k], along, across) for k, along, across in corner.tips),
        tuple((places[k], t, v) for k, t, v in corner.ends),
    )
