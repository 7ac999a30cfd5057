"""Springback: how much tighter a sheet has to be bent so that it keeps a radius.

A sheet of an elastic and then ideally plastic material, bent to the radius R of its middle and
let go, opens to R0: 1 / R0 = (1 / R) (1 - 3 X + 4 X^3), X = R sigma / (E T). For X >= 1/2 nothing
yields and it opens altogether. sigma the yield strength, E Young's modulus, T the thickness.
A wide sheet, which cannot contract along its width, would take E / (1 - nu^2) and
2 sigma / sqrt 3: 5 % more; work hardening takes as much away.

Source: the moment sigma (c^2 - y^2 / 3) of the yielded section; fabrication tables agree.
"""

from __future__ import annotations

import numpy as np

from devcad.geometry.taylor import Array

ELASTIC = 0.5
"""X of a bend that takes no set."""


def stiffness_ratio(yield_strength: float, youngs_modulus: float, thickness: float) -> float:
    """sigma / (E T) in 1/mm: X of a bend per mm of its radius."""
    return yield_strength / (youngs_modulus * thickness)


def kept_share(x: Array) -> Array:
    """R / R0, the share of its curvature that a bend keeps, for X (n,) up to 1/2."""
    return np.asarray(4.0 * x**3 - 3.0 * x + 1.0)


def loaded_radius(radius: Array, a: float) -> Array:
    """The radius (n,) to bend the middle to, in mm, so that it opens to ``radius`` (n,), inf where
    flat; ``a`` = sigma / (E T). It is below 1 / (2 a), where a sheet begins to take a set.

    The largest root of k^3 - s k^2 + 4 a^3 = 0, s = 1 / radius + 3 a, for k = 1 / R.
    """
    with np.errstate(divide="ignore"):
        s = 1.0 / np.asarray(radius, dtype=float) + 3.0 * a
    angle = 2.0 * np.arcsin(np.sqrt(np.minimum(27.0 * (a / s) ** 3, 1.0)))
    return np.asarray(3.0 / (s * (1.0 + 2.0 * np.cos(angle / 3.0))))
