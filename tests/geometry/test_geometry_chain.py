"""Linking, closing, cutting and opening of chains."""

import numpy as np
import pytest
from patches import frustum, helix_tangent, prism, slanted_pipe, wall

from devcad.errors import GeometryError, JobError
from devcad.flatten.outline import surface_area
from devcad.geometry.chain import cut_at, link, with_gap
from devcad.geometry.parallel import parallel_chain

SQUARE = np.array([[0, 0], [40, 0], [40, 30], [0, 30]], dtype=float)


def closed(patches):
    return link(patches, base_closed=True, tolerance=0.05)


def test_a_tube_closes_and_a_helix_does_not():
    assert closed((frustum(),)).closed
    assert not link((helix_tangent(),), base_closed=False, tolerance=0.05).closed


def test_neighbours_without_a_common_ruling_are_refused():
    walls = (
        wall(np.zeros(3), np.array([1.0, 0, 0]), 1.0),
        wall(np.array([1.0, 0, 0]), np.array([1.0, 1.0, 0]), 1.5),
    )
    with pytest.raises(GeometryError, match="do not share a ruling"):
        link(walls, base_closed=False, tolerance=0.05)


def test_cutting_elsewhere_keeps_area_and_surface_and_moves_the_start():
    chain = closed((slanted_pipe(),))
    moved = cut_at(chain, 2.0)
    assert moved.closed
    (patch,) = moved.patches
    assert patch.domain == (2.0, 2.0 + 2 * np.pi)
    assert surface_area(patch) == pytest.approx(1256.6370614359173, rel=1e-12)
    np.testing.assert_allclose(
        patch.point([3.0, 7.0], [5.0, 5.0]),
        slanted_pipe().point([3.0, 7.0 - 2 * np.pi], [5.0, 5.0]),
        atol=1e-13,
    )


def test_cutting_a_duct_inside_a_wall_gives_five_patches_and_four_creases():
    moved = cut_at(closed(prism(SQUARE, 50.0)), 0.25)
    # every wall has its own t in [0, 1]: the first one is cut
    assert len(moved.patches) == 5
    assert [round(float(np.degrees(j.angle))) for j in moved.joints] == [90] * 4
    assert moved.closing is not None
    assert moved.closing.smooth


def test_cut_and_gap_need_a_tube():
    chain = link((helix_tangent(),), base_closed=False, tolerance=0.05)
    with pytest.raises(JobError, match="not closed"):
        cut_at(chain, 1.0)
    with pytest.raises(JobError, match="not closed"):
        with_gap(chain, 1.0)


def test_a_gap_is_as_wide_as_asked_at_its_wider_end():
    chain = with_gap(closed((frustum(),)), 3.0)
    assert not chain.closed
    patch = chain.patches[0]
    ends = patch.point([0.0, patch.domain[1]], [0.0, 0.0])
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(3.0, rel=1e-12)


def test_the_middle_of_a_duct_described_by_its_outside_is_smaller_by_the_thickness():
    # counterclockwise seen from above, rulings upwards: the front is the inside
    outside = closed(prism(SQUARE, 50.0))
    middle = parallel_chain(outside, 1.0)
    assert middle.closed
    corners = np.array([p.point([0.0], [0.0])[0] for p in middle.patches])
    np.testing.assert_allclose(corners[:, 0], [1, 39, 39, 1], atol=1e-12)
    np.testing.assert_allclose(corners[:, 1], [1, 1, 29, 29], atol=1e-12)
    assert sum(map(surface_area, middle.patches)) == pytest.approx(2 * (38 + 28) * 50, rel=1e-12)
