"""Points along cuts: chords within the tolerance, as few as it allows, the same from both sides."""

import numpy as np
import pytest
from contours import ellipse, polygon, track
from patches import frustum, wall

from devcad.geometry.chain import Chain, link
from devcad.geometry.cuts import Cut
from devcad.mesh.contours import Lines, sample

PLATE = Chain((wall(np.zeros(3), np.array([100.0, 0.0, 0.0]), 80.0),))
PIPE = link((frustum(50.0, 50.0, 100.0),), base_closed=True, tolerance=1.0)
LEAST = 1e-5


def sampled(chain, cuts, tolerance, layers=(0.0,), passed=()):
    lines = Lines(cuts, chain, layers)
    places = [np.unique([*ends, *passed]) for ends in lines.u.tolist()]
    return lines, sample(lines, places, np.full(len(lines.u), tolerance), LEAST)


@pytest.mark.parametrize("tolerance", [1.0, 0.1, 0.01, 0.001])
def test_a_circle_has_as_many_chords_as_its_sagitta_asks_for(tolerance):
    _, found = sampled(PLATE, [ellipse(0.5, 40.0, 0.1, 10.0)], tolerance)
    # sagitta r (1 - cos(pi / n)); 45 degrees a chord at most, 0.95 of the tolerance aimed at
    fewest = np.pi / np.arccos(1.0 - min(tolerance, 5.0) / 10.0)
    count = found.group.max() + 1
    assert max(8, fewest) <= count <= max(8, 1.05 * fewest + 1.0)
    assert found.deviation <= tolerance


def test_chords_are_where_a_curve_bends():
    # a slender ellipse: curvature a / b^2 at its ends, b / a^2 at its sides
    _, found = sampled(PLATE, [ellipse(0.5, 40.0, 0.4, 4.0)], 0.001)
    x, y = found.points[0][:, 0], found.points[0][:, 2]
    step = np.hypot(np.diff(x), np.diff(y))
    assert step.max() > 4.0 * step.min()
    assert 0.9e-3 <= found.deviation <= 1e-3


def test_all_layers_share_their_parameters_and_keep_the_tolerance():
    lines, found = sampled(PIPE, [ellipse(3.0, 50.0, 0.5, 20.0)], 0.01, (-5.0, 5.0))
    radii = np.hypot(found.points[..., 0], found.points[..., 1])
    np.testing.assert_allclose(radii, [[55.0], [45.0]] * np.ones(radii.shape), rtol=1e-12)
    u = np.linspace(0.0, 1.0, 33)
    low, high = found.u[:-1, None], found.u[1:, None]
    t, v = lines.places(np.zeros(33 * len(low), dtype=int), (low + (high - low) * u).ravel())
    for radius, layer in zip((55.0, 45.0), found.points, strict=True):
        true = np.stack([radius * np.cos(t), radius * np.sin(t), v], axis=1).reshape(-1, 33, 3)
        start, chord = layer[:-1, None], np.diff(layer, axis=0)[:, None]
        share = ((true - start) * chord).sum(axis=2) / (chord**2).sum(axis=2)
        away = np.linalg.norm(true - start - share[..., None] * chord, axis=2)
        assert away.max() <= 0.01 * (1.0 + 1e-6)  # seen 33 times a chord instead of 5 times


def test_places_to_be_passed_are_points_to_the_bit():
    passed = [0.3, 0.7, 2.0, 2.0 + 1e-9, 6.0]
    _, found = sampled(PLATE, [ellipse(0.5, 40.0, 0.1, 10.0)], 0.01, passed=passed)
    assert set(passed) <= set(found.u)
    near = found.group[np.searchsorted(found.u, [2.0, 2.0 + 1e-9])]
    assert near[0] == near[1]  # 1e-8 mm apart: one point
    rows = np.searchsorted(found.u, [2.0, 2.0 + 1e-9])
    np.testing.assert_array_equal(*found.points[0][rows])


def test_corners_are_kept_and_straight_lines_are_one_chord():
    cut = polygon(PLATE, (0.2, 20.0), (0.4, 20.0), (0.4, 60.0), (0.2, 60.0))
    _, found = sampled(PLATE, [cut], 0.01)
    assert found.group.max() + 1 == 4
    assert found.deviation <= 1e-12
    slit = Cut(
        "slit",
        (
            track(lambda u: (0.2 + 0.1 * u, 20.0 + 1e-3 * np.sin(np.pi * u)), 0.0, 1.0),
            track(lambda u: (0.3 - 0.1 * u, 20.0 - 1e-3 * np.sin(np.pi * u)), 0.0, 1.0),
        ),
        True,
    )
    assert sampled(PLATE, [slit], 0.1)[1].group.max() + 1 == 4  # it has a width


def test_a_cusp_within_a_track_is_divided_and_comes_to_an_end():
    loop = track(lambda u: (0.5 + 0.1 * np.cos(u) ** 3, 40.0 + 10.0 * np.sin(u) ** 3), 0, 2 * np.pi)
    _, found = sampled(PLATE, [Cut("astroid", (loop,), True)], 0.01)
    assert found.deviation <= 0.01
    assert found.group.max() + 1 <= 200
