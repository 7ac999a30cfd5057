"""Developables of a Frenet frame against the table of their six functions.

Curves are given by their curvature and torsion, so that the table of geometry.md, section 2, is
known from two polynomials; the centres of osculating spheres come from a linear system.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from constructing import inside, patch, patches, refusal, regression
from numpy.polynomial import Polynomial

from devcad.errors import GeometryError, JobError
from devcad.geometry.classify import classify
from devcad.geometry.patch import Patch
from devcad.geometry.regularity import singularities, twist

S = Polynomial([0, 1])
K, TAU = 1.5 + 0.3 * S - 0.2 * S**2, 0.4 + 0.5 * S + 0.1 * S**3
KINDS = ("rectifying", "oriented", "darboux", "principal-normal-darboux", "focal")
CUBIC = {"kind": "expression", "x": "t", "y": "t**2", "z": "t**3", "t": [0.2, 1]}
ANGLE = {"angle": "70 + 20*t"}


def text(p: Polynomial) -> str:
    """The polynomial as an expression."""
    return " + ".join(f"({c!r})*t**{k}" if k else repr(c) for k, c in enumerate(p.coef.tolist()))


def natural(k: Polynomial | str, tau: Polynomial | str, t: list[float]) -> dict[str, object]:
    """A curve of the job file with this curvature and torsion."""
    k, tau = (p if isinstance(p, str) else text(p) for p in (k, tau))
    return {"kind": "natural", "curvature": k, "torsion": tau, "t": t}


def strip(kind: str, **table: object) -> Patch:
    """The patch of a kind; any extent and any angle where the table does not say."""
    extent = {"darboux": [3, 4], "principal-normal-darboux": [3, 4], "focal": [3, 4]}
    angle = ANGLE if kind == "oriented" else {}
    return patch(**({"kind": kind, "extent": extent.get(kind, [-0.01, 0.01])} | angle | table))


def ratios(k: Polynomial, tau: Polynomial, s: np.ndarray) -> dict[str, np.ndarray]:
    """What the table is made of, each with its first derivatives, by the quotient rule."""
    k0, k1, k2, k3 = (k.deriv(j)(s) if j else k(s) for j in range(4))
    t0, t1, t2 = (tau.deriv(j)(s) if j else tau(s) for j in range(3))
    return {
        "k": k0,
        "tau": t0,
        "f": t0 / k0,
        "f1": (t1 * k0 - t0 * k1) / k0**2,
        "f2": ((t2 * k0 - t0 * k2) * k0 - 2 * k1 * (t1 * k0 - t0 * k1)) / k0**3,
        "radius": 1 / k0,
        "radius1": -k1 / k0**2,
        "radius2": (2 * k1**2 - k0 * k2) / k0**3,
        "k3": k3,
    }


def table_row(kind: str, s: np.ndarray) -> tuple[np.ndarray, ...]:
    """a, c, u* and delta of geometry.md, section 2."""
    r = ratios(K, TAU, s)
    f, f1, tau = r["f"], r["f1"], r["tau"]
    if kind == "rectifying":  # there u counts along D~, the extent along the unit vector
        long = np.sqrt(1 + f**2)
        return f1 / (1 + f**2), np.hypot(r["k"], tau), -long / f1, long * r["f2"] / f1**2
    if kind == "darboux":
        return r["k"], tau, f, f1
    bend = TAU.deriv()(s)
    delta = f + (r["radius2"] * tau - r["radius1"] * bend) / tau**2
    return tau, r["k"], r["radius1"] / tau, delta


@pytest.mark.parametrize("kind", ["rectifying", "darboux", "focal"])
def test_six_functions_are_those_of_the_table(kind):
    surface = strip(kind, curve=natural(K, TAU, [0, 1]))
    t = inside(surface, 21)
    jet = surface.frame_jet(t, 1)
    a, c, edge, delta = table_row(kind, t)
    np.testing.assert_allclose(np.abs(jet.a[0]), np.abs(a), rtol=1e-11)
    np.testing.assert_allclose(np.abs(jet.c[0]), np.abs(c), rtol=1e-11)
    np.testing.assert_allclose(-jet.q[0] / jet.a[0], edge, rtol=1e-10, atol=1e-13)
    slope = (jet.q[1] * jet.a[0] - jet.q[0] * jet.a[1]) / jet.a[0] ** 2
    np.testing.assert_allclose(jet.p[0] - slope, delta, rtol=1e-9, atol=1e-10)


def test_six_functions_of_the_principal_normal_darboux_developable():
    """k = cos p and tau = sin p: sigma = p', psi is the curvature of the graph of p."""
    p = Polynomial([0.2, 0.5, -0.3, 0.4])
    k, tau = f"cos({text(p)})", f"sin({text(p)})"
    surface = strip("principal-normal-darboux", curve=natural(k, tau, [-0.5, 0.5]))
    t = inside(surface, 21)
    jet = surface.frame_jet(t, 1)
    stretch = 1 + p.deriv()(t) ** 2
    psi = p.deriv(2)(t) / stretch**1.5
    slope = p.deriv(3)(t) / stretch**1.5 - 3 * p.deriv()(t) * p.deriv(2)(t) ** 2 / stretch**2.5
    np.testing.assert_allclose(jet.a[0], np.sqrt(stretch), rtol=1e-12)
    np.testing.assert_allclose(np.abs(jet.c[0]), np.abs(p.deriv(2)(t)) / stretch, atol=1e-12)
    np.testing.assert_allclose(-jet.q[0] / jet.a[0], psi, atol=1e-12)
    delta = jet.p[0] - (jet.q[1] * jet.a[0] - jet.q[0] * jet.a[1]) / jet.a[0] ** 2
    np.testing.assert_allclose(delta, slope, atol=1e-11)


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_are_those_of_the_values(kind):
    """Central differences of c0 and e, and no normal part: the surface is developable."""
    surface, h = strip(kind, curve=CUBIC), 1e-3
    t = np.linspace(0.3, 0.9, 13)
    around = [surface.jet(t + k * h, 0) for k in (-2, -1, 1, 2)]
    weights = np.array([1, -8, 8, -1]) / (12 * h)
    for name in ("c0", "e"):
        slope = sum(w * getattr(j, name)[0] for w, j in zip(weights, around, strict=True))
        series = getattr(surface.jet(t, 1), name)[1]
        np.testing.assert_allclose(series, slope, rtol=1e-7, atol=1e-7 * np.abs(slope).max())
    assert twist(surface).value < 1e-11
    np.testing.assert_allclose(np.linalg.norm(surface.jet(t, 0).e[0], axis=1), 1, rtol=1e-15)


def test_oriented_by_a_right_angle_is_the_rectifying_developable():
    t = np.linspace(0.2, 1, 40)
    there = strip("rectifying", curve=CUBIC).jet(t, 3)
    for angle in (90, -90, 270, "90 + 180*0*t"):  # a plane turned by 180 degrees is the same plane
        here = strip("oriented", curve=CUBIC, angle=angle).jet(t, 3)
        np.testing.assert_allclose(here.e, there.e, atol=1e-12 * np.abs(there.e).max())


def test_oriented_by_minus_the_total_torsion_is_a_line_of_curvature():
    """theta of the surface normal is alpha less 90 degrees, and falls by the torsion: 0.3 t."""
    curve = natural("1 + 0.2*t", "0.3", [0, 2])
    square = patch(kind="line-of-curvature", curve=curve, angle=20, extent=[0.1, 0.2])
    turned = patch(kind="oriented", curve=curve, angle="110 - 0.3*t*180/pi", extent=[0.1, 0.2])
    t = inside(square, 41)
    np.testing.assert_allclose(turned.jet(t, 2).e, square.jet(t, 2).e, atol=1e-12)


def test_ruling_angle_and_curvatures_with_a_prescribed_angle_field():
    curve = natural("0.5", "0.2", [0, 1])  # oracle O16
    field = {"angle": "30 + 0.1*t*180/pi"}
    surface = patch(kind="oriented", curve=curve, extent=[-0.1, 0.1], **field)
    frame, jet = surface.frame([0.0]), surface.jet([0.0], 2)
    tangent, bending = jet.c0[1, 0], 2 * jet.c0[2, 0]
    e, n = frame.e[0], frame.n[0]
    assert np.arctan2(np.linalg.norm(np.cross(tangent, e)), tangent @ e) == pytest.approx(
        0.6947382761967033, rel=1e-12
    )
    assert np.cross(n, tangent) @ bending == pytest.approx(-0.4330127018922193, rel=1e-12)
    assert abs(n @ bending) == pytest.approx(0.25, rel=1e-12)
    assert abs(frame.c[0] / frame.q[0]) == pytest.approx(0.61, rel=1e-12)  # kappa_1
    turning = surface.frame_jet([0.0], 1).n[1, 0] @ np.cross(n, tangent)
    assert abs(turning) == pytest.approx(0.3, rel=1e-12)  # tau_g


@pytest.mark.parametrize("kind", ["darboux", "principal-normal-darboux"])
def test_scale_moves_the_base_curve_alone(kind):
    one, ten = (strip(kind, curve=CUBIC, extent=[80, 90], scale=s) for s in (1, 10))
    t = inside(one, 11)
    np.testing.assert_allclose(ten.jet(t, 3).c0, 10 * one.jet(t, 3).c0, rtol=1e-14, atol=1e-13)
    np.testing.assert_array_equal(ten.jet(t, 3).e, one.jet(t, 3).e)


def test_the_regression_curve_of_the_darboux_developable_is_the_modified_darboux_vector():
    helix = {"kind": "expression", "x": "3*cos(t)", "y": "3*sin(t)", "z": "4*t", "t": [0, 2]}
    surface = strip("darboux", curve=helix)
    edge = regression(surface.frame(inside(surface)))
    np.testing.assert_allclose(edge, np.tile([0, 0, 5 / 3], (101, 1)), atol=1e-14)  # oracle O10


def test_the_regression_curve_of_the_focal_developable_are_centres_of_osculating_spheres():
    """The sphere's centre m solves <r - m, r - m>' = '' = ''' = 0: linear in m."""
    surface = strip("focal", curve=CUBIC)
    t = np.linspace(0.3, 0.9, 7)
    for s, found in zip(t, regression(surface.frame(t)), strict=True):
        r = np.array([s, s**2, s**3])
        d1, d2, d3 = np.array([1, 2 * s, 3 * s**2]), np.array([0, 2, 6 * s]), np.array([0, 0, 6])
        right = [d1 @ r, d2 @ r + d1 @ d1, d3 @ r + 3 * d1 @ d2]
        np.testing.assert_allclose(found, np.linalg.solve([d1, d2, d3], right), rtol=1e-10)


def test_focal_rulings_are_the_axes_of_the_osculating_circles():
    """Each of their points is equally far from the curve to third order."""
    surface = strip("focal", curve=CUBIC)
    frame, h = surface.frame([0.5]), 1e-3
    near = np.array([[s, s**2, s**3] for s in (0.5 - h, 0.5, 0.5 + h)])
    for v in (-1.0, 0.0, 2.0):
        distances = np.linalg.norm(near - frame.c0[0] - v * frame.e[0], axis=1)
        assert np.ptp(distances) < 10 * h**3
    np.testing.assert_allclose(np.abs(np.cross(frame.n[0], [1, 1, 0.75])), 0, atol=1e-14)


# (kind, curve, extent, the expected special points t); every root from a polynomial of its own
CUBE = Polynomial([2, 6, 0, 1])  # delta of the focal developable, below
SPECIAL = [
    # f = tau = 2 t + (t - 1)^3: f'' = 0 at 1, f' > 0
    ("rectifying", ("1", "2*t + (t - 1)**3", [0.2, 2]), [-0.01, 0.01], "swallowtail", 1.0),
    # f = tau = (t - 1)^2 + 0.5: f' = 0 at 1
    ("darboux", ("1", "(t - 1)**2 + 0.5", [0, 1.5]), [3, 4], "swallowtail", 1.0),
    ("darboux", ("1", "t - 1", [0, 1.5]), [3, 4], "cuspidal-crosscap", 1.0),
    # psi is the curvature of the graph of p = 0.3 t^3: 0 at 0, largest at t^4 = 1/(45 * 0.09)
    (
        "principal-normal-darboux",
        ("cos(0.3*t**3)", "sin(0.3*t**3)", [-0.3, 0.5]),
        [3, 4],
        "cuspidal-crosscap",
        0.0,
    ),
    (
        "principal-normal-darboux",
        ("cos(0.3*t**3)", "sin(0.3*t**3)", [0.1, 1]),
        [3, 4],
        "swallowtail",
        4.05**-0.25,
    ),
    # 1/k = 2 + t^3 and tau = 1: delta = 1/k + (1/k)'' = 2 + 6 t + t^3
    (
        "focal",
        ("1/(2 + t**3)", "1", [-1, 0.5]),
        [4, 5],
        "swallowtail",
        float(CUBE.roots()[np.isreal(CUBE.roots())].real[0]),
    ),
]


@pytest.mark.parametrize(("kind", "curve", "extent", "type_", "t"), SPECIAL)
def test_special_points_of_the_regression_curve(kind, curve, extent, type_, t):
    surface = strip(kind, curve=natural(*curve), extent=extent)
    found = singularities(surface, classify(surface))
    assert [s.type for s in found] == ["cuspidal-edge", type_]
    assert found[-1].t == pytest.approx(t, abs=1e-7)
    np.testing.assert_allclose(
        found[-1].point, regression(surface.frame([found[-1].t]))[0], atol=1e-9
    )


def test_a_focal_developable_never_has_crosscaps_nor_a_rectifying_one():
    """c is the curvature k and W: neither vanishes."""
    for kind in ("focal", "rectifying"):
        frame = strip(kind, curve=natural(K, TAU, [0, 1])).frame(np.linspace(0, 1, 50))
        assert np.abs(frame.c).min() > 1.0


CUBIC_SPLINE = {
    "kind": "points",
    "degree": 3,
    "points": [[0, 0, 0], [1, 1, 0], [2, 1.5, 1], [3, 1, 2], [4, 0, 2.5], [5, -2, 2.5], [6, -4, 1]],
}


def test_where_the_rails_have_a_corner_the_surface_is_joined_of_patches():
    """A cubic spline's curvature is continuous and its slope jumps at the three inner knots: the
    rulings of the focal developable follow on, the lines across them turn."""
    points = [[3 * np.cos(s), 3 * np.sin(s), s] for s in np.arange(7) * 0.6]
    curve = {"kind": "points", "degree": 3, "points": points}
    parts = patches(kind="focal", curve=curve, extent=[10, 12])
    assert len(parts) == 4
    for before, after in itertools.pairwise(parts):
        assert before.domain[1] == after.domain[0]
        end, start = (p.frame([p.domain[k]]) for p, k in ((before, 1), (after, 0)))
        np.testing.assert_allclose(end.c0, start.c0, atol=1e-11)
        np.testing.assert_allclose(end.e, start.e, atol=1e-12)
        np.testing.assert_allclose(end.n, start.n, atol=1e-12)
        assert not np.allclose(end.p / end.q, start.p / start.q)


def test_a_smooth_break_stays_inside_the_patch():
    for kind in ("oriented", "darboux"):
        extent = [20, 40] if kind == "darboux" else [-0.01, 0.01]
        (only,) = patches(
            kind=kind,
            curve=CUBIC_SPLINE | {"degree": 5},
            extent=extent,
            **(ANGLE if kind == "oriented" else {}),
        )
        assert only.breaks


HELIX = {"kind": "helix", "radius": 3, "pitch": 8, "turns": 1}
LINE = {"kind": "line", "from": [0, 0, 0], "to": [1, 2, 3]}
S_CURVE = {"kind": "expression", "x": "t", "y": "t**3", "z": "t**4", "t": [-1, 1]}
ZIGZAG = {"kind": "polyline", "points": [[0, 0, 0], [1, 0, 0], [1, 1, 0]]}
ELLIPSE = {"kind": "ellipse", "radii": [3, 2]}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("curve", "words"),
    [
        (LINE, "inflection (curvature 0)"),
        (S_CURVE, "inflection (curvature 0) at t = 0"),
        (ZIGZAG, "corner t = 0.5"),
        (CUBIC | {"x": "t**2", "t": [-1, 1]}, "stands still at t = 0"),
    ],
)
def test_a_curve_without_a_frenet_frame_is_refused(kind, curve, words):
    table = {"kind": kind, "extent": [1, 2], "curve": curve}
    told = refusal(**(table | ANGLE if kind == "oriented" else table))
    assert type(told) is GeometryError
    assert words in str(told)
    assert "\n" not in str(told)
    assert told.remedy
    if "inflection" in words and kind in ("rectifying", "oriented"):
        assert "line-of-curvature" in told.remedy


@pytest.mark.parametrize(
    ("table", "error", "words", "remedy"),
    [
        ({"angle": 0}, GeometryError, "throughout", 'kind = "tangent"'),
        ({"angle": 180}, GeometryError, "throughout", 'kind = "tangent"'),
        ({"angle": "10*(t - 1)"}, GeometryError, "at t = 1: the ruling is the", "0 and 180"),
        # alpha' = -tau at alpha = 0: tau of HELIX is h / (9 + h^2) by arc length, h = 4/pi
        (
            {"angle": "(1 - t)*(4/pi)/sqrt(9 + 16/pi**2)*180/pi"},
            GeometryError,
            "at t = 1: it stands still there",
            "line-of-curvature",
        ),
        ({"angle": "90/t"}, JobError, "angle has no finite", "smooth"),
        ({"angle": 90, "curve": CUBIC_SPLINE}, GeometryError, "third jumps", "degree = 5"),
        (
            {"kind": "principal-normal-darboux", "curve": CUBIC_SPLINE},
            GeometryError,
            "fourth jumps",
            "degree = 5",
        ),
        ({"kind": "focal", "curve": ELLIPSE}, GeometryError, "stands still at t =", "keep the"),
        # the torsion changes its sign at a knot
        (
            {"kind": "focal", "curve": CUBIC_SPLINE, "extent": [100, 140]},
            GeometryError,
            "folds back",
            "degree = 5",
        ),
        (
            {"kind": "focal", "curve": {"kind": "circle", "radius": 3}},
            GeometryError,
            "meet in one line",
            "another curve",
        ),
        ({"kind": "focal", "curve": CUBIC, "extent": [1, "t"]}, JobError, "from = 1", "from < to"),
    ],
)
def test_impossible_tables_end_in_one_line(table, error, words, remedy):
    told = refusal(**{"kind": "oriented", "curve": HELIX, "extent": [1, 2], **table})
    assert type(told) is error
    assert words in str(told)
    assert remedy in told.remedy
    assert "\n" not in str(told)
