"""Meshing of perforated panels, as a ratio of two sizes within one run."""

import time

import numpy as np
import pytest
from contours import ellipse
from patches import wall

from devcad.geometry.chain import Chain
from devcad.mesh.build import build_mesh

pytestmark = pytest.mark.bench


def cost(number):
    """Processor time of number x number round holes in one plane strip, in seconds."""
    side = 10.0 * number
    chain = Chain((wall(np.zeros(3), np.array([side, 0.0, 0.0]), side),))
    place = np.arange(number) + 0.5
    cuts = tuple(ellipse(t / number, 10.0 * v, 3.0 / side, 3.0) for t in place for v in place)
    rulings = (np.array([0.0, 1.0]),)

    def flat(_number, t, v):
        return np.column_stack([v, side * t])

    start = time.process_time()
    mesh = build_mesh(chain, rulings, (-1.0, 1.0), flat, 0.0, cuts, 0.05)
    taken = time.process_time() - start
    assert mesh.watertight
    return taken


def test_four_times_as_many_holes_cost_at_most_six_times_the_time():
    few, many = min(cost(20) for _ in range(3)), cost(40)
    assert many <= 6.0 * few, f"{many / few:.1f} times"
