"""Four-bars: Freudenstein's equation word for word, brute force over the input, known linkages."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

from devcad.errors import GeometryError
from devcad.simulate.drives import four_bar
from devcad.simulate.fourbar import (
    FourBar,
    freudenstein,
    grashof,
    output_toggles,
    positions,
    reach,
    reach_from,
    speeds,
    toggles,
    transmission,
    transmission_extremes,
)


def linkages(count: int, seed: int) -> list[FourBar]:
    rng = np.random.default_rng(seed)
    out: list[FourBar] = []
    while len(out) < count:
        lengths = rng.uniform(0.02, 1.0, 4) * 10.0 ** rng.uniform(-6, 6)
        if 2.0 * lengths.max() < lengths.sum():
            out.append(FourBar(*lengths.tolist()))
    return out


def quadratic(bar: FourBar, theta2: np.ndarray) -> np.ndarray:
    """A, B, C of geometry.md, section 7: A w^2 + B w + C = 0 in w = tan(theta4 / 2)."""
    a1, a2, a3, a4 = bar.lengths
    k1, k2, k3 = a1 / a2, a1 / a4, (a1**2 + a2**2 - a3**2 + a4**2) / (2.0 * a2 * a4)
    cosine, sine = np.cos(theta2), np.sin(theta2)
    return np.array([cosine - k1 - k2 * cosine + k3, -2 * sine, k1 - (k2 + 1) * cosine + k3])


def check(bar: FourBar, theta2: np.ndarray) -> float:
    """The worst error of the loop, and that everything else agrees with brute force."""
    a, b, c = quadratic(bar, theta2)
    closes = b * b - 4.0 * a * c >= 0.0
    worst = 0.0
    for branch in (-1, 1):
        theta3, theta4 = positions(bar, theta2, branch)
        assert np.array_equal(np.isfinite(theta4), closes)
        loop = bar.input * np.exp(1j * theta2) + bar.coupler * np.exp(1j * theta3)
        loop -= bar.output * np.exp(1j * theta4) + bar.ground
        worst = max(worst, float(np.abs(loop[closes]).max(initial=0.0)) / sum(bar.lengths))
    kind = grashof(bar)
    assert closes.all() == kind.input_turns
    assert len(toggles(bar)) == np.count_nonzero(closes != np.roll(closes, 1))
    step = theta2[1] - theta2[0]
    for toggle in toggles(bar):
        near = np.abs(np.angle(np.exp(1j * (theta2 - toggle.angle)))) <= 1.01 * step
        assert closes[near].any() and not closes[near].all()
    inside = [
        np.abs(theta2 + lap - 0.5 * (p + q)) <= 0.5 * (q - p)
        for p, q in reach(bar)
        for lap in (-2.0 * np.pi, 0.0, 2.0 * np.pi)
    ]
    assert np.array_equal(np.any(inside, axis=0), closes)
    s, p, q, longest = sorted(bar.lengths)
    mirrored = quadratic(FourBar(bar.ground, bar.output, bar.coupler, bar.input), theta2)
    back = (mirrored[1] ** 2 - 4.0 * mirrored[0] * mirrored[2] >= 0.0).all()
    assert back == kind.output_turns
    names = {
        (True, True): "double-crank",
        (True, False): "crank-rocker",
        (False, True): "crank-rocker",
        (False, False): "double-rocker" if s + longest < p + q else "triple-rocker",
    }
    assert kind.kind == names[bool(closes.all()), bool(back)]
    return worst


def test_random_linkages_agree_with_brute_force() -> None:
    theta2 = np.linspace(-np.pi, np.pi, 720, endpoint=False) + 1e-4
    assert max(check(bar, theta2) for bar in linkages(300, 1)) < 1e-14


@pytest.mark.slow
def test_ten_thousand_linkages_agree_with_brute_force() -> None:
    theta2 = np.linspace(-np.pi, np.pi, 720, endpoint=False) + 1e-4
    assert max(check(bar, theta2) for bar in linkages(10_000, 2)) < 1e-14


def test_the_worked_case_of_the_oracles() -> None:
    """O29, and the roots of the quadratic."""
    bar, theta2 = FourBar(10, 4, 8, 9), np.array([np.pi / 3])
    found = np.sort(freudenstein(bar, theta2)[:, 0])
    np.testing.assert_allclose(found, [-2.6137881796504225, 1.7965124694552377], rtol=1e-12)
    roots = np.sort(2.0 * np.arctan(np.roots(quadratic(bar, theta2)[:, 0])))
    np.testing.assert_allclose(found, roots, rtol=1e-12)


def test_the_conformal_pose_is_on_its_branch() -> None:
    """Joints on a circle, in any order, and any link as the ground."""
    rng = np.random.default_rng(3)
    for _ in range(200):
        angles = rng.uniform(0.0, 2.0 * np.pi, 4)
        if np.abs(np.sin(0.5 * (angles - np.roll(angles, 1)))).min() < 1e-3:
            continue
        joints = 7.0 * np.exp(1j * angles)
        for ground in range(4):
            drive = four_bar(joints.tolist(), ground)
            poses = drive.poses(np.zeros(1))
            np.testing.assert_allclose(poses.joints[0], joints, atol=1e-12)
            assert not poses.turns.any() and not poses.shifts.any()
            theta4 = drive.angles(np.zeros(1))[2]
            o2, _, b, o4 = drive.places
            seen = cmath.phase((b - o4) / (o4 - o2))
            # the sine of the angle at B divides the error: never 0 for points of a circle
            assert abs(cmath.phase(cmath.exp(1j * (theta4[0] - seen)))) < 1e-10


def test_a_parallelogram_ends_at_its_change_points() -> None:
    bar = FourBar(2.0, 1.0, 2.0, 1.0)
    assert grashof(bar).kind == "change-point"
    assert [(t.angle, t.shape) for t in toggles(bar)] == [(0.0, "folded"), (math.pi, "extended")]
    low, high, whole = reach_from(bar, 1.0)
    assert (low, high, whole) == pytest.approx((-1.0, math.pi - 1.0, False), abs=1e-15)
    theta2 = np.linspace(0.01, np.pi - 0.01, 50)
    parallel = freudenstein(bar, theta2)
    assert np.abs(parallel - theta2).min(axis=0).max() < 1e-13  # the output stays parallel
    theta3, _ = positions(bar, np.array([0.0, math.pi]), 1)
    assert np.isfinite(theta3).all()  # and closes at the change points themselves


def test_a_rhombus_whose_joints_fall_together() -> None:
    """At theta2 = 0 the input lies on the ground, and the output may stand anywhere."""
    bar = FourBar(1.0, 1.0, 1.0, 1.0)
    theta3, theta4 = positions(bar, np.zeros(1), 1)
    assert abs(1.0 + np.exp(1j * theta3[0]) - np.exp(1j * theta4[0]) - 1.0) < 1e-15


@pytest.mark.parametrize("size", [1e-100, 1e-9, 1.0, 1e9, 1e100])
def test_size_does_not_matter(size: float) -> None:
    bar = FourBar(10 * size, 4 * size, 8 * size, 9 * size)
    theta2 = np.linspace(-3.0, 3.0, 7)
    np.testing.assert_allclose(
        freudenstein(bar, theta2), freudenstein(FourBar(10, 4, 8, 9), theta2)
    )
    assert grashof(bar).kind == "crank-rocker"
    assert [t.angle for t in output_toggles(bar)] == pytest.approx(
        [t.angle for t in output_toggles(FourBar(10, 4, 8, 9))]
    )


def test_near_a_toggle_the_loop_still_closes() -> None:
    bar = FourBar(10.0, 9.0, 4.0, 8.0)
    stop = max(t.angle for t in toggles(bar))
    theta2 = stop - np.array([0.0, 1e-16, 1e-14, 1e-12, 1e-8, 1e-4])
    for branch in (-1, 1):
        theta3, theta4 = positions(bar, theta2, branch)
        loop = 9.0 * np.exp(1j * theta2) + 4.0 * np.exp(1j * theta3) - 8.0 * np.exp(1j * theta4)
        assert np.abs(loop - 10.0).max() < 1e-13
    assert np.isnan(positions(bar, np.array([stop + 1e-6]), 1)[0]).all()


def test_speeds_and_transmission_against_differences() -> None:
    bar, theta2, step = FourBar(10, 4, 8, 9), np.linspace(-3.0, 3.0, 11), 1e-6
    for branch in (-1, 1):
        before, after = (np.array(positions(bar, theta2 + h, branch)) for h in (-step, step))
        difference = np.angle(np.exp(1j * (after - before))) / (2.0 * step)
        np.testing.assert_allclose(np.array(speeds(bar, theta2, branch)), difference, atol=1e-8)
        theta3, theta4 = positions(bar, theta2, branch)
        between = np.abs(np.angle(np.exp(1j * (theta4 - theta3))))
        np.testing.assert_allclose(transmission(bar, theta2), between, atol=1e-12)
    dense = transmission(bar, np.linspace(-1.0, 5.0, 100_001))
    found = transmission_extremes(bar, -1.0, 5.0)
    assert found == pytest.approx((dense.min(), dense.max()), abs=1e-8)


@pytest.mark.parametrize(
    ("lengths", "words"),
    [
        ((10, 4, 3, 3), "the ground of length 10 is not shorter than the other three"),
        ((3, 10, 3, 3), "the input of length 10"),
        ((1, 1, 0, 1), "the coupler has the length 0"),
    ],
)
def test_what_does_not_close_is_told(lengths: tuple[float, ...], words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        FourBar(*lengths)
