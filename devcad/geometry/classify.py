"""What a patch is: plane, cylinder, cone or tangent surface, with the exact numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from devcad.geometry import chebyshev
from devcad.geometry.deflation import vanishing
from devcad.geometry.patch import Frame, Patch
from devcad.geometry.taylor import Array, rows_dot


@dataclass(frozen=True, slots=True)
class Shape:
    """``type`` is plane, cylinder, cone or tangent.

    plane: ``point`` and ``axis`` = its normal n. cylinder: ``axis`` = the ruling direction;
    ``radius`` and ``point`` on the axis where it is a circular one, else None.
    cone: ``point`` = the apex, ``axis`` (pointing from the apex into the patch) and
    ``half_angle`` (radians, 0 to pi/2) where it is a right circular one, else None.
    """

    type: str
    point: Array | None = None
    axis: Array | None = None
    radius: float | None = None
    half_angle: float | None = None

    @property
    def analytic(self) -> bool:
        """Whether CAD has this surface as a primitive: plane, circular cylinder or cone."""
        return self.type == "plane" or self.radius is not None or self.half_angle is not None


EXACT = 1e-9
"""A patch is what it can be moved onto with no point moving more than this share of its size."""


ASIDE = 1e-6
"""Share of the domain by which samples keep away from an end whose ruling is singular."""


def classify(patch: Patch) -> Shape:
    """What the patch is, decided by how far its points would have to move, with the numbers.

    Sampled at 33 parameters of every panel, its ends included. The plane is tried
    first, then the cylinder, then the cone; what is none of them is a tangent surface.
    Source: geometry.md, 0.3; axis and radius from the frame: the frame turns about a n + c e.
    """
    frame = patch.frame(sample_parameters(patch, 33))
    size = patch_size(frame)
    return (
        _as_plane(frame, size)
        or _as_cylinder(frame, size)
        or _as_cone(frame, size)
        or Shape("tangent")
    )


@lru_cache(maxsize=32)  # every check of a patch asks anew
def panels(patch: Patch) -> tuple[float, ...]:
    """Parameters, breaks among them, between which polynomials resolve the patch's rails.

    A base curve or an extent that waves many times between two breaks has as many panels more:
    samples taken on each panel miss none of its waves.
    """

    def rails(t: Array) -> Array:
        jet = patch.jet(t, 0)
        return np.column_stack([jet.rail(jet.v_from)[0], jet.rail(jet.v_to)[0]])

    ends = rails(np.linspace(*patch.domain, 9)[1:-1])
    size = float(np.abs(ends - ends.mean(axis=0)).max())
    # a millionth of the size is enough to see a wave
    return tuple(chebyshev.resolve(rails, patch.segments, scale=1e6 * size).knots.tolist())


def sample_parameters(patch: Patch, per_panel: int) -> Array:
    """Parameters strictly inside every panel of the patch and next to its ends, increasing."""
    t = np.concatenate(
        [chebyshev.nodes(low, high, per_panel) for low, high in pairwise(panels(patch))]
    )
    return kept_aside(patch, t)


def kept_aside(patch: Patch, t: Array) -> Array:
    """Increasing parameters, kept a millionth of the domain away from an end where the whole
    ruling is singular: ratios of what vanishes there are read to 1e-10 and still mean the end."""
    low, high = patch.domain
    singular = vanishing(patch.field, low, high)
    if not any(singular):
        return t
    inset = ASIDE * (high - low)
    return np.unique(np.clip(t, low + inset * singular[0], high - inset * singular[1]))


def patch_size(frame: Frame) -> float:
    """The diagonal of the bounding box of the patch's sampled corners, mm."""
    ends = _ends(frame)
    return float(np.linalg.norm(ends.max(axis=0) - ends.min(axis=0)))


def patch_box(patch: Patch) -> Array:
    """The bounding box (2, 3) of the patch, from samples, mm."""
    ends = _ends(patch.frame(sample_parameters(patch, 33)))
    return np.stack([ends.min(axis=0), ends.max(axis=0)])


def _ends(frame: Frame) -> Array:
    return np.concatenate(
        [frame.c0 + frame.v_from[:, None] * frame.e, frame.c0 + frame.v_to[:, None] * frame.e]
    )


def _as_plane(frame: Frame, size: float) -> Shape | None:
    ends = _ends(frame)
    centre = ends.mean(axis=0)
    axis = np.linalg.svd(ends - centre, full_matrices=False)[2][-1]
    if np.abs((ends - centre) @ axis).max() > EXACT * size:
        return None
    towards = np.nansum(frame.n @ axis)
    return Shape("plane", point=centre, axis=axis if towards >= 0.0 else -axis)


def _as_cylinder(frame: Frame, size: float) -> Shape | None:
    axis = frame.e.mean(axis=0)
    axis /= np.linalg.norm(axis)
    half = 0.5 * (frame.v_to - frame.v_from)
    if (np.linalg.norm(frame.e - axis, axis=1) * half).max() > EXACT * size:
        return None
    with np.errstate(divide="ignore", invalid="ignore"):
        radii = frame.q / frame.c
    if not (np.abs(radii) <= size / EXACT).all():  # flat somewhere, so that no circle fits
        return Shape("cylinder", axis=axis)
    centre = frame.c0 + radii[:, None] * frame.n
    across = np.eye(3) - np.outer(axis, axis)
    point = (centre @ across).mean(axis=0)
    distance = np.linalg.norm((frame.c0 - point) @ across, axis=1)
    radius = float(distance.mean())
    if np.abs(distance - radius).max() > EXACT * size:
        return Shape("cylinder", axis=axis)
    return Shape("cylinder", point=point, axis=axis, radius=radius)


def _as_cone(frame: Frame, size: float) -> Shape | None:
    steep = np.abs(frame.a) > 0.1 * np.abs(frame.a).max()
    height = -frame.q[steep] / frame.a[steep]
    apex = (frame.c0[steep] + height[:, None] * frame.e[steep]).mean(axis=0)
    away = apex - frame.c0
    along = rows_dot(away, frame.e)
    missed = np.linalg.norm(away - along[:, None] * frame.e, axis=1)
    middle = 0.5 * (frame.v_from + frame.v_to)
    half = 0.5 * (frame.v_to - frame.v_from)
    # turning a ruling about its middle until it meets the apex
    moved = missed * half / np.maximum(np.abs(along - middle), half)
    if not moved.max() <= EXACT * size:
        return None
    axis = frame.a[:, None] * frame.n + frame.c[:, None] * frame.e
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    outward = np.sign(middle - along)[:, None] * frame.e
    axis = axis * np.sign(rows_dot(axis, outward))[:, None]
    mean = axis.mean(axis=0)
    if not np.linalg.norm(mean) > 0.5:
        return Shape("cone", point=apex)
    mean /= np.linalg.norm(mean)
    reach = np.maximum(np.abs(frame.v_from - along), np.abs(frame.v_to - along))
    rise = outward @ mean
    run = np.linalg.norm(outward - rise[:, None] * mean, axis=1)
    angle = np.arctan2(run, rise)
    half_angle = float(angle.mean())
    if (np.abs(angle - half_angle) * reach).max() > EXACT * size:
        return Shape("cone", point=apex)
    return Shape("cone", point=apex, axis=mean, half_angle=half_angle)
