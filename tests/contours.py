"""Cuts written down by hand: smooth tracks and polygons on patches, the sheet on their left."""

from __future__ import annotations

import itertools

import numpy as np

from devcad.geometry import chebyshev
from devcad.geometry.chain import Chain
from devcad.geometry.cuts import Cut, Track


def track(path, start: float, end: float, patch: int = 0) -> Track:
    """The line u -> (t, v)."""
    series = chebyshev.resolve(lambda u: np.column_stack(path(u)), np.array([start, end]))
    return Track(patch, series)


def ellipse(t: float, v: float, rt: float, rv: float, patch: int = 0) -> Cut:
    """A hole, clockwise on the front: in the plane (v, t) the ruling is +x, t grows upwards."""

    def path(u):
        return t + rt * np.cos(u), v + rv * np.sin(u)

    return Cut("ellipse", (track(path, 0.0, 2.0 * np.pi, patch),), True)


def polygon(chain: Chain, *corners: tuple[float, float], closed: bool = True) -> Cut:
    """Straight lines between places (x, v), x = the patch's number + the share of its domain;
    past the last patch a tube begins anew. Cut where they cross from patch to patch."""
    ends = [*corners, corners[0]] if closed else list(corners)
    tracks = []
    for (x0, v0), (x1, v1) in itertools.pairwise(ends):
        low, high = min(x0, x1), max(x0, x1)
        joints = [x for x in range(int(np.ceil(low)), int(np.floor(high)) + 1) if low < x < high]
        shares = [0.0, *sorted((x - x0) / (x1 - x0) for x in joints), 1.0]
        for a, b in itertools.pairwise(shares):
            place = int(np.floor(x0 + (x1 - x0) * 0.5 * (a + b)))
            number = place % len(chain.patches)
            start, end = chain.patches[number].domain
            share = np.clip(np.array([x0 + (x1 - x0) * s for s in (a, b)]) - place, 0.0, 1.0)
            share = np.where(np.abs(share - np.round(share)) < 1e-12, np.round(share), share)
            t = np.where(share == 1.0, end, start + (end - start) * share)
            v = np.array([v0 + (v1 - v0) * s for s in (a, b)])
            line = track(
                lambda u, t=t, v=v: (t[0] + (t[1] - t[0]) * u, v[0] + (v[1] - v[0]) * u),
                0.0,
                1.0,
                number,
            )
            tracks.append(line)
    return Cut("polygon", tuple(tracks), closed)


def over_joint(
    before: int, after: int, ends: tuple[float, float], radii: tuple[float, float], v: float, rv
) -> Cut:
    """A hole whose middle lies on the ruling t = ends[0] of a patch and ends[1] of the next."""

    def late(u):
        return ends[0] - radii[0] * np.sin(u), v + rv * np.cos(u)

    def early(u):
        return ends[1] + radii[1] * np.sin(u), v - rv * np.cos(u)

    tracks = (track(late, 0.0, np.pi, before), track(early, 0.0, np.pi, after))
    return Cut("over", tracks, True)
