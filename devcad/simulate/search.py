"""How far a statement holds along a motion."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from devcad.geometry.taylor import Array

SAMPLES = 1440
ZOOM = 64
FINE = 1e-12
"""The end is known to this share of the range: a range of a turn to 1e-11 radians."""


def first_failure(
    holds: Callable[[Array], NDArray[Any]], end: float, *, start: float = 0.0
) -> float:
    """The first x in [start, end] from which on ``holds`` is false, ``end`` where it never is.

    The range is sampled at 1440 places, and the stretch where it first fails divided by 64 until
    the place is known to 1e-12 of the range: what fails and holds again between two samples is
    not seen.

    Args:
        holds: x (n,) to (n,) booleans.
    """
    if not end > start:
        return start
    x = np.linspace(start, end, SAMPLES + 1)
    ok = np.asarray(holds(x), dtype=bool)
    if ok.all():
        return end
    first = int(np.argmin(ok))
    if first == 0:
        return start
    low, high = float(x[first - 1]), float(x[first])
    while high - low > FINE * (end - start):
        x = np.linspace(low, high, ZOOM + 1)
        ok = np.asarray(holds(x), dtype=bool)
        ok[0], ok[-1] = True, False
        first = int(np.argmin(ok))
        if not low < x[first] < high and not low < x[first - 1] < high:
            break  # no numbers between them
        low, high = float(x[first - 1]), float(x[first])
    return low
