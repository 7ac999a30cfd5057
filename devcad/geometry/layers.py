"""The layers of a thick sheet: where the surface at a distance along the normal ends."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from devcad.geometry.chain import Chain, Joint
from devcad.geometry.classify import EXACT
from devcad.geometry.patch import Frame, Patch
from devcad.geometry.taylor import Array

if TYPE_CHECKING:  # only thick sheets with creases ask for it
    from devcad.geometry.pull import Pull

BAND, POWER = 8.0, 6.0
"""The reach of a mitre's pull on the points beside it, in its own shift, and how it fades: the
power over the reach is the pull's slope, and a slope of 1 would fold the layer over."""


def layer_ends(chain: Chain, number: int, frame: Frame, distance: float) -> tuple[Array, Array]:
    """The two rails, each (n, 3), of patch ``number`` on the layer at ``distance`` along n.

    ``frame`` is the patch's frame at increasing parameters, its first and last rulings being
    the patch's own. Walls stand normal to the sheet: a rail is moved by distance * n, except

    - at an apex (q + v a = 0 at an end), where the layer ends by itself at q + v a = distance c;
    - on a creased joint of a thick sheet, where both sides meet on the mitre: moved by
      distance * (n1 + n2) / (1 + n1.n2), at right angles to the ruling; between two creases by
      what :class:`devcad.geometry.pull.Pull` says.
    """
    offset = distance * frame.n
    low = high = offset
    joints = _joints_of(chain, number)
    if distance and _creased(joints):
        pull = pull_of(chain, number, distance)
        if pull is not None or len(frame.t) > 2:
            pull = pull or _straight_pull(chain, number)
            shifts = distance * pull.rails(frame.t)
            low, high = offset + shifts[:, 0], offset + shifts[:, 1]
        for row, joint in zip((0, -1), joints, strict=True):
            low[row] = high[row] = distance * mitre(frame, row, joint)
    return _rail(frame, frame.v_from, low, distance), _rail(frame, frame.v_to, high, distance)


def layer_points(chain: Chain, number: int, t: Array, v: Array, distance: float) -> Array:
    """Where the points (t, v) of patch ``number``, each (n,), lie on the layer at ``distance``
    along n, (n, 3).

    Moved along n, so that the walls of a hole stand normal to the sheet. Near a mitred crease,
    where the layers are wider or narrower than the middle, they are drawn along with it: by the
    mitre's own shift at the crease, by (1 - x / w)^6 of it at the distance x < w, w = 8 times the
    shift (less, and a lower power, where the next crease is nearer). The shift depends on x alone
    and is odd in the distance, so that what lies between two layers is area x thickness still;
    both sides of a crease agree to rounding; and a spline of degree 5 follows it in few spans.
    Facets with curved edges have one pull for edges and cuts (:class:`devcad.geometry.pull.Pull`).
    """
    patch = chain.patches[number]
    frame = patch.frame(t)
    points = frame.c0 + v[:, None] * frame.e
    out = points + distance * frame.n
    joints = _joints_of(chain, number)
    if not distance or not _creased(joints):
        return np.asarray(out)
    pull = pull_of(chain, number, distance)
    if pull is not None:
        return np.asarray(out + distance * pull(t, v))
    ends = _end_frames(patch)
    rails = [ends.c0 + x[:, None] * ends.e for x in (ends.v_from, ends.v_to)]
    for row, joint in enumerate(joints):
        if joint is None or joint.smooth:
            continue
        shift = distance * (mitre(ends, row, joint) - ends.n[row])
        size = float(np.linalg.norm(shift))
        next_one = [abs(float((rail[1 - row] - ends.c0[row]) @ ends.m[row])) for rail in rails]
        # towards a corner where the rulings meet there is no room for all of it
        room = [x for x in next_one if x > 2.0 * size] or [max(next_one)]
        reach = min(BAND * size, *room)
        power = min(max(0.75 * reach / size, 1.0), POWER)
        away = np.abs((points - ends.c0[row]) @ ends.m[row])
        out += (np.maximum(1.0 - away / reach, 0.0) ** power)[:, None] * shift
    return np.asarray(out)


def at_apex(frame: Frame, v: Array) -> bool:
    """Whether every ruling of the frame becomes singular at v: the extent ends at an apex."""
    scale = np.abs(frame.q) + np.abs(frame.a) * np.maximum(np.abs(frame.v_from), np.abs(frame.v_to))
    scale = np.maximum(scale, EXACT * scale.max())  # a tip at the apex has none of its own
    return bool((np.abs(frame.q + v * frame.a) <= EXACT * scale).all() and (scale > 0.0).all())


def _rail(frame: Frame, v: Array, offset: Array, distance: float) -> Array:
    if distance and at_apex(frame, v):
        v = v + distance * frame.c / frame.a
    return np.asarray(frame.c0 + v[:, None] * frame.e + offset)


def _joints_of(chain: Chain, number: int) -> tuple[Joint | None, Joint | None]:
    """The joints before and after a patch, None at a free end."""
    before = chain.joints[number - 1] if number else chain.closing
    last = number == len(chain.patches) - 1
    return before, chain.closing if last else chain.joints[number]


def mitre(frame: Frame, row: int, joint: Joint | None) -> Array:
    """Where the layer at distance 1 meets its neighbour's across a joint, (3,).

    (n1 + n2) / (1 + n1.n2), from one side: n turned by half the crease towards the other side.
    ``row`` is 0 for the joint before the frame and -1 (or 1 of two) for the one after; without
    a crease it is n.
    """
    if joint is None or joint.smooth:
        return np.asarray(frame.n[row])
    half = -0.5 * joint.angle if row == 0 else 0.5 * joint.angle
    # turning about e carries m towards n, hence n towards -m
    return np.asarray(frame.n[row] - np.tan(half) * frame.m[row])


def layer_gaps(chain: Chain, layers: tuple[float, ...]) -> list[float]:
    """How far the neighbours' layers are apart at the end of each patch that has a next one, mm:
    for every joint, and last for the closing of a tube."""
    ends = []
    for number, patch in enumerate(chain.patches):
        low, high = patch.domain
        frame = patch.frame([np.nextafter(low, high), np.nextafter(high, low)])
        ends.append(np.stack([layer_ends(chain, number, frame, d) for d in layers]))
    pairs = pairwise([*ends, ends[0]] if chain.closed else ends)
    return [float(np.linalg.norm(a[:, :, -1] - b[:, :, 0], axis=2).max()) for a, b in pairs]


def straight_sided(patch: Patch) -> bool:
    """Whether both rails are straight lines within 1e-9 of their length."""
    return all(straight_rails(patch))


def straight_rails(patch: Patch) -> tuple[bool, bool]:
    """Whether each rail is a straight line within 1e-9 of its length."""
    jet = patch.jet(np.linspace(*patch.domain, 9), 0)
    low, high = (_straight(jet.rail(v)[0]) for v in (jet.v_from, jet.v_to))
    return low, high


def _straight(rail: Array) -> bool:
    chord = rail[-1] - rail[0]
    away = np.linalg.norm(np.cross(rail - rail[0], chord), axis=1)
    return bool(away.max() <= EXACT * float(chord @ chord))


def pull_of(chain: Chain, number: int, distance: float) -> Pull | None:
    """How the layers at +-``distance`` of patch ``number`` are drawn to its mitres, None where it
    has none or only straight sides, which run from mitre to mitre."""
    joints = _joints_of(chain, number)
    patch = chain.patches[number]
    if not distance or not _creased(joints):
        return None
    straight = straight_rails(patch)
    if all(straight):
        return None
    from devcad.geometry.pull import pulled

    return pulled(patch, _shifts(patch, joints), straight, abs(distance))


def drawn(chain: Chain, distance: float) -> bool:
    """Whether the layers at +-``distance`` have curved edges that are drawn to mitres."""
    return any(pull_of(chain, k, distance) is not None for k in range(len(chain.patches)))


def layer_width(chain: Chain, number: int, distance: float) -> tuple[float, float, float]:
    """At the narrowest place of a patch beside creases, compared with what mitres take there off
    its layers at +-``distance``: its width, what is taken, in mm, and t; (inf, 0, t) without one.

    Taken is as much as the width, or more, where a layer is turned inside out.
    """
    joints = _joints_of(chain, number)
    if not distance or not _creased(joints):
        return np.inf, 0.0, float(chain.patches[number].domain[0])
    from devcad.geometry.pull import narrowest

    return narrowest(pull_of(chain, number, distance) or _straight_pull(chain, number), distance)


def _straight_pull(chain: Chain, number: int) -> Pull:
    from devcad.geometry.pull import even

    patch = chain.patches[number]
    return even(patch, _shifts(patch, _joints_of(chain, number)), (True, True))


def _shifts(patch: Patch, joints: tuple[Joint | None, Joint | None]) -> Array:
    """What the mitres at both ends add to n, (2, 3)."""
    ends = _end_frames(patch)
    return np.stack([mitre(ends, row, joints[row]) - ends.n[row] for row in (0, 1)])


def _end_frames(patch: Patch) -> Frame:
    low, high = patch.domain
    return patch.frame([np.nextafter(low, high), np.nextafter(high, low)])


def _creased(joints: tuple[Joint | None, Joint | None]) -> bool:
    return any(joint is not None and not joint.smooth for joint in joints)
