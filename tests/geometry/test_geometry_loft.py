"""Lofts: the developable through two rails, against closed forms and independent quadrature."""

import numpy as np
import pytest
from constructing import build
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter
from scipy.integrate import quad

from devcad.errors import GeometryError, JobError
from devcad.geometry import taylor
from devcad.geometry.chain import link
from devcad.geometry.classify import classify
from devcad.geometry.curve import Curve
from devcad.geometry.curves import CurveSpec
from devcad.geometry.loft.loft import creases, lofted, reversed_curve
from devcad.geometry.regularity import twist

SQUARE = [[100, 100, 0], [-100, 100, 0], [-100, -100, 0], [100, -100, 0]]


def loft(**table):
    (panel,) = build(kind="loft", **table).panels
    return panel


def polygon(number, radius, z, turn=0.0):
    angles = turn + 2 * np.pi * np.arange(number) / number
    points = [[radius * np.cos(a), radius * np.sin(a), z] for a in angles]
    return {"kind": "polyline", "points": points, "closed": True}


def round_at(radius, z, **more):
    return {"kind": "circle", "radius": radius, "center": [0, 0, z], **more}


def oval(radius, seed, tilt, centre):
    """A random convex closed curve, from its support function h(t) with h + h'' > 0."""
    rng = np.random.default_rng(seed)
    waves = np.arange(2, 7)
    t = np.linspace(0, 2 * np.pi, 400)
    while True:
        size = radius * rng.uniform(0, 0.6) * rng.dirichlet(np.ones(5)) / (waves**2 - 1)
        phase = rng.uniform(0, 2 * np.pi, 5)
        bends = radius + ((1 - waves**2) * size * np.cos(np.outer(t, waves) + phase)).sum(axis=1)
        if bends.min() > 0.05 * radius:
            break
    around = rng.uniform(0, 2 * np.pi)
    u = np.array([np.cos(around), np.sin(around), 0.0])
    v = np.cos(tilt) * np.cross([0, 0, 1.0], u) + np.sin(tilt) * np.array([0, 0, 1.0])

    def jet(t, order):
        x = taylor.variable(t, order)
        sine, cosine = taylor.sin_cos(x)
        h, slope = taylor.constant(radius, order, t.size), taylor.constant(0.0, order, t.size)
        for k, a, p in zip(waves, size, phase, strict=True):
            wave = k * x
            wave[0] += p
            s, c = taylor.sin_cos(wave)
            h, slope = h + a * c, slope - a * k * s
        x, y = (
            taylor.mul(h, cosine) - taylor.mul(slope, sine),
            taylor.mul(h, sine) + taylor.mul(slope, cosine),
        )
        out = x[..., None] * u + y[..., None] * v
        out[0] += centre
        return out

    return Curve(jet, (0.0, 2 * np.pi), closed=True)


def figures(made):
    """Largest twist, largest crease in degrees, and whether the chain closes."""
    chain = link(made.patches, base_closed=made.closed, tolerance=0.05)
    joints = [*chain.joints, *([chain.closing] if chain.closing else [])]
    turned = max((abs(np.degrees(j.angle)) for j in joints), default=0.0)
    return max(np.degrees(twist(p).value) for p in made.patches), turned, chain.closed


def convex_pair(seed):
    rng = np.random.default_rng(10_000 + seed)
    tilts = rng.uniform(0, np.radians(35), 2)
    radii = rng.uniform(50, 150, 2)
    above = np.array([*rng.uniform(-40, 40, 2), rng.uniform(120, 300)])
    return (
        oval(radii[0], 2 * seed, tilts[0], np.zeros(3)),
        oval(radii[1], 2 * seed + 1, tilts[1], above),
    )


@pytest.mark.parametrize("seeds", [range(12), pytest.param(range(200), marks=pytest.mark.slow)])
def test_random_convex_closed_pairs_have_an_exact_loft(seeds):
    # two convex curves in planes tilted by 35 degrees at most: their hull's band is developable
    worst = [figures(lofted(*convex_pair(seed))) for seed in seeds]
    exact = [w < 1e-9 and crease < 1e-6 and closed for w, crease, closed in worst]
    assert np.mean(exact) >= 0.995, [s for s, ok in zip(seeds, exact, strict=True) if not ok]


@pytest.mark.parametrize(
    "rails",
    [
        [{"kind": "ellipse", "radii": [100, 60]}, round_at(40, 140)],
        [{"kind": "circle", "radius": 60}, round_at(35, 110, normal=[0.5, 0.2, 1])],
        [{"kind": "polyline", "points": SQUARE, "closed": True}, round_at(60, 120)],
        [
            {"kind": "polyline", "points": SQUARE, "closed": True, "corner_radius": 10},
            round_at(60, 120),
        ],
        [polygon(3, 100, 0), polygon(6, 60, 120)],
        [polygon(4, 100, 0), polygon(4, 60, 120, np.pi / 4)],
        [polygon(4, 100, 0), round_at(50, 120, normal=[0, 0.5, 1])],
    ],
    ids=["ellipse", "skew", "square", "rounded", "triangle-hexagon", "turned-square", "tilted"],
)
def test_where_a_developable_exists_the_rulings_are_its_own(rails):
    panel = loft(rails=rails)
    assert panel.figures["warp_deg"].value <= 1e-9
    assert panel.figures["share_quasi"].value == 0.0
    assert panel.rail_fit.crease <= 1e-6  # folds only where corners ask for them
    assert link(panel.patches, base_closed=True, tolerance=0.05).closed


def test_square_to_round_is_four_triangles_and_four_cones():
    r, h = 60.0, 120.0
    panel = loft(rails=[{"kind": "polyline", "points": SQUARE, "closed": True}, round_at(r, h)])
    kinds = [classify(patch).type for patch in panel.patches]
    assert sorted(kinds) == ["cone"] * 4 + ["plane"] * 4
    triangle = 0.5 * 200.0 * np.hypot(100.0 - r, h)

    def sector(a):  # half the length of ray x its turning, from the corner (100, 100, 0)
        ray = np.array([r * np.cos(a) - 100, r * np.sin(a) - 100, h])
        return 0.5 * np.linalg.norm(np.cross(ray, [-r * np.sin(a), r * np.cos(a), 0.0]))

    cone = quad(sector, 0, np.pi / 2, epsabs=1e-10)[0]
    found = sum(area(patch) for patch in panel.patches)
    assert found == pytest.approx(4 * (triangle + cone), rel=1e-9)
    assert panel.rail_fit.largest_crease <= 1e-6


def area(patch):
    """Gauss quadrature of |P_t x P_v| from the patch's own points."""
    x, w = np.polynomial.legendre.leggauss(60)
    low, high = patch.domain
    t = low + 0.5 * (high - low) * (x + 1)
    jet = patch.jet(t, 1)
    total = 0.0
    for y, weight in zip(*np.polynomial.legendre.leggauss(8), strict=True):
        v = jet.v_from[0] + 0.5 * (jet.v_to[0] - jet.v_from[0]) * (y + 1)
        across = np.cross(jet.c0[1] + v[:, None] * jet.e[1], jet.e[0])
        total += weight * 0.5 * (jet.v_to[0] - jet.v_from[0]) @ (w * np.linalg.norm(across, axis=1))
    return 0.5 * (high - low) * total


def test_a_quarter_of_the_oloid():
    # between the two arcs every ruling has the length sqrt(3), and the quarter the area pi
    s = np.sqrt(3.0) / 2.0
    panel = loft(
        rails=[
            {**round_at(1, 0, sweep=120, x_axis=[0, -1, 0]), "center": [0, -0.5, 0]},
            {
                "kind": "circle",
                "radius": 1,
                "center": [0, 0.5, 0],
                "normal": [-1, 0, 0],
                "x_axis": [0, -0.5, s],
                "sweep": 120,
            },
        ]
    )
    (patch,) = panel.patches
    lengths = patch.jet(np.linspace(*patch.domain, 101), 0).v_to[0]
    np.testing.assert_allclose(lengths, np.sqrt(3.0), rtol=1e-12)
    assert area(patch) == pytest.approx(np.pi, rel=1e-9)
    assert panel.figures["warp_deg"].value <= 1e-9


def test_the_oblique_transition_of_two_circles_is_their_cone():
    (patch,) = loft(rails=[round_at(2, 0), {**round_at(1, 3), "center": [1, 0, 3]}]).patches
    shape = classify(patch)
    assert shape.type == "cone"
    np.testing.assert_allclose(shape.point, [2, 0, 6], atol=1e-10)  # oracle O44
    assert area(patch) == pytest.approx(30.467984200264393, rel=1e-9)


def test_starts_and_senses_of_closed_rails_do_not_matter():
    base = {"kind": "ellipse", "radii": [100, 60]}
    areas = []
    for sweep, start in ((360, 0), (-360, 0), (360, 77), (-360, 200)):
        panel = loft(rails=[base, round_at(40, 140, sweep=sweep, start=start)])
        assert panel.figures["warp_deg"].value <= 1e-9
        areas.append(sum(area(patch) for patch in panel.patches))
    np.testing.assert_allclose(areas, areas[0], rtol=1e-8)  # of the quadrature, on other panels


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(
    scale=st.sampled_from([1e-3, 1.0, 1e4]),
    turn=st.floats(0, 2 * np.pi),
    seed=st.integers(0, 50),
    backwards=st.booleans(),
)
def test_motion_scale_and_reversal_leave_the_loft(scale, turn, seed, backwards):
    first, second = convex_pair(seed)
    c, s = np.cos(turn), np.sin(turn)
    moves = scale * np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def moved(curve):
        return Curve(lambda t, k: curve.jet(t, k) @ moves.T, curve.domain, closed=True)

    again = (moved(first), moved(second))
    if backwards:
        again = tuple(reversed_curve(curve) for curve in again)
    here, there = lofted(first, second), lofted(*again)
    sizes = [sum(area(p) for p in made.patches) for made in (here, there)]
    assert sizes[1] == pytest.approx(scale**2 * sizes[0], rel=1e-7)  # the quadrature's accuracy
    assert figures(there)[0] < 1e-9


def test_ship_plates_end_in_fans_and_do_not_warp():
    keel = [[0, 0, 60], [1200, 0, 10], [2400, 0, 5], [3500, 0, 80], [4200, 0, 230]]
    chine = [[0, 520, 150], [1200, 585, 120], [2400, 570, 135], [3500, 415, 235], [4200, 175, 375]]
    rails = [{"kind": "points", "points": keel}, {"kind": "points", "points": chine}]
    panel = loft(rails=rails)
    assert panel.figures["warp_deg"].value <= 1e-9
    assert panel.figures["share_fan"].value > 0.0
    assert panel.rail_fit.crease <= 1e-6
    trimmed = loft(rails=rails, trim=True)
    assert trimmed.figures["share_fan"].value == 0.0
    assert trimmed.figures["warp_deg"].value <= 1e-9


def test_a_concave_corner_folds_and_says_so():
    corner = [[0, 0, 0], [100, 0, 0], [100, 50, 0], [50, 50, 0], [50, 100, 0], [0, 100, 0]]
    panel = loft(
        rails=[
            {"kind": "polyline", "points": corner, "closed": True},
            {**round_at(40, 120), "center": [40, 40, 120]},
        ]
    )
    assert panel.figures["warp_deg"].value <= 1e-9
    assert panel.rail_fit.largest_crease > 45.0  # through the concave corner
    assert panel.rail_fit.crease <= 1e-6


BOWED = [
    {"kind": "expression", "x": "60*sin(t)", "y": f"{s}*(60*cos(t) - 60)", "z": z, "t": [-0.7, 0.7]}
    for s, z in ((1, "0"), (-1, "50"))
]
COAXIAL = [
    {"kind": "expression", "x": f"{r}*cos(t)", "y": f"{r}*sin(t)", "z": "10*t", "t": [0, 6.28]}
    for r in (50, 25)
]


def isoparametric_warp(rails):
    """The turn of the tangent plane between equal parameters, by differences."""
    t = np.linspace(*rails[0]["t"], 201)
    a, b = (
        np.stack(
            [eval(r[k], {"sin": np.sin, "cos": np.cos, "t": t}) + 0.0 * t for k in "xyz"], axis=1
        )
        for r in rails
    )
    d = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
    p, q = (np.gradient(x, t, axis=0, edge_order=2) for x in (a, b))
    p, q = (x - (x * d).sum(axis=1)[:, None] * d for x in (p, q))
    turn = np.arctan2((d * np.cross(p, q)).sum(axis=1), (p * q).sum(axis=1))
    return np.degrees(np.abs(turn).max())


@pytest.mark.parametrize("rails", [BOWED, COAXIAL], ids=["bowed", "helices"])
def test_where_none_exists_the_least_warp_is_told(rails):
    # both pairs are symmetric: no matching beats equal parameters
    expected = isoparametric_warp(rails)
    panel = loft(rails=rails, fans=False)
    assert panel.figures["warp_deg"].value == pytest.approx(expected, rel=0.02)
    assert panel.figures["share_quasi"].value == pytest.approx(1.0)
    assert "without fans" in panel.rail_fit.advice
    assert loft(rails=rails).figures["warp_deg"].value == pytest.approx(expected, rel=0.02)


@pytest.mark.slow
def test_a_rail_that_may_move_makes_a_developable():
    panel = loft(rails=BOWED, relax="rail-b", relax_max=20)
    assert panel.figures["warp_deg"].value <= 1e-6
    assert 0.0 < panel.rail_fit.relaxed <= 20.0
    # the first rail stays where it is
    x = np.concatenate([patch.point(patch.domain, [0.0, 0.0]) for patch in panel.patches])
    np.testing.assert_allclose(x[:, 1], 60 * np.cos(np.arcsin(x[:, 0] / 60)) - 60, atol=1e-9)
    with pytest.raises(GeometryError, match="relax") as caught:
        build(kind="loft", rails=BOWED, relax="rail-b", relax_max=0.5)
    assert caught.value.remedy


def test_whole_circles_of_an_oloid_are_refused_by_name():
    with pytest.raises(GeometryError, match="no closed matching") as caught:
        loft(
            rails=[
                {**round_at(1, 0), "center": [0, -0.5, 0]},
                {**round_at(1, 0, normal=[1, 0, 0]), "center": [0, 0.5, 0]},
            ]
        )
    assert "oloid" in caught.value.remedy
    assert "edge-surface" in caught.value.remedy


def test_rulings_that_the_designer_fixes_are_among_them():
    rails = [
        {"kind": "circle", "radius": 100, "sweep": 120},
        {"kind": "circle", "radius": 60, "sweep": 120, "center": [0, 0, 80]},
    ]
    fixed = [[1.0, 1.0]]
    panel = loft(rails=rails, rulings=fixed)
    # this one is a ruling of their cone: nothing warps, and it is one of the chain's
    assert panel.figures["warp_deg"].value <= 1e-9
    there = 100 * np.array([np.cos(1.0), np.sin(1.0), 0.0])
    on_rail = [
        np.linalg.norm(patch.point(t, 0 * t) - there, axis=1).min()
        for patch in panel.patches
        for t in [np.linspace(*patch.domain, 4001)]
    ]
    assert min(on_rail) < 0.1
    with pytest.raises(JobError, match="rulings"):
        loft(rails=rails, rulings=[[9.0, 1.0]])


def test_creases_lie_where_corners_ask_for_them():
    first = build(kind="loft", rails=[polygon(3, 100, 0), polygon(6, 60, 120)])
    made = first.panels[0]
    assert made.rail_fit.largest_crease > 30.0
    assert made.rail_fit.crease == 0.0
    pair = convex_pair(3)
    assert all(fold.angle < 1e-6 for fold in creases(lofted(*pair)))


def test_polygons_that_run_against_one_another_are_turned():
    upper = [[60, 50, 90], [-60, 50, 90], [-60, -50, 90], [60, -50, 90]]
    areas = []
    for points in (upper, upper[::-1]):
        panel = loft(
            rails=[{"kind": "polyline", "points": p, "closed": True} for p in (SQUARE, points)]
        )
        assert panel.figures["share_plane"].value == pytest.approx(1.0)
        areas.append(sum(area(patch) for patch in panel.patches))
    assert areas[1] == pytest.approx(areas[0], rel=1e-12)


def test_a_curve_run_backwards_answers_on_the_other_side_of_its_corners():
    corners = {"kind": "polyline", "points": [[0, 0, 0], [1, 0, 0], [1, 3, 0], [1, 3, 7]]}
    curve = TypeAdapter(CurveSpec).validate_python(corners).curve()
    back = reversed_curve(curve)
    for corner in back.corners:
        before, after = back.jet(np.array([np.nextafter(corner, 0), corner]), 1)[1]
        assert abs(before @ after) <= 1e-12 * np.linalg.norm(before) * np.linalg.norm(after)
    np.testing.assert_allclose(back.point([0.0, 1.0]), curve.point([1.0, 0.0]), atol=1e-15)


@pytest.mark.parametrize(
    ("rails", "words"),
    [
        ([round_at(50, 0), round_at(50, 0)], "meet"),
        ([round_at(50, 0), round_at(30, 0)], "one plane"),
        (
            [
                {"kind": "line", "from": [0, 0, 0], "to": [9, 0, 0]},
                {"kind": "line", "from": [0, 0, 0], "to": [9, 5, 2]},
            ],
            "meet",
        ),
    ],
    ids=["the same", "coplanar", "from one point"],
)
def test_rails_without_a_sheet_between_are_refused(rails, words):
    with pytest.raises(GeometryError, match=words) as caught:
        loft(rails=rails)
    assert caught.value.remedy


def test_fixed_rulings_of_no_developable_are_refused():
    arcs = [round_at(50, z, sweep=90) for z in (0, 60)]
    with pytest.raises(GeometryError, match="none of the developable"):
        loft(rails=arcs, rulings=[[0.2, 0.8]])
    with pytest.raises(JobError, match="cross"):
        loft(rails=arcs, rulings=[[0.2, 0.8], [0.8, 0.2]])
