"""Hypothesis strategies for geometry: rigid motions, scales, numbers of smooth space curves."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st


def numbers(low, high):
    """Finite numbers in [low, high]."""
    return st.floats(low, high, allow_nan=False, allow_infinity=False)


def scales(low=0.1, high=1e4):
    """Lengths in mm from a watch's hand to a silo, even in their logarithm."""
    # the ends of the exponent's range need not come back exactly from the logarithm
    return numbers(np.log10(low), np.log10(high)).map(lambda x: float(np.clip(10.0**x, low, high)))


def rotations():
    """Rotation matrices (3, 3), from quaternions; of a short quaternion the identity."""
    return st.tuples(*[numbers(-1.0, 1.0)] * 4).map(_rotation)


@st.composite
def rigid_motions(draw, reach=1e3):
    """Rigid motions (4, 4) that turn any way and move by up to ``reach`` mm along each axis."""
    motion = np.eye(4)
    motion[:3, :3] = draw(rotations())
    motion[:3, 3] = draw(st.tuples(*[numbers(-reach, reach)] * 3))
    return motion


@st.composite
def natural_equations(draw, turns=2.0):
    """Curvature and torsion as expressions in t over t in [0, 1], and the bound of |torsion|.

    Both are smooth; the curvature lies between 0.25 and 1.75 of a mean of up to ``turns``
    turns, hence never vanishes; the torsion is bounded by the same mean and may change sign.
    """
    mean = draw(numbers(0.5, 2.0 * np.pi * turns))
    waves = draw(st.integers(0, 3))
    depth, phase = draw(numbers(-0.75, 0.75)), draw(numbers(0.0, 6.0))
    level, sway = draw(numbers(-0.5, 0.5)), draw(numbers(-0.5, 0.5))
    curvature = f"{mean!r}*(1 + {depth!r}*sin({waves}*t + {phase!r}))"
    torsion = f"{mean!r}*({level!r} + {sway!r}*cos({waves + 1}*t))"
    return curvature, torsion, mean


def _rotation(quaternion):
    """The rotation of a quaternion (w, x, y, z) of any length."""
    w, x, y, z = quaternion
    square = w * w + x * x + y * y + z * z
    if square < 1e-6:  # too short to say where it points
        return np.eye(3)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 / square * (w * cross + cross @ cross)
