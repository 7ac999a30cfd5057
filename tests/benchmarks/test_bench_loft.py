"""The loft's matching: many rulings, in time that grows with their number."""

import time

import numpy as np
import pytest

from devcad.geometry.curves import CircleCurve, EllipseCurve
from devcad.geometry.loft.matching import polished, search
from devcad.geometry.loft.rail import blown_up

pytestmark = pytest.mark.bench


def best_of(function, times=5):
    spent = []
    for _ in range(times):
        start = time.process_time()
        result = function()
        spent.append(time.process_time() - start)
    return min(spent), result


def test_the_cost_of_a_matching_is_linear_in_its_rulings():
    rails = (
        EllipseCurve(kind="ellipse", radii=(100, 60)).curve(),
        CircleCurve(kind="circle", radius=40, center=(20, 10, 140), normal=(0.2, 0.1, 1)).curve(),
    )

    def matched(number):
        a, b = (blown_up(curve) for curve in rails)
        return polished(a, b, search(a, b, fans=True), number)

    few, path = best_of(lambda: matched(2000))
    many, longer = best_of(lambda: matched(10_000))
    assert path.solved.all()
    assert longer.solved.all()
    assert np.degrees(np.abs(longer.warp)).max() < 1e-9
    # the plain reference: the points of both rails, looked at as often as the search for a root
    t = np.linspace(0, 2 * np.pi, 10_000)
    plain, _ = best_of(lambda: [curve.jet(t, 1) for curve in rails for _ in range(20)])
    assert many < 8 * plain
    assert many < 5 * few
    assert few < 0.5  # seconds, on two cores of a small machine
    assert many < 1.0
