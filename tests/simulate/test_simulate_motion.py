"""Mechanisms in a cylinder: sides, ranges and clashes against dense samples and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely import LineString

from devcad.geometry.linkage import ROLES, Link, Linkage, branch_of, sweeps_of
from devcad.simulate.bodies import Arc, Poses
from devcad.simulate.clash import crossing
from devcad.simulate.drives import FourBarDrive, RingDrive
from devcad.simulate.figures import figures
from devcad.simulate.mobility import stays
from devcad.simulate.motion import Motion, motion, track

RADIUS = 10.0


def linkage(degrees: list[float], *, abreast: bool = False) -> Linkage:
    """Links between joints in that order; apart along the axis, or all in one band."""
    joints = tuple(math.radians(angle) for angle in degrees)
    n = len(joints)
    links = []
    for k, sweep in enumerate(sweeps_of(joints)):
        band = ((0.0, 5.0),) if abreast else ((6.0 * k, 6.0 * k + 5.0),)
        name = ROLES[k] if n == 4 else str(k + 1)
        links.append(Link(name, k, (k + 1) % n, sweep, (0.0, 0.0), band, RADIUS))
    return Linkage(RADIUS, joints, tuple(links), branch_of(joints), "hole")


def points(found: Motion, x: np.ndarray, k: int, count: int = 400) -> np.ndarray:
    """Points (m, count) of a link's arc in the cross-section, by moving them."""
    assert found.drive is not None
    poses, arc = found.drive.poses(x), found.arcs[k]
    along = arc.start + arc.sweep * np.linspace(0.0, 1.0, count)
    turned = arc.radius * np.exp(1j * (along + poses.turns[:, k, None]))
    return poses.shifts[:, k, None] + turned


def some(count: int, seed: int) -> list[Motion]:
    rng = np.random.default_rng(seed)
    out: list[Motion] = []
    while len(out) < count:
        degrees = rng.uniform(0.0, 360.0, 4)
        if np.abs(np.sin(np.radians(0.5 * (degrees - np.roll(degrees, 1))))).min() > 0.05:
            out.append(motion(linkage(degrees.tolist())))
    return out


def test_links_stay_rigid_and_joined() -> None:
    for found in some(40, 1):
        low, high = found.stretch()
        x = np.linspace(low, high, 40)
        joints = found.drive.poses(x).joints if found.drive else None
        for k, arc in enumerate(found.arcs):
            ends = points(found, x, k, 2)
            assert joints is not None
            assert np.abs(ends[:, 0] - joints[:, arc.first]).max() < 1e-11 * RADIUS
            assert np.abs(ends[:, 1] - joints[:, arc.last]).max() < 1e-11 * RADIUS


def test_the_sides_agree_with_dense_samples() -> None:
    for found in some(60, 2):
        for way in found.directions:
            for side, end in (("outside", way.outside), ("inside", way.inside)):
                sign = 1.0 if side == "outside" else -1.0

                def worst(
                    share: float,
                    way: object = way,
                    end: float = end,
                    found: Motion = found,
                    sign: float = sign,
                ) -> float:
                    x = np.array([way.sign * end * share])  # type: ignore[attr-defined]
                    assert found.drive is not None
                    return min(
                        float((sign * (np.abs(points(found, x, k)) - RADIUS)).min())
                        for k in found.drive.moving
                    )

                if end > 0.0:
                    assert min(worst(share) for share in (0.01, 0.3, 0.6, 0.99)) > -1e-9
                    if end < way.reach - 1e-3:
                        assert worst(1.0 + 1e-3 / end) < 0.0
                else:
                    x = np.array([way.sign * 1e-3])
                    assert found.drive is not None
                    away = [
                        sign * (np.abs(points(found, x, k)) - RADIUS).ravel()
                        for k in found.drive.moving
                    ]
                    assert min(float(a.min()) for a in away) < 0.0


def test_a_pivoting_link_has_a_closed_form() -> None:
    """An arc of sigma turned about its end stays outside for half a turn, inside for pi - sigma."""
    found = motion(linkage([0.0, 50.0, 170.0, 290.0]))
    assert isinstance(found.drive, FourBarDrive)
    arcs = found.arcs[:1]

    class Crank:
        pivots, moving = (0,), (0,)

    def holds(x: float, outside: bool) -> bool:
        shift = np.array([[RADIUS - RADIUS * np.exp(1j * x)]])
        poses = Poses(np.array([[x]]), shift, np.zeros((1, 2), dtype=complex))
        return bool(stays(arcs, Crank, poses, outside=outside)[0])  # type: ignore[arg-type]

    limit = math.pi - math.radians(50.0)
    assert holds(limit - 1e-9, False) and not holds(limit + 1e-9, False)
    assert holds(-math.pi + 1e-9, True) and not holds(-math.pi - 1e-9, True)
    assert not holds(1e-3, True) and not holds(-1e-3, False)


def test_first_order_by_instant_centres_agrees_with_differences() -> None:
    for found in some(40, 4):
        assert found.drive is not None
        x = np.array([-1e-6, 1e-6])
        for k in found.drive.moving:
            low, high = np.abs(points(found, x, k))
            rate = (high - low) / 2e-6
            told = found.departures[k]
            size = max(abs(told.least), abs(told.largest))
            assert rate.min() == pytest.approx(told.least, abs=1e-4 * size)
            assert rate.max() == pytest.approx(told.largest, abs=1e-4 * size)
        assert (found.first_order == "both") == (found.mobility == "both")


def test_the_coupler_turns_about_where_the_cranks_meet() -> None:
    """Kennedy's theorem: three instant centres lie in line."""
    found = motion(linkage([0.0, 50.0, 170.0, 290.0]))
    p = RADIUS * np.exp(1j * np.radians([0.0, 50.0, 170.0, 290.0]))
    centre = found.departures[1].centre
    assert centre is not None
    for pivot, joint in ((p[0], p[1]), (p[3], p[2])):
        assert abs(((centre - pivot) * np.conj(joint - pivot)).imag) < 1e-10
    assert found.departures[0].centre == pytest.approx(p[0])


def test_links_that_span_half_the_tube_can_only_leave_it() -> None:
    """The arc of half a turn: to first order its far end does not move; then it goes out."""
    found = motion(linkage([0.0, 180.0, 240.0, 300.0]))
    assert found.departures[0].side in ("in", "out")
    away = np.abs(points(found, np.array([-0.01, 0.01]), 0)) - RADIUS
    assert away[0].min() > -1e-12 and away[1, -1] > 0.0  # both ways the far end goes out


def test_clashes_agree_with_shapely() -> None:
    rng = np.random.default_rng(5)
    seen = {True: 0, False: 0}
    for _ in range(300):
        arcs = [
            Arc(2 * k, 2 * k + 1, *rng.uniform([0.0, 1.5], [6.0, 3.1]), RADIUS) for k in range(2)
        ]
        turns, shifts = rng.uniform(-3.0, 3.0, (1, 2)), rng.normal(0, 6, (1, 2, 2)) @ [1.0, 1j]
        poses = Poses(turns, shifts, np.zeros((1, 4), dtype=complex))
        lines = []
        for k, arc in enumerate(arcs):
            along = arc.start + turns[0, k] + arc.sweep * np.linspace(0.0, 1.0, 4000)
            z = shifts[0, k] + RADIUS * np.exp(1j * along)
            lines.append(LineString(np.stack([z.real, z.imag], axis=1)))
        found = bool(crossing(arcs[0], arcs[1], (0, 1), poses)[0])
        assert found == lines[0].intersects(lines[1])
        seen[found] += 1
    assert min(seen.values()) > 50


def test_a_clash_is_where_arcs_first_cross() -> None:
    found = motion(linkage([0.0, 50.0, 170.0, 290.0], abreast=True))
    for way in found.directions:
        assert way.clash is not None
        i, j = way.clash.links
        for step, meets in ((-1e-3, False), (1e-3, True)):
            x = np.array([way.sign * (way.clash.angle + step)])
            lines = []
            for k in (i, j):
                z = points(found, x, k, 4001)[0][1:-1]  # without the joints
                lines.append(LineString(np.stack([z.real, z.imag], axis=1)))
            assert lines[0].intersects(lines[1]) == meets
    apart = motion(linkage([0.0, 50.0, 170.0, 290.0]))
    assert [way.clash for way in apart.directions] == [None, None]


def test_links_that_cover_one_another_in_one_band_are_told() -> None:
    found = motion(linkage([0.0, 120.0, 40.0, 200.0], abreast=True))
    assert (0, 1) in found.overlaps
    assert "lie over each other" in found.notes[-1]


@pytest.mark.parametrize("n", [6, 8, 12])
def test_a_regular_ring_has_a_closed_form(n: int) -> None:
    """Triangle axis, P0, P1: its side L, its angles pi/n at the axis, beta +- x at the joints."""
    found = motion(linkage([360.0 * k / n for k in range(n)]))
    assert isinstance(found.drive, RingDrive)
    beta = 0.5 * math.pi - math.pi / n
    assert found.drive.reach == pytest.approx((-beta, beta), abs=1e-10)
    assert found.drive.ends == ("joints meet", "joints meet")
    x = np.linspace(-0.9 * beta, 0.9 * beta, 19)
    poses = found.drive.poses(x)
    length = 2.0 * RADIUS * math.sin(math.pi / n)
    for parity, angle in ((0, beta + x), (1, beta - x)):
        radius = length * np.sin(angle) / math.sin(2.0 * math.pi / n)
        np.testing.assert_allclose(
            np.abs(poses.joints[:, parity::2]), radius[:, None] + np.zeros(n // 2)
        )
    np.testing.assert_allclose(
        poses.turns,
        np.outer(x, np.tile([1.0, -1.0], n // 2)),
        atol=1e-13,
    )
    assert figures(found)["degrees_of_freedom"] == n - 3
    assert "not at a link" in found.notes[0]


def test_a_ring_of_two_lengths_keeps_them() -> None:
    degrees = [0.0, 25.0, 90.0, 115.0, 180.0, 205.0, 270.0, 295.0]
    for order in (degrees, [-angle for angle in degrees]):
        found = motion(linkage(order))
        assert isinstance(found.drive, RingDrive)
        low, high = found.drive.reach
        joints = found.drive.poses(np.linspace(low, high, 31)[1:-1]).joints
        sides = np.abs(np.roll(joints, -1, axis=1) - joints)
        chord = 2.0 * RADIUS * np.sin(np.radians([12.5, 32.5]))
        np.testing.assert_allclose(sides, np.tile(chord, 4) + 0.0 * sides, rtol=1e-12)
        np.testing.assert_allclose(
            np.roll(joints, -2, axis=1) / joints, joints[:, 2:3] / joints[:, :1] + 0 * joints
        )


def test_the_shorter_link_of_a_pair_goes_all_the_way_round() -> None:
    """The base of the triangle P0 P1 P2 is never shorter than b - a > 0: nothing stops it."""
    degrees = [0.0, 25.0, 90.0, 115.0, 180.0, 205.0, 270.0, 295.0]
    found = motion(linkage(degrees))
    assert isinstance(found.drive, RingDrive)
    assert found.drive.ends == ("whole turn", "whole turn")
    assert found.drive.reach == (-2.0 * math.pi, 2.0 * math.pi)
    seen = found.drive.poses(np.linspace(0.0, 2.0 * math.pi, 721))
    np.testing.assert_allclose(seen.joints[-1], seen.joints[0], atol=1e-12)
    a, b = 2.0 * RADIUS * np.sin(np.radians([12.5, 32.5]))
    base = np.abs(seen.joints[:, 2] - seen.joints[:, 0])
    assert (base.min(), base.max()) == pytest.approx((b - a, a + b), rel=1e-4)
    assert np.abs(np.diff(seen.joints, axis=0)).max() < 0.02 * RADIUS  # and goes on evenly


def test_the_longer_link_of_a_pair_stops_where_the_other_is_square_to_the_base() -> None:
    degrees = [0.0, 65.0, 90.0, 155.0, 180.0, 245.0, 270.0, 335.0]
    for order in (degrees, [-angle for angle in degrees]):
        found = motion(linkage(order))
        assert isinstance(found.drive, RingDrive)
        assert found.drive.ends == ("toggle", "toggle")
        for x in found.drive.reach:
            (joints,) = found.drive.poses(np.array([x])).joints
            other, base = joints[2] - joints[1], joints[2] - joints[0]
            assert abs((other * base.conjugate()).real) < 1e-6 * abs(other * base)
            beyond = found.drive.poses(np.array([x + math.copysign(1e-6, x)]))
            assert np.isnan(beyond.joints[:, :2]).all()


@pytest.mark.parametrize(
    "degrees", [[0, 100, 200], [0, 70, 140, 210, 280], [0, 20, 90, 140, 200, 300]]
)
def test_other_rings_are_left_alone_and_say_so(degrees: list[float]) -> None:
    found = motion(linkage(degrees))
    told = figures(found)
    assert found.drive is None and told["class"] is None
    assert told["degrees_of_freedom"] == len(degrees) - 3
    assert told["notes"]
    with pytest.raises(ValueError, match="one degree"):
        track(found, np.zeros(1))


@pytest.mark.parametrize("size", [1e-6, 1e6])
def test_size_does_not_matter(size: float) -> None:
    plain = figures(motion(linkage([33.9, 155.9, 172.5, 57.5], abreast=True)))
    scaled = figures(motion(linkage([33.9, 155.9, 172.5, 57.5], abreast=True).scaled(size)))
    for key in ("outside_deg", "inside_deg", "range_deg"):
        assert scaled[key] == pytest.approx(plain[key], abs=1e-7)
    assert scaled["mobility"] == plain["mobility"] == "both"
    assert scaled["class"] == plain["class"]


def test_a_square_is_a_change_point_linkage_and_says_so() -> None:
    found = motion(linkage([0.0, 90.0, 180.0, 270.0]))
    assert [way.end for way in found.directions] == ["change point", "change point"]
    assert [way.reach for way in found.directions] == pytest.approx([math.pi / 2, math.pi / 2])
    assert "two ways" in found.notes[0]
    coupler = found.departures[1]
    assert coupler.centre is None  # it only shifts
    assert coupler.least == pytest.approx(-coupler.largest)


def test_living_hinges_are_told_of() -> None:
    found = motion(replace(linkage([0.0, 50.0, 170.0, 290.0]), hinge="living"))
    assert "living hinges" in found.notes[-1]
