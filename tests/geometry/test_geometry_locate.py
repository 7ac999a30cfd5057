"""Where points and lines lie on a surface, against the places they were made from."""

import time

import numpy as np
import pytest
from patches import ellipse_cylinder, frustum, gore, helix_tangent, prism

from devcad.flatten.development import develop_chain
from devcad.geometry.chain import Chain, link
from devcad.geometry.locate import along_lines, nearest, on_plane
from devcad.geometry.taylor import Array

CHAINS = {
    "cylinder": (frustum(50.0, 50.0, 100.0),),
    "frustum": (frustum(),),
    "cone with its apex": (frustum(100.0, 0.0, 120.0),),
    "tangent surface": (helix_tangent(50.0, 30.0, 300.0, (5.0, 60.0)),),
    "tangent surface near its regression curve": (helix_tangent(50.0, 30.0, 90.0, (0.05, 60.0)),),
    "ellipse cylinder": (ellipse_cylinder(300.0, 200.0, 100.0),),
    "gore": (gore(),),
    "prism": prism(np.array([(0.0, 0.0), (80.0, 0.0), (100.0, 50.0), (0.0, 90.0)]), 60.0),
}


def chained(name: str) -> Chain:
    return link(CHAINS[name], base_closed=True, tolerance=1e-3)


def places(chain: Chain, number: int) -> tuple[Array, Array, Array, Array]:
    """Random places on a chain: patch, t, v, and the points in space."""
    random = np.random.default_rng(7)
    patch = random.integers(len(chain.patches), size=number)
    t, v, points = np.empty(number), np.empty(number), np.empty((number, 3))
    for k, strip in enumerate(chain.patches):
        own = patch == k
        low, high = strip.domain
        t[own] = random.uniform(low, high, own.sum())
        jet = strip.jet(t[own], 0)
        share = random.uniform(0.02, 0.98, own.sum())
        v[own] = (1.0 - share) * jet.v_from[0] + share * jet.v_to[0]
        points[own] = strip.point(t[own], v[own])
    return patch, t, v, points


def flat(chain: Chain, patch: Array, t: Array, v: Array) -> Array:
    """The images of places in the pattern."""
    developments = develop_chain(chain)
    out = np.empty((len(t), 2))
    for k, development in enumerate(developments):
        own = patch == k
        out[own] = development.points(t[own], v[own])
    return out


@pytest.mark.parametrize("name", CHAINS)
def test_points_of_the_pattern_are_located_where_they_come_from(name: str) -> None:
    chain = chained(name)
    patch, t, v, points = places(chain, 2000)
    found = on_plane(chain.patches, develop_chain(chain), flat(chain, patch, t, v))
    assert found.inside.all()
    assert (found.patch == patch).all()
    for k, strip in enumerate(chain.patches):
        own = patch == k
        there = strip.point(found.t[own], found.v[own])
        # rounding of coordinates of some hundred mm
        assert np.abs(there - points[own]).max(initial=0.0) < 1e-10


@pytest.mark.parametrize("name", ["cylinder", "frustum", "tangent surface", "ellipse cylinder"])
def test_points_outside_the_extent_are_told_from_those_inside(name: str) -> None:
    """A distance along the ruling is a distance in the pattern, so ``beyond`` is known."""
    chain = chained(name)
    patch, t, _, _ = places(chain, 500)
    jet = chain.patches[0].jet(t, 0)
    for out in (1e-9, 1e-3, 0.5):
        for v in (jet.v_to[0] + out, jet.v_from[0] - out):
            found = on_plane(chain.patches, develop_chain(chain), flat(chain, patch, t, v))
            assert not found.inside.any()
            assert found.beyond == pytest.approx(np.full(len(t), out), abs=1e-11)


def test_points_before_the_first_and_behind_the_last_ruling_have_no_place() -> None:
    chain = link((frustum(50.0, 50.0, 100.0, 1.0),), base_closed=False, tolerance=1e-3)
    x = np.linspace(1.0, 99.0, 20)
    for y, inside in ((-1e-6, False), (1e-6, True), (50.0 - 1e-6, True), (50.0 + 1e-6, False)):
        points = np.column_stack([x, np.full(20, y)])
        found = on_plane(chain.patches, develop_chain(chain), points)
        assert (found.inside == inside).all()
        assert ((found.patch >= 0) == inside).all()
        assert (np.isnan(found.t) == (not inside)).all()


@pytest.mark.parametrize("name", CHAINS)
def test_lines_meet_the_surface_where_they_were_drawn_through_it(name: str) -> None:
    chain = chained(name)
    patch, _, v, points = places(chain, 500)
    direction = np.random.default_rng(8).normal(size=points.shape)
    hits = along_lines(chain, points, direction)
    at = points[hits.line] + hits.along[:, None] * direction[hits.line]
    for k, strip in enumerate(chain.patches):
        own = hits.patch == k
        there = strip.point(hits.t[own], hits.v[own])
        # a line along the surface meets it less sharply
        near = np.abs(at[own]).max(axis=1) < 1e3
        assert np.abs(there - at[own])[near].max(initial=0.0) < 1e-7
    home = np.abs(hits.along) < 1e-8
    assert (np.bincount(hits.line[home], minlength=500) >= 1).all()
    same = home & (hits.patch == patch[hits.line])
    assert np.abs(hits.v[same] - v[hits.line[same]]).max() < 1e-6
    assert (hits.beyond[home] == 0.0).all()


def test_a_line_across_a_tube_meets_it_twice() -> None:
    chain = chained("cylinder")
    points = np.array([[0.0, 20.0, 30.0]])
    hits = along_lines(chain, points, np.array([[2.0, 0.0, 0.0]]))
    half = np.sqrt(50.0**2 - 20.0**2) / 2.0  # in units of the direction, which is 2 mm long
    assert hits.along == pytest.approx([-half, half], rel=1e-14)
    assert hits.v == pytest.approx([30.0, 30.0])
    assert not len(along_lines(chain, points, np.array([[0.0, 0.0, 1.0]])).t)


@pytest.mark.parametrize("name", ["cylinder", "frustum", "tangent surface", "ellipse cylinder"])
@pytest.mark.parametrize("distance", [0.0, 1e-3, -2.0])
def test_the_foot_of_a_point_on_a_normal_is_its_base(name: str, distance: float) -> None:
    chain = chained(name)
    strip = chain.patches[0]
    _, t, _, points = places(chain, 300)
    found, away = nearest(chain, points + distance * strip.frame(t).n)
    assert away == pytest.approx(np.full(300, abs(distance)), abs=1e-10)
    assert np.abs(strip.point(found.t, found.v) - points).max() < 1e-9


@pytest.mark.parametrize("name", CHAINS)
def test_no_place_is_nearer_than_the_nearest(name: str) -> None:
    chain = chained(name)
    random = np.random.default_rng(9)
    _, _, _, points = places(chain, 3000)
    asked = points[:40] + random.normal(scale=40.0, size=(40, 3))
    found, away = nearest(chain, asked)
    seen = np.linalg.norm(asked[:, None] - points, axis=2).min(axis=1)
    assert (away <= seen + 1e-9).all()
    for k, strip in enumerate(chain.patches):
        own = found.patch == k
        there = strip.point(found.t[own], found.v[own])
        assert np.linalg.norm(there - asked[own], axis=1) == pytest.approx(away[own], abs=1e-9)


@pytest.mark.bench
def test_fifty_thousand_points_are_located_in_the_time_of_a_few_products() -> None:
    """52 000 points cost less than 60 products of 52 000 x 64 numbers, a second on any machine."""
    chain = chained("frustum")
    patch, t, v, _ = places(chain, 52_000)
    points, developments = flat(chain, patch, t, v), develop_chain(chain)
    big = np.random.default_rng(1).normal(size=(52_000, 64))
    start = time.process_time()
    for _ in range(60):
        np.sqrt(big * big + 1.0)
    unit = time.process_time() - start
    start = time.process_time()
    on_plane(chain.patches, developments, points)
    assert time.process_time() - start < unit
