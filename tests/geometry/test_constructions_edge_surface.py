"""Edge surface, oloid, sphericon: bitangent pairs against closed forms and convex hulls."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from constructing import area, build, gauss, inside, patches, refusal
from pydantic import TypeAdapter
from scipy.spatial import ConvexHull

from devcad.flatten.development import develop_chain
from devcad.geometry.bitangents.bitangent import Pairs
from devcad.geometry.bitangents.families import families
from devcad.geometry.bitangents.monotone import pieces
from devcad.geometry.bitangents.rails import rail
from devcad.geometry.chain import link
from devcad.geometry.curves import CurveSpec
from devcad.geometry.regularity import warp

CURVE = TypeAdapter(CurveSpec)
TURN = [0, "2*pi"]


def formula(x, y, z, t=TURN):
    return {"kind": "expression", "x": x, "y": y, "z": z, "t": t}


def circle(**keys):
    return {"kind": "circle", **keys}


SADDLE = formula("cos(t)", "sin(t)", "cos(2*t)")
THREEFOLD = formula("cos(t)", "sin(t)", "0.5*cos(3*t)")
CUBIC = formula("cos(t)", "sin(2*t)", "cos(3*t)", [-1.2, 1.2])
ANGLES = np.arange(24) * np.pi / 12
RING = np.column_stack([np.cos(ANGLES), np.sin(ANGLES), 0.5 * np.cos(2 * ANGLES)])
SPLINE = {"kind": "points", "points": RING.tolist(), "closed": True}
TWO_CIRCLES = [
    circle(radius=1, center=[0, -0.5, 0]),
    circle(radius=1, center=[0, 0.5, 0], normal=[1, 0, 0]),
]
SKEW = [
    circle(radius=1, center=[0.1, -0.5, 0]),
    {"kind": "ellipse", "radii": [1.5, 0.8], "center": [0.2, 0.4, 0.3], "normal": [1, 0.3, 0.2]},
]
INCLINED = [
    {"kind": "ellipse", "radii": [3, 2]},
    {"kind": "ellipse", "radii": [2, 1], "center": [0.5, 0.2, 3], "normal": [0.3, 0.1, 1]},
]
KNOT = formula("(3 + cos(3*t))*cos(2*t)", "(3 + cos(3*t))*sin(2*t)", "sin(3*t)")


def pairs_of(*specs):
    rails = [rail(CURVE.validate_python(spec).curve()) for spec in specs]
    return Pairs(rails[0], rails[-1], len(rails) == 1)


def volume(parts):
    """A third of the flux of the position through patches: their share of what they enclose."""
    total = 0.0
    for patch in parts:
        t, weight = gauss(patch)
        f = patch.frame(t)
        width = f.q * (f.v_to - f.v_from) + 0.5 * f.a * (f.v_to**2 - f.v_from**2)
        total += weight @ (width * np.einsum("ij,ij->i", f.c0, f.n)) / 3.0
    return float(total)


def hull_of(specs, number):
    curves = [CURVE.validate_python(spec).curve() for spec in specs]
    points = [curve.point(np.linspace(*curve.domain, number)) for curve in curves]
    return ConvexHull(np.concatenate(points))


# --- the pairs -----------------------------------------------------------------------------


def test_the_deflated_determinant_of_the_saddle_curve_is_a_product_of_sines():
    # by hand: G = sin(s + t) sin^4((t - s)/2) x 8, so H = G / (t - s)^4
    rng = np.random.default_rng(1)
    s, half = rng.uniform(0, 6.28, 500), 10 ** rng.uniform(-9, 0.19, 500)
    value = pairs_of(SADDLE).value(s, s + 2 * half)
    expected = 0.5 * np.sin(2 * (s + half)) * np.sinc(half / np.pi) ** 4
    np.testing.assert_allclose(value, expected, rtol=0, atol=4e-15)


def test_on_the_diagonal_it_is_the_torsion_and_breaks_do_not_disturb_it():
    pairs = pairs_of(SPLINE)
    t = np.linspace(0.003, 0.997, 77)
    jet = pairs.first.jet(t, 3)
    torsion = np.linalg.det(np.moveaxis(jet[1:], 0, 1))
    size = np.abs(torsion).max()
    np.testing.assert_allclose(pairs.value(t, t), torsion, rtol=0, atol=1e-13 * size)
    # over a knot, near and far formulas agree at the same place
    knot = pairs.first.curve.breaks[3]
    s, u = knot - np.array([0.011]), knot + np.array([0.006])
    near = np.array(pairs.first._close(s[None], u[None], 3))[:, 0, 0]
    far = np.array(pairs.first._far(s[None], u[None], 3))[:, 0, 0]
    np.testing.assert_allclose(near, far, rtol=0, atol=1e-11 * np.abs(far).max())


@pytest.mark.parametrize(
    "specs",
    [[SADDLE], [THREEFOLD], [SPLINE], [CUBIC], [KNOT], TWO_CIRCLES, SKEW, INCLINED],
    ids=["saddle", "threefold", "spline", "open", "knot", "circles", "skew", "inclined"],
)
def test_pairs_are_bitangent_to_rounding_and_so_are_their_derivatives(specs):
    pairs = pairs_of(*specs)
    for path in families(pairs):
        for piece in pieces(pairs, path):
            sigma = np.linspace(*piece.domain, 301)[1:-1]
            s, t = piece.at(sigma, 1)
            value = pairs.value(s[0], t[0])
            assert (np.abs(value) <= 1e-13 * pairs.size(s[0], t[0])).all()
            # the slope along the branch against the gradient (at nodes both vanish); on the
            # knot's short pieces the rounding of t itself, 1e-15 of 0.1, times the degree squared
            _, gradient = pairs.slopes(s[0], t[0])
            along = np.abs((gradient * np.column_stack([s[1], t[1]])).sum(axis=1))
            across = np.abs(gradient).max()
            assert (along <= 5e-11 * across).all()
            # both are monotone
            assert min(s[1].max(), -s[1].min()) <= 1e-9
            assert min(t[1].max(), -t[1].min()) <= 1e-9


def test_the_families_of_the_saddle_curve_are_its_two_reflections():
    # (t, -t) and (t, pi - t), each pair once, from tip to tip
    pairs = pairs_of(SADDLE)
    sums = []
    for path in families(pairs):
        (piece,) = pieces(pairs, path)
        s, t = (x[0] for x in piece.at(np.linspace(*piece.domain, 50), 0))
        sums.append(np.mod(s + t, 2 * np.pi))
        assert abs(s[-1] - s[0]) == pytest.approx(np.pi, abs=1e-12)
    np.testing.assert_allclose(np.sin(sums[0]), 0.0, atol=1e-13)
    np.testing.assert_allclose(np.cos(sums[0]), 1.0, atol=1e-13)
    np.testing.assert_allclose(np.cos(sums[1]), -1.0, atol=1e-13)


def test_families_that_cross_go_straight_on_through_the_nodes():
    # antipodal pairs (t, t + pi) cross the three reflections
    pairs = pairs_of(THREEFOLD)
    found = families(pairs)
    antipodal = [path for path in found if path.flips]
    assert len(found) == 4
    assert len(antipodal) == 1
    for path in found:
        for piece in pieces(pairs, path):
            s, t = (x[0] for x in piece.at(np.linspace(*piece.domain, 201), 0))
            if path.flips:
                np.testing.assert_allclose(t - s, np.pi, atol=1e-12)
            else:
                np.testing.assert_allclose(np.sin(1.5 * (s + t)), 0.0, atol=1e-12)


def test_helix_pairs_are_a_constant_apart():
    # generators of the cylinder, 2 pi k apart, and tan h = h with 2 h = 8.9868
    pairs = pairs_of({"kind": "helix", "radius": 1, "pitch": 1, "turns": 3})
    gaps = [path.places[:, 1] - path.places[:, 0] for path in families(pairs)]
    assert all(np.ptp(gap) < 1e-5 for gap in gaps)
    expected = [2 * np.pi, 2 * 4.493409457909064, 4 * np.pi, 2 * 7.725251836937707]
    np.testing.assert_allclose([gap.mean() for gap in gaps], expected, atol=1e-6)


# --- surfaces ------------------------------------------------------------------------------


def test_saddle_sheets_lie_on_their_parabolic_cylinders():
    panels = build(kind="edge-surface", curves=[SADDLE]).panels
    cylinders = (lambda p: p[:, 2] - 2 * p[:, 0] ** 2 + 1, lambda p: p[:, 2] - 1 + 2 * p[:, 1] ** 2)
    u = (np.arange(200) + 0.5) * np.pi / 200  # 2 sin^2 sqrt(1 + 16 cos^2), a periodic mean
    expected = float((2 * np.sin(u) ** 2 * np.sqrt(1 + 16 * np.cos(u) ** 2)).mean() * np.pi)
    for panel, cylinder in zip(panels, cylinders, strict=True):
        (patch,) = panel.patches
        t = inside(patch, 60)
        jet = patch.jet(t, 0)
        for share in (0.0, 0.3, 1.0):
            assert np.abs(cylinder(patch.point(t, share * jet.v_to[0]))).max() <= 1e-13
        assert area(patch) == pytest.approx(expected, rel=1e-12)
        assert jet.v_to[0][[0, -1]] == pytest.approx([0.0, 0.0], abs=1e-14)


def test_the_surface_of_cos_t_sin_2t_cos_3t_contains_a_cubic_cylinder():
    # Ranestad and Sturmfels: z = 4 x^3 - 3 x, rulings along y
    (patch,) = patches(kind="edge-surface", curves=[CUBIC])
    t = inside(patch, 60)
    for share in (0.0, 0.5, 1.0):
        x, _, z = patch.point(t, share * patch.jet(t, 0).v_to[0]).T
        np.testing.assert_allclose(z, 4 * x**3 - 3 * x, atol=1e-13)


@pytest.mark.parametrize("specs", [TWO_CIRCLES, SKEW, [SADDLE]], ids=["oloid", "skew", "saddle"])
def test_area_and_volume_are_those_of_the_convex_hull(specs):
    # no flat faces here; the hull of n points is short by 1/n^2
    panels = build(kind="edge-surface", curves=specs, hull=True).panels
    parts = [patch for panel in panels for patch in panel.patches]
    exact = np.array([sum(map(area, parts)), volume(parts)])
    missing = []
    for number in (400, 800):
        hull = hull_of(specs, number)
        missing.append(exact - [hull.area, hull.volume])
    assert (missing[1] > 0.0).all()
    assert (missing[1] < 1e-3 * exact).all()
    # the order of the volume; areas of polyhedra inscribed in a tip's cylinder vary with it
    assert missing[0][1] / missing[1][1] == pytest.approx(4.0, rel=0.1)


def test_hull_arcs_end_at_planes_that_touch_three_points():
    # the threefold curve's hull: six arcs and two equilateral triangles of side sqrt 3
    panels = build(kind="edge-surface", curves=[THREEFOLD], hull=True).panels
    assert len(panels) == 6
    ends = []
    for panel in panels:
        (patch,) = panel.patches
        jet = patch.jet(np.array(patch.domain), 0)
        last = int(np.argmax(jet.v_to[0]))
        ends.append(jet.v_to[0][last])
        assert jet.v_to[0][1 - last] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(ends, np.sqrt(3), rtol=1e-11)
    total = sum(area(panel.patches[0]) for panel in panels) + 2 * np.sqrt(27) / 4
    assert total == pytest.approx(hull_of([THREEFOLD], 1600).area, rel=1e-5)


def test_the_rims_of_a_transition_and_its_volume():
    (panel,) = build(kind="edge-surface", curves=INCLINED, hull=True).panels
    assert panel.base_closed
    # with the two flat ends, areas 6 pi and 2 pi, it is the convex hull
    hull = hull_of(INCLINED, 1500)
    assert sum(map(area, panel.patches)) + 8 * np.pi == pytest.approx(hull.area, rel=1e-5)


def test_the_hull_of_two_circles_has_the_pairs_of_the_oloid():
    (panel,) = build(kind="edge-surface", curves=TWO_CIRCLES, hull=True).panels
    assert panel.base_closed
    for patch in panel.patches:
        jet = patch.jet(inside(patch), 0)
        np.testing.assert_allclose(jet.v_to[0], np.sqrt(3), rtol=1e-13)
        x, y, _ = jet.c0[0].T
        _, v, w = jet.rail(jet.v_to)[0].T
        # (1 + cos alpha)(1 + cos beta) = 1
        np.testing.assert_allclose((0.5 - y) * (0.5 + v), 1.0, atol=1e-13)
        np.testing.assert_allclose([x**2 + (y + 0.5) ** 2, w**2 + (v - 0.5) ** 2], 1, atol=1e-13)


def test_components_are_counted_by_their_smallest_parameter():
    both = build(kind="edge-surface", curves=[SADDLE]).panels
    for number in (1, 2):
        (one,) = build(kind="edge-surface", curves=[SADDLE], component=number).panels
        assert one.patches[0].domain == both[number - 1].patches[0].domain
    assert both[0].patches[0].domain[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("scale", [1e-4, 1e6])
def test_size_and_place_do_not_matter(scale):
    curve = formula(f"{scale}*(7 + cos(t))", f"{scale}*sin(t)", f"{scale}*cos(2*t)")
    one = [area(p.patches[0]) for p in build(kind="edge-surface", curves=[curve]).panels]
    two = [area(p.patches[0]) for p in build(kind="edge-surface", curves=[SADDLE]).panels]
    np.testing.assert_allclose(one, np.array(two) * scale**2, rtol=1e-11)


def test_a_spline_through_the_saddle_comes_close_to_it_and_is_developable():
    for panel in build(kind="edge-surface", curves=[SPLINE]).panels:
        (patch,) = panel.patches
        t = inside(patch, 400)[1:-1]
        assert np.degrees(np.abs(warp(patch, t))).max() <= 1e-9
        x, y, z = patch.point(t, 0.4 * patch.jet(t, 0).v_to[0]).T
        gap = np.minimum(np.abs(z - x**2 + 0.5), np.abs(z + y**2 - 0.5))
        assert gap.max() <= 1e-3  # 24 points are not the curve itself


def test_fans_are_announced_for_open_curves_and_faces_for_hulls():
    (panel,) = build(kind="edge-surface", curves=[CUBIC]).panels
    assert "fans" in panel.notes[0]
    assert build(kind="edge-surface", curves=[SADDLE]).panels[0].notes == ()
    assert "flat faces" in build(kind="edge-surface", curves=[SADDLE], hull=True).panels[0].notes[0]


TOUCHING = [
    circle(radius=1, center=[1, 0, 0]),
    circle(radius=1, center=[0, 0, 1], normal=[1, 0, 0]),
]
PINCHED = formula("sin(2*t)", "cos(t)*sin(t)**2", "sin(t)**3")
RIGHT = {"kind": "line", "from": [0, 0, 0], "to": [1, 0, 0]}


@pytest.mark.parametrize(
    ("table", "code", "words"),
    [
        ({"curves": [circle(radius=1)]}, 3, "lies in a plane"),
        ({"curves": [RIGHT]}, 3, "lies in a plane"),
        ({"curves": [RIGHT, RIGHT | {"from": [0, 1, 0], "to": [1, 1, 1]}]}, 3, "no bitangent"),
        ({"curves": [RIGHT, RIGHT | {"from": [0, 1, 0], "to": [1, 1, 0]}]}, 3, "one plane"),
        ({"curves": [formula("t", "t**2", "t**3", [-1, 1])]}, 3, "no bitangent pairs"),
        (
            {"curves": [{"kind": "helix", "radius": 1, "pitch": 1, "turns": 0.9}]},
            3,
            "no bitangent pairs",
        ),
        ({"curves": TOUCHING}, 3, "the curves touch at the parameters 3.14159 and -1.5708"),
        ({"curves": [PINCHED]}, 3, "the curve touches itself"),
        ({"curves": [SPLINE | {"degree": 3}]}, 3, "the torsion jumps"),
        (
            {
                "curves": [
                    {
                        "kind": "polyline",
                        "points": [[0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 2]],
                        "closed": True,
                    }
                ]
            },
            3,
            "the tangent jumps at the corner",
        ),
        (
            {
                "curves": [
                    {
                        "kind": "polyline",
                        "points": [[0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 2]],
                        "closed": True,
                        "corner_radius": 0.1,
                    }
                ]
            },
            3,
            "part of the curve is plane",
        ),
        (
            {"curves": [SADDLE, circle(radius=0.05, normal=[0.2, 0.1, 1])], "hull": True},
            3,
            "both curves on one side",
        ),
        ({"curves": [SADDLE], "component": 3}, 2, "there are 2"),
        ({"curves": [SADDLE, SADDLE]}, 2, "the same curve"),
    ],
)
def test_what_has_no_edge_surface_is_refused(table, code, words):
    error = refusal(kind="edge-surface", **table)
    assert error.code == code
    assert words in str(error)
    assert error.remedy


# --- curves that meet ----------------------------------------------------------------------


CROSSED = formula("cos(t)", "sin(2*t)", "cos(3*t)")
EIGHT = formula("sin(t)", "sin(2*t)", "0.3*cos(2*t)")
GREAT_CIRCLES = [circle(radius=1), circle(radius=1, normal=[1, 0, 0])]
LENS = [
    formula("cos(t)", "sin(t)", "0", [0, "pi"]),
    formula("cos(t)", "-0.4*sin(t)", "0.8*sin(t) + 0.2*sin(2*t)", [0, "pi"]),
]
CROSSING_SPLINE = {
    "kind": "points",
    "points": [[0, 0, 0], [20, 10, 5], [22, -10, 10], [0, 0, 0], [-20, 10, 8], [-18, -10, 13]],
    "closed": True,
}


def lengths_at_the_ends(panel):
    ends = (panel.patches[0], 0), (panel.patches[-1], 1)
    return [float(patch.jet([patch.domain[k]], 0).v_to[0][0]) for patch, k in ends]


def beside_the_ends(patch):
    """Parameters all over a patch, and ever closer to its ends, which are left out."""
    low, high = patch.domain
    steps = np.geomspace(1e-8, 1e-2, 13) * (high - low)
    return np.sort(np.concatenate([inside(patch, 50)[1:-1], low + steps, high - steps]))


def test_a_curve_that_passes_a_point_twice_has_two_parts_of_its_cubic_cylinder():
    panels = build(kind="edge-surface", curves=[CROSSED]).panels
    assert len(panels) == 5
    heights = []
    for panel in (panels[0], panels[4]):  # s from 0 to pi/2 and from pi/2 to pi, t = -s
        np.testing.assert_allclose(lengths_at_the_ends(panel), 0.0, atol=1e-14)
        for patch in panel.patches:
            t = beside_the_ends(patch)
            jet = patch.jet(t, 1)
            # rulings along y, to rounding beside the ruling that has no length
            np.testing.assert_allclose(np.abs(jet.e[0][:, 1]), 1.0, atol=1e-14)
            np.testing.assert_allclose(jet.e[1], 0.0, atol=1e-9)
            x, _, z = patch.point(t, 0.7 * jet.v_to[0]).T
            np.testing.assert_allclose(z, 4 * x**3 - 3 * x, atol=1e-14)
            heights += [x.min(), x.max()]
    assert [min(heights), max(heights)] == pytest.approx([-1.0, 1.0], abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("specs", "number"), [([EIGHT], 3), ([CROSSING_SPLINE], 3), (GREAT_CIRCLES, 4), (LENS, 1)]
)
def test_only_the_ruling_without_length_ends_a_panel(specs, number):
    panels = build(kind="edge-surface", curves=specs).panels
    assert len(panels) == number
    for panel in panels:
        size = max(patch.jet(inside(patch), 0).v_to[0].max() for patch in panel.patches)
        np.testing.assert_allclose(lengths_at_the_ends(panel), 0.0, atol=1e-13 * size)
        for patch in panel.patches:
            t = beside_the_ends(patch)
            # the limit is 1e-2; rounding where a rail stands still at a joint
            assert np.degrees(np.abs(warp(patch, t))).max() <= 1e-6
            assert (patch.jet(t, 0).v_to[0] > 0.0).all()
            # the rail is where the direction says: first differences against the derivative
            step = 1e-6 * (patch.domain[1] - patch.domain[0])
            middle = inside(patch, 9)[1:-1]
            jets = [patch.jet(middle + k * step, 1) for k in (-1, 0, 1)]
            slope = (jets[2].e[0] - jets[0].e[0]) / (2 * step)
            assert np.abs(slope - jets[1].e[1]).max() <= 1e-6 * max(1.0, np.abs(slope).max())


def test_great_circles_carry_four_half_cones_of_which_two_make_the_hull():
    # circles that cross: (s, t) with both points equally far from a meeting, on cones about it
    panels = build(kind="edge-surface", curves=GREAT_CIRCLES, hull=True).panels
    parts = [patch for panel in panels for patch in panel.patches]
    exact = sum(map(area, parts)), volume(parts)
    missing = []
    for number in (400, 800):
        hull = hull_of(GREAT_CIRCLES, number)
        missing.append(np.array(exact) - [hull.area, hull.volume])
    assert (missing[1] > 0.0).all()
    np.testing.assert_allclose(missing[0] / missing[1], 4.0, rtol=0.1)


# --- hulls of splines ----------------------------------------------------------------------


def random_spline(seed, number, noise):
    rng = np.random.default_rng(seed)
    angle = np.arange(number) * 2 * np.pi / number
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    points = ring * rng.uniform(0.7, 1.3, (number, 1)) + rng.normal(0, noise, (number, 3))
    return {"kind": "points", "points": points.round(3).tolist(), "closed": True}


def flat_faces(panels):
    """Area and volume under the flat faces: polygons of the rulings in which panels end."""
    planes = []
    for panel in panels:
        for patch, k in (panel.patches[0], 0), (panel.patches[-1], 1):
            jet = patch.jet([patch.domain[k]], 0)
            a, b, n = jet.c0[0][0], jet.rail(jet.v_to)[0][0], patch.frame([patch.domain[k]]).n[0]
            if np.linalg.norm(b - a) < 1e-9:
                continue
            for points, normal in planes:
                if abs(normal @ n - 1) < 1e-9 and abs((a - points[0]) @ n) < 1e-7:
                    points += [a, b]
                    break
            else:
                planes.append(([a, b], n))
    total = np.zeros(2)
    for points, normal in planes:
        across = np.linalg.svd(normal[None])[2][1:]
        polygon = ConvexHull(np.unique((points @ across.T).round(7), axis=0))
        total += polygon.volume * np.array([1.0, points[0] @ normal / 3.0])
    return total


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "number", "noise"),
    [
        (4, 9, 0.25),
        (1, 9, 0.25),  # a part between two flat faces that is narrower than planes are looked at
        (14, 12, 0.3),  # a parameter that turns back twice at one place
        *(pytest.param(k, 12, 0.3, marks=pytest.mark.slow) for k in (10, 12, 13, 15)),
        *(pytest.param(k, 14, 0.4, marks=pytest.mark.slow) for k in (0, 1, 2, 3)),
    ],
)
def test_hulls_of_random_splines_are_convex_hulls_with_their_flat_faces(seed, number, noise):
    spec = random_spline(seed, number, noise)
    panels = build(kind="edge-surface", curves=[spec], hull=True).panels
    parts = [patch for panel in panels for patch in panel.patches]
    exact = np.array([sum(map(area, parts)), volume(parts)]) + flat_faces(panels)
    missing = []
    for count in (500, 2000):
        hull = hull_of([spec], count)
        missing.append((exact - [hull.area, hull.volume]) / exact)
    assert (missing[1] > 0.0).all()
    assert (missing[1] < 1e-4).all()
    # second order, roughly: what is left depends on how the points lie to the tri-tangent planes
    np.testing.assert_allclose(np.sqrt(missing[0] / missing[1]), 4.0, rtol=0.2)


# --- oloid and sphericon -------------------------------------------------------------------


def test_oloid_rulings_are_sqrt_3_long_and_enclose_the_known_volume():
    parts = patches(kind="oloid", radius=2.0)
    for patch in parts:
        t = inside(patch)
        jet = patch.jet(t, 0)
        ends = jet.rail(jet.v_to)[0]
        np.testing.assert_allclose(
            np.linalg.norm(ends - jet.c0[0], axis=1), 2 * np.sqrt(3), rtol=1e-12
        )
        assert np.abs(ends[:, 0]).max() <= 1e-14  # circle B lies in x = 0
        np.testing.assert_allclose(np.hypot(ends[:, 1] - 1, ends[:, 2]), 2.0, rtol=1e-13)
        assert np.degrees(np.abs(warp(patch, t[1:-1]))).max() <= 1e-9
    assert sum(map(area, parts)) == pytest.approx(4 * np.pi * 4, rel=1e-13)
    # > 0: the front is the outside
    assert volume(parts) == pytest.approx(8 * 3.0524184684243747, rel=1e-12)


def test_the_oloid_unrolls_as_dirnboeck_and_stachel_say():
    chain = link(patches(kind="oloid", radius=1.0), base_closed=True, tolerance=0.01)
    assert chain.closed
    developments = develop_chain(chain)
    # A(t), from the ruling at alpha = 0 on: X, Y, Theta of geometry.md, section 6
    alpha = np.linspace(0, 2 * np.pi / 3, 41)[1:-1]
    w, root = np.sin(alpha / 2), np.sqrt(1 + 2 * np.cos(alpha))
    x = (2 * w * root + np.arcsin(2 * w / np.sqrt(3)) + np.arctan(w / root)) * 2 / np.sqrt(27)
    y = (8 * w**2 - 2 * np.log(np.cos(alpha / 2))) / np.sqrt(27)
    # the same places on the patch after alpha = 0: tan t' = Y / X, X = sin(alpha/2)
    other = np.sqrt(1 - 0.25 / (1 - w**2))
    t = np.pi / 2 + np.arctan2(w, other)
    patch = chain.patches[1]
    sine = np.sin(alpha)
    np.testing.assert_allclose(patch.jet(t, 0).c0[0][:, 0], sine, atol=1e-14)
    got = developments[1].origin(t)
    start = developments[1].origin(np.array([np.pi / 2]))[0]
    # up to a motion that may turn the sheet over: ratios of complex numbers
    away, ideal = (got - start) @ [1, 1j], x + 1j * y
    ratios = [away / ideal, away / ideal.conj()]
    spread, ratio = min((np.ptp(np.abs(r - r[0])), r[0]) for r in ratios)
    assert spread <= 1e-10
    assert abs(ratio) == pytest.approx(1.0, abs=1e-10)
    # the end of the quarter: (2 pi / (3 sqrt 3), (6 + ln 4) / (3 sqrt 3))
    end = developments[1].origin(np.array([np.pi]))[0] - start
    assert np.hypot(*end) == pytest.approx(
        np.hypot(1.2091995761561452, 1.4214930125687946), abs=1e-10
    )


def test_the_oloid_s_pattern_is_two_mirrored_halves():
    chain = link(patches(kind="oloid", radius=1.0), base_closed=True, tolerance=0.01)
    developments = develop_chain(chain)
    axis_at, axis = (x[0] for x in developments[1].rulings(np.array([np.pi])))
    for early, late in ((0, 3), (1, 2)):
        t = inside(chain.patches[early], 40)
        for v in (0.0, 1.0, np.sqrt(3)):
            one = developments[early].points(t, np.full(t.size, v)) - axis_at
            two = developments[late].points(2 * np.pi - t, np.full(t.size, v)) - axis_at
            mirrored = 2 * np.outer(one @ axis, axis) - one
            np.testing.assert_allclose(mirrored, two, atol=1e-12)


def test_the_sphericon_is_four_sectors_that_enclose_two_thirds_pi():
    parts = patches(kind="sphericon", radius=3.0)
    chain = link(parts, base_closed=True, tolerance=0.01)
    assert chain.closed
    assert all(joint.smooth for joint in (*chain.joints, chain.closing))
    assert volume(parts) == pytest.approx(2 * np.pi * 27 / 3, rel=1e-13)
    developments = develop_chain(chain)
    for patch, development in zip(parts, developments, strict=True):
        assert area(patch) == pytest.approx(np.pi / np.sqrt(2) * 9, rel=1e-13)
        one, two = (development.direction(np.array([t]))[0] for t in patch.domain)
        assert np.arccos(one @ two) == pytest.approx(np.pi / np.sqrt(2), rel=1e-12)
    apexes = [patch.jet(np.array([sum(patch.domain) / 2]), 0) for patch in parts]
    still = [float(np.abs(patch.jet(inside(patch), 1).c0[1]).max()) for patch in parts]
    assert [x <= 1e-12 for x in still] == [False, True, False, True]
    assert len(apexes) == 4


def test_neighbours_share_a_ruling_in_space_and_in_the_pattern():
    for kind in ("oloid", "sphericon"):
        parts = patches(kind=kind, radius=1.0)
        for before, after in pairwise((*parts, parts[0])):
            one, two = before.jet([before.domain[1]], 0), after.jet([after.domain[0]], 0)
            np.testing.assert_allclose(one.c0[0], two.c0[0], atol=1e-15)
            np.testing.assert_allclose(one.e[0], two.e[0], atol=1e-15)
