"""The layers of a thick sheet: where the surface at a distance along the normal ends."""

from __future__ import annotations

import numpy as np

from devcad.geometry.chain import Chain, Joint
from devcad.geometry.classify import EXACT
from devcad.geometry.patch import Frame
from devcad.geometry.taylor import Array


def layer_ends(chain: Chain, number: int, frame: Frame, distance: float) -> tuple[Array, Array]:
    """The two rails, each (n, 3), of patch ``number`` on the layer at ``distance`` along n.

    ``frame`` is the patch's frame at increasing parameters, its first and last rulings being
    the patch's own. Walls stand normal to the sheet: a rail is moved by distance * n, except

    - at an apex (q + v a = 0 at an end), where the layer ends by itself at q + v a = distance c;
    - on a creased joint of a thick sheet, where both sides meet on the mitre: moved by
      distance * (n1 + n2) / (1 + n1.n2), at right angles to the ruling.
    """
    offset = distance * frame.n
    if distance:
        for row, joint in zip((0, -1), _joints_of(chain, number), strict=True):
            if joint is not None and not joint.smooth:
                offset[row] = distance * _mitre(frame, row, joint)
    return _rail(frame, frame.v_from, offset, distance), _rail(frame, frame.v_to, offset, distance)


def at_apex(frame: Frame, v: Array) -> bool:
    """Whether every ruling of the frame becomes singular at v: the extent ends at an apex."""
    scale = np.abs(frame.q) + np.abs(frame.a) * np.maximum(np.abs(frame.v_from), np.abs(frame.v_to))
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


def _mitre(frame: Frame, row: int, joint: Joint) -> Array:
    """(n1 + n2) / (1 + n1.n2) from one side: n turned half the crease towards the other side."""
    half = 0.5 * joint.angle if row == -1 else -0.5 * joint.angle
    # turning about e carries m towards n, hence n towards -m
    return np.asarray(frame.n[row] - np.tan(half) * frame.m[row])
