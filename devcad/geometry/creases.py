"""What a bend of a given radius in place of a crease takes of the faces beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry.chain import Joint
from devcad.geometry.classify import EXACT
from devcad.geometry.patch import Frame, Patch
from devcad.geometry.taylor import Array

STEPS, STILL = 60, 1e-15
"""Newton's steps to the circle that touches two curved faces, and the step that is none."""


@dataclass(frozen=True, slots=True)
class Bend:
    """The bend in place of a joint: its angle and radius on the described surface, and how far
    it reaches: ``setback`` mm into planes, to the parameters ``t`` of curved faces."""

    angle: float
    radius: float
    setback: tuple[float, float]
    t: tuple[float | None, float | None] = (None, None)


def bend_at(pair: tuple[Patch, Patch], faces: tuple[str, str], joint: Joint, radius: float) -> Bend:
    """The bend of a ``radius`` in place of the joint between a ``pair`` of ``faces``, the types of
    the patches before and after.

    Raises:
        GeometryError: a face is neither plane nor a cylinder along the crease, or no circle of
            the radius touches both within them.
    """
    setback = radius * np.tan(0.5 * abs(joint.angle))
    if faces == ("plane", "plane"):
        return Bend(joint.angle, radius, (setback, setback))
    for face in faces:
        if face not in ("plane", "cylinder"):
            raise GeometryError(
                f"no bend of one inside radius fits the {_told(pair, joint)}: beside it is a face "
                "that is neither plane nor a cylinder along it",
                value=float(np.degrees(abs(joint.angle))),
                remedy="round the crease with corner_radius, or leave inside_radius out",
            )
    return _touching(pair, faces, joint, radius)


def _told(pair: tuple[Patch, Patch], joint: Joint) -> str:
    angle = float(np.degrees(abs(joint.angle)))
    return f"crease of {angle:.4g} deg at t = {pair[0].domain[1]:.6g}"


def _touching(
    pair: tuple[Patch, Patch], faces: tuple[str, str], joint: Joint, radius: float
) -> Bend:
    """The circle that touches two faces, one of them curved, in the plane across their crease:
    Newton's steps to where the curves at its radius from both cross."""
    ends = pair[0].frame([near(pair[0], 1)]), pair[1].frame([near(pair[1], 0)])
    across = np.stack([ends[0].m[0], ends[0].n[0]])
    height = np.sign(joint.angle) * radius
    setback = radius * np.tan(0.5 * abs(joint.angle))
    at = [-setback / _pace(ends[0], faces[0]), setback / _pace(ends[1], faces[1])]
    for _ in range(STEPS):
        sides = [_beside(pair[k], k, faces[k], ends[k], at[k], height) for k in (0, 1)]
        (first, one, pace), (second, other, rate) = sides
        rows = np.column_stack([pace * (across @ one[0]), -rate * (across @ other[0])])
        if abs(np.linalg.det(rows)) <= EXACT * abs(pace * rate):
            break
        step = np.linalg.solve(rows, across @ (second - first))
        reach = [_reach(pair[k], faces[k]) for k in (0, 1)]
        new = [
            float(np.clip(at[0] + step[0], -reach[0], 0.0)),
            float(np.clip(at[1] + step[1], 0.0, reach[1])),
        ]
        steps = [abs(a - b) / max(abs(a), abs(b)) for a, b in zip(new, at, strict=True) if a != b]
        at = new
        if max(steps, default=0.0) <= STILL:
            break
    sides = [_beside(pair[k], k, faces[k], ends[k], at[k], height) for k in (0, 1)]
    missed = float(np.linalg.norm(across @ (sides[1][0] - sides[0][0])))
    normals = sides[0][1][1], sides[1][1][1]
    angle = float(np.arctan2(np.cross(*normals) @ ends[0].e[0], normals[0] @ normals[1]))
    if missed > EXACT * radius or angle * joint.angle <= 0.0 or not (at[0] < 0.0 < at[1]):
        raise GeometryError(
            f"no bend of radius {radius:.6g} mm touches both faces of the {_told(pair, joint)}",
            value=radius,
            remedy="give a smaller inside_radius, or round the crease with corner_radius",
        )
    places = [None if faces[k] == "plane" else pair[k].domain[1 - k] + at[k] for k in (0, 1)]
    return Bend(angle, radius, (-at[0], at[1]), (places[0], places[1]))


def near(patch: Patch, end: int) -> float:
    """The domain's start (0) or end (1), a rounding inside."""
    low, high = patch.domain
    return float(np.nextafter(high, low) if end else np.nextafter(low, high))


def _pace(frame: Frame, face: str) -> float:
    """How fast a face leaves its crease: planes are measured in mm, cylinders in t."""
    return 1.0 if face == "plane" else float(frame.q[0])


def _reach(patch: Patch, face: str) -> float:
    return np.inf if face == "plane" else patch.domain[1] - patch.domain[0]


def _beside(
    patch: Patch, after: int, face: str, crease: Frame, at: float, height: float
) -> tuple[Array, tuple[Array, Array], float]:
    """The point at ``height`` along n over the place ``at`` from the crease, m and n there, and
    the speed of the point along m."""
    if face == "plane":
        foot, m, n = crease.c0[0] + at * crease.m[0], crease.m[0], crease.n[0]
        return foot + height * n, (m, n), 1.0
    frame = patch.frame([float(np.clip(patch.domain[1 - after] + at, *patch.domain))])
    m, n = frame.m[0], frame.n[0]
    return frame.c0[0] + height * n, (m, n), float(frame.q[0] - height * frame.c[0])
