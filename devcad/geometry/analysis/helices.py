"""Which helix a curve is: cylindrical, slant, clad, g-clad, or none, with the numbers that decide.

A curve is one of them where the ratio of one of its frames is constant (f = tau/k, sigma, psi,
chi); then the frame's modified Darboux vector keeps its direction, the axis. Each kind is one of
the next: once constant, a ratio has 0 after it.

Source: geometry.md, section 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devcad.geometry.analysis.traces import RATIOS, Traces
from devcad.geometry.taylor import Array

KINDS = ("cylindrical", "slant", "clad", "g_clad")
"""The helix whose ratio of ``RATIOS`` is constant."""
CONSTANT = 1e-9
"""A ratio that spreads by less than this times 1 + its mean is constant, rounding aside."""
AXIS = 1e-6
"""The sine of the largest angle between the axes of two pieces that are one helix."""
WELL = 4.0
"""Samples noisier than this times the median noise do not decide."""
ILL = 1e-6
"""Where the median noise is above this share, nothing is decided."""
MOST_NOISE = 16.0
"""How many times the estimated noise may spread."""
ENOUGH = 0.5
"""At least this share of the bent samples must decide."""


@dataclass(frozen=True, slots=True)
class Ratio:
    """One ratio along a curve: its mean and its spread (largest less smallest) over the samples
    that decide, and the limit below which the spread is rounding.

    ``mean`` and the others are nan where the ratio does not exist, or too few samples know it.
    """

    mean: float
    spread: float
    limit: float
    constant: bool
    axis: Array | None = None


def ratios(traces: Traces) -> dict[str, Ratio]:
    """Each of the four ratios by its name.

    A ratio counts as constant if it spreads by no more than 1e-9 (1 + |mean|) and the noise that
    rounding makes in it; and if the pieces of the curve have one axis.
    """
    return {name: _ratio(traces, k) for k, name in enumerate(RATIOS)}


def helix_class(found: dict[str, Ratio]) -> dict[str, bool]:
    """Which helices the curve is; each kind is also one of those after it."""
    known = np.logical_or.accumulate([found[name].constant for name in RATIOS])
    return dict(zip(KINDS, known.tolist(), strict=True))


def _ratio(traces: Traces, k: int) -> Ratio:
    values, noise, axes = traces.ratios[k], traces.noise[k], traces.axes[k]
    known = np.isfinite(values) & np.isfinite(noise)
    share = noise / (1.0 + np.abs(values))
    deciding = known & (share <= WELL * np.median(share[known]) if known.any() else known)
    if deciding.sum() < ENOUGH * max(traces.bent.sum(), 1):
        return Ratio(np.nan, np.nan, np.nan, constant=False)
    value = values[deciding]
    mean, spread = float(value.mean()), float(np.ptp(value))
    worst = float(noise[deciding].max())
    limit = CONSTANT * (1.0 + abs(mean)) + MOST_NOISE * worst
    constant = spread <= limit and worst <= ILL * (1.0 + abs(mean))
    axis = axes[deciding][int(np.argmin(noise[deciding]))]
    if constant:
        apart = np.linalg.norm(np.cross(axes[deciding], axis), axis=1)
        constant = bool(apart.max() <= AXIS)
    return Ratio(mean, spread, limit, constant, axis if constant else None)
