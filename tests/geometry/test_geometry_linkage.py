"""Linkages on a circle: closing, radii and joints against the circle's own chords."""

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from devcad.errors import GeometryError
from devcad.geometry.linkage import (
    branch_of,
    conformal,
    crossed_radius,
    is_grashof,
    is_linkage,
    joints_of,
    open_radius,
    sweeps_of,
)


def inscribed(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Joints anywhere on the unit circle, (count, 4), and the chords between them."""
    joints = rng.uniform(0.0, 2.0 * np.pi, (count, 4))
    return joints, 2.0 * np.abs(np.sin(0.5 * (np.roll(joints, -1, axis=1) - joints)))


def test_a_crossed_pose_lies_on_a_circle_exactly_for_grashof_and_an_open_one_always():
    # that a circle exists is asked of the closing condition itself: with the half arcs' sines
    # x l, a sign change of the angle between two ends of x is a pose
    sides = np.random.default_rng(8).uniform(0.05, 1.0, (10_000, 4))
    sides = sides[is_linkage(sides)]
    s, p, q, l = np.sort(sides, axis=1).T  # noqa: E741
    grashof = s + l < p + q
    np.testing.assert_array_equal(is_grashof(sides), grashof)
    share = np.geomspace(1e-3, 3.1415, 160)
    sine = np.sin(share)[:, None] / l
    crossed = np.arcsin(q * sine) + np.arcsin(p * sine) - np.arcsin(s * sine) - share[:, None]
    flips = (np.sign(crossed[1:]) != np.sign(crossed[:-1])).any(axis=0)
    sure = np.abs(p + q - s - l) > 1e-3  # a pose nearer to a change point hides before the first x
    np.testing.assert_array_equal(flips[sure], grashof[sure])
    np.testing.assert_array_equal(np.isfinite(crossed_radius(sides)), grashof)
    assert np.isfinite(open_radius(sides)).all()


def test_radii_are_those_of_the_circle_that_the_chords_were_taken_from():
    joints, sides = inscribed(np.random.default_rng(9), 4000)
    crossed = np.array([branch_of(row) == "crossed" for row in joints.tolist()])
    assert 2000 < crossed.sum() < 3200  # two of three orders cross
    sums = np.sort(sides, axis=1)
    fair = (np.abs(sums @ [1, -1, -1, 1]) > 1e-3) & (2 * sums[:, 3] < sums.sum(axis=1) - 1e-3)
    # the distance from a change point or from a straight line takes three digits
    np.testing.assert_allclose(crossed_radius(sides[crossed & fair]), 1.0, rtol=1e-11)
    np.testing.assert_allclose(open_radius(sides[~crossed & fair]), 1.0, rtol=1e-11)


def exact_radius(sides: list[float], sign: int) -> float:
    """Parameshvara's formula in fractions; ``sign`` of the shortest side is -1 where crossed."""
    s, p, q, l = sorted(Fraction(side) for side in sides)  # noqa: E741
    s *= sign
    top = (l * q + p * s) * (l * p + q * s) * (q * p + l * s)
    bottom = (l + q + p - s) * (l + q - p + s) * (l + p - q + s) * (q + p + s - l)
    square = top / bottom
    return float((Decimal(square.numerator) / Decimal(square.denominator)).sqrt())


@pytest.mark.parametrize("away", [1e-3, 1e-6, 1e-9, 1e-12])
def test_no_digit_is_lost_near_a_change_point_or_a_straight_line(away):
    # one part in 1e12 from them the plain formulas keep three digits
    for sides in ([10.0, 20.0, 30.0, 20.0 + away], [12.0, 18.0, 12.0 + away, 18.0 + 2.5 * away]):
        if is_grashof([sides])[0]:
            assert crossed_radius(sides) == pytest.approx(exact_radius(sides, -1), rel=4e-15)
            radius, sweeps = conformal(sides, "crossed")
            chords = 2.0 * radius * np.abs(np.sin(0.5 * np.array(sweeps)))
            np.testing.assert_allclose(chords, sides, rtol=1e-14)
    for sides in ([2.0, 3.0, 4.0, 9.0 - away], [0.7, 0.1, 0.1, 0.9 - away]):
        assert open_radius(sides) == pytest.approx(exact_radius(sides, 1), rel=4e-15)
        radius, sweeps = conformal(sides, "open")
        chords = 2.0 * radius * np.abs(np.sin(0.5 * np.array(sweeps)))
        np.testing.assert_allclose(chords, sides, rtol=1e-14)
        assert sum(sweeps) == pytest.approx(0.0, abs=1e-15)


def test_half_turns_follow_the_other_links():
    # where 180 degrees come out of a difference rounding must not choose their side
    rng = np.random.default_rng(12)
    for first in np.round(rng.uniform(0.0, 360.0, 500), 2).tolist():
        for way in (1.0, -1.0):
            degrees = [first, first + way * 20.0, first + way * 60.0, first + way * 180.0]
            sweeps = sweeps_of(np.radians(degrees).tolist())
            assert sum(sweeps) == pytest.approx(2.0 * np.pi * way, abs=1e-13)


@pytest.mark.parametrize("branch", ["open", "crossed"])
def test_the_joints_lie_on_the_circle_at_the_distances_of_the_links(branch):
    for sides in np.random.default_rng(10).uniform(0.2, 1.0, (200, 4)).tolist():
        if not is_linkage(sides) or (branch == "crossed" and not is_grashof(sides)):
            with pytest.raises(GeometryError):
                conformal(sides, branch)
            continue
        radius, sweeps = conformal(sides, branch)
        joints = joints_of(sweeps)
        places = radius * np.exp(1j * np.array(joints))
        np.testing.assert_allclose(np.abs(np.roll(places, -1) - places), sides, rtol=1e-9)
        assert branch_of(joints) == branch
        assert sweeps[0] > 0.0 and max(map(abs, sweeps)) <= np.pi


def test_worked_case_o27():
    sides = [8.452365234813989, 17.320508075688775, 17.320508075688775, 11.471528727020923]
    radius, sweeps = conformal(sides, "open")
    assert radius == pytest.approx(10.0, rel=1e-12)
    np.testing.assert_allclose(np.degrees(joints_of(sweeps)), [0, 50, 170, 290], atol=1e-11)
    assert is_grashof([sides])[0]


def test_a_link_as_long_as_an_arc_of_others_leaves_the_centre_outside():
    # 0, 30, 70 and 120 degrees: the ground goes back the shorter way
    joints = np.radians([0.0, 30.0, 70.0, 120.0])
    sides = 2.0 * np.sin(0.5 * np.radians([30.0, 40.0, 50.0, 120.0]))
    radius, sweeps = conformal(sides.tolist(), "open")
    assert radius == pytest.approx(1.0, rel=1e-13)
    np.testing.assert_allclose(joints_of(sweeps), joints, atol=1e-13)
    assert sum(sweeps) == pytest.approx(0.0, abs=1e-13)


def test_more_links_than_four_are_a_polygon_in_a_circle():
    arcs = np.radians([20.0, 55.0, 35.0, 80.0, 70.0, 40.0, 60.0])
    radius, sweeps = conformal((6.0 * np.sin(0.5 * arcs)).tolist(), "open")
    assert radius == pytest.approx(3.0, rel=1e-13)
    np.testing.assert_allclose(sweeps, arcs, rtol=1e-12)


@pytest.mark.parametrize(
    ("sides", "branch", "says"),
    [
        ([1, 2, 3, 6], "open", "do not close"),
        ([1, 2, 3, 6], "crossed", "do not close"),
        ([3, 3, 5, 5.5], "crossed", "no Grashof"),
        ([2, 1, 2, 1], "crossed", "change point"),
        ([0.1, 0.2, 0.4, 0.3], "crossed", "change point"),
    ],
)
def test_what_is_no_linkage_says_so_in_one_line(sides, branch, says):
    with pytest.raises(GeometryError, match=says) as caught:
        conformal(sides, branch)
    assert "\n" not in str(caught.value)
    assert caught.value.value >= caught.value.limit * (1 - 1e-12)
