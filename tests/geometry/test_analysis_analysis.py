"""The analysis of curves against closed forms: lengths, invariants, helices, developables."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter

from devcad.errors import GeometryError, JobError
from devcad.geometry import taylor
from devcad.geometry.analysis.analysis import Analysis, analyze
from devcad.geometry.analysis.attached import Attached
from devcad.geometry.chebyshev import resolve
from devcad.geometry.curve import Curve
from devcad.geometry.curves import CurveSpec
from devcad.geometry.natural import natural

ADAPTER: TypeAdapter[Any] = TypeAdapter(CurveSpec)
TURN = [0, "2*pi"]
P = np.polynomial.Polynomial


def of(**table: Any) -> Analysis:
    spec = ADAPTER.validate_python(table)
    return analyze(spec.curve(), spec)


def formula(x: str, y: str, z: str, t: list[Any]) -> Analysis:
    return of(kind="expression", x=x, y=y, z=z, t=t)


def equations(curvature: str, torsion: str, t: list[Any]) -> Analysis:
    return of(kind="natural", curvature=curvature, torsion=torsion, t=t)


def kind(analysis: Analysis, name: str) -> Attached:
    (found,) = [each for each in analysis.developables if each.kind == name]
    return found


def places(found: Attached, name: str) -> list[float]:
    return [point.t for point in found.singularities if point.type == name]


def classes(analysis: Analysis) -> list[str]:
    return [name for name, is_one in analysis.helix.items() if is_one]


CUBIC = partial(formula, "t", "t**2", "t**3")
HELIX = partial(formula, "3*cos(t)", "3*sin(t)", "4*t")

# --- lengths -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("analysis", "length"),
    [
        (partial(CUBIC, [0, 1]), 1.8630229825122513),  # O35
        (partial(HELIX, [0, 10]), 50.0),
        (partial(of, kind="ellipse", radii=[3.0, 2.0]), 15.86543958929059),  # O03
        (partial(of, kind="circle", radius=1e-4), 2e-4 * np.pi),
        (partial(formula, "1e5*t", "2e5*t", "2e5*t", [0, 1]), 3e5),
        (partial(formula, "cos(1000*t)", "sin(1000*t)", "t", [0, 1]), np.sqrt(1e6 + 1.0)),
        # cusps: Neile's parabola, and three arches of a cycloid, 8 each
        (partial(formula, "t**2", "t**3", "0", [-1, 1]), 2.0 * (13.0 * np.sqrt(13.0) - 8.0) / 27.0),
        (partial(formula, "t - sin(t)", "1 - cos(t)", "0", [0, "6*pi"]), 24.0),
        # corners, and corners rounded by quarter circles of radius 0.2
        (partial(of, kind="polyline", points=[[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]]), 3.0),
        (
            partial(
                of,
                kind="polyline",
                points=[[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]],
                corner_radius=0.2,
            ),
            3.0 - 4 * 0.2 + 0.2 * np.pi,
        ),
    ],
)
def test_lengths_are_exact_to_rounding(analysis: partial[Analysis], length: float) -> None:
    found = analysis()
    assert found.length == pytest.approx(length, rel=1e-14)
    assert found.traces.arc[0] == 0.0 and np.all(np.diff(found.traces.arc) >= 0.0)


# --- curvature and torsion -----------------------------------------------------------------


def test_the_twisted_cubic_has_its_curvature_and_torsion() -> None:
    traces = CUBIC([-1, 1]).traces
    t = traces.t
    speed = np.sqrt(1 + 4 * t**2 + 9 * t**4)
    inner = 1 + 9 * t**2 + 9 * t**4
    # a dozen operations from exact derivatives
    np.testing.assert_allclose(traces.curvature, 2 * np.sqrt(inner) / speed**3, rtol=1e-14)
    np.testing.assert_allclose(traces.torsion, 3 / inner, rtol=1e-14)


@pytest.mark.parametrize(
    ("x", "y", "z", "curvature", "torsion", "causal"),
    [
        # geometry.md, section 1, examples 4, 8, 7 (b > a) and 7 (b < a): a = 2, b = 1 or back
        ("2*cos(t)", "2*sin(t)", "t", 2 / 3, 1 / 3, "spacelike"),
        ("cos(t)", "sin(t)", "2*t", 1 / 3, 2 / 3, "timelike"),
        ("2*t", "cosh(t)", "sinh(t)", 1 / 3, 2 / 3, "spacelike"),
        ("t", "2*cosh(t)", "2*sinh(t)", 2 / 3, 1 / 3, "timelike"),
    ],
)
def test_lorentzian_helices_have_their_curvature_and_torsion(
    x: str, y: str, z: str, curvature: float, torsion: float, causal: str
) -> None:
    found = formula(x, y, z, [-1, 1])
    assert found.causal == causal
    # cosh^2 - sinh^2 loses a digit or two
    np.testing.assert_allclose(found.traces.lorentz[0], curvature, rtol=1e-12)
    np.testing.assert_allclose(found.traces.lorentz[1], torsion, rtol=1e-12)


@pytest.mark.parametrize(
    ("x", "y", "z", "causal"),
    [
        ("cos(t)", "sin(t)", "t", "lightlike"),
        ("t", "0", "t", "lightlike"),
        ("t", "0", "t**2/2", "mixed"),  # lightlike at both ends
        ("t", "t", "t**2/2", "spacelike"),
        ("exp(t)", "exp(-t)", "sqrt(2)*t", "mixed"),  # lightlike at t = 0 alone
        ("0", "t**3", "t", "mixed"),
        ("0", "t**3/4", "t", "timelike"),
    ],
)
def test_the_causal_type_is_that_of_every_tangent(x: str, y: str, z: str, causal: str) -> None:
    assert formula(x, y, z, [-1, 1]).causal == causal


def test_what_does_not_exist_is_no_number() -> None:
    line = formula("t", "2*t", "3*t", [0, 1])
    assert np.all(line.traces.curvature == 0.0)
    for missing in (line.traces.torsion, line.traces.ratios, line.traces.N, line.traces.B):
        assert np.isnan(missing).all()
    null = formula("cos(t)", "sin(t)", "t", [0, 1])
    assert np.isnan(null.traces.lorentz).all() and np.isfinite(null.traces.torsion).all()
    cusp = formula("t**2", "t**3", "0", [-1, 1])
    assert cusp.traces.stops == (0.0,)
    assert np.isnan(cusp.traces.T[cusp.traces.t == 0.0]).all()


def test_a_point_and_an_infinite_speed_are_refused() -> None:
    with pytest.raises(GeometryError, match="is a point"):
        formula("1", "2 + 0*t", "3", [0, 1])
    with pytest.raises(JobError, match="no finite derivative at t = 0"):
        formula("sqrt(t)", "t", "0", [0, 1])


# --- helices -------------------------------------------------------------------------------

ALL = ["cylindrical", "slant", "clad", "g_clad"]


def test_a_helix_is_one_with_its_axis() -> None:
    found = HELIX([0, 10])
    assert classes(found) == ALL
    f = found.ratios["f"]
    assert f.constant and f.mean == pytest.approx(4 / 3, rel=1e-14) and f.axis is not None
    assert abs(f.axis[2]) == pytest.approx(1.0, abs=1e-14)


def test_a_curve_of_constant_slope_over_any_plane_curve_is_a_cylindrical_helix() -> None:
    """z grows with the length of the catenary below: dz/dt = speed = cosh t."""
    found = formula("t", "cosh(t)", "sinh(t)", [-2, 2])
    assert classes(found) == ALL
    assert abs(found.ratios["f"].mean) == pytest.approx(1.0, rel=1e-13)


@pytest.mark.parametrize("end", [1.5, 6.0])
def test_a_slant_helix_has_sigma_1_and_psi_0_also_through_inflections(end: float) -> None:
    """O13; at t = pi/2 and 3 pi/2 the curvature changes its sign, and N turns over."""
    found = equations("cos(t)", "sin(t)", [0, end])
    assert found.helix == {"cylindrical": False, "slant": True, "clad": True, "g_clad": True}
    sigma, psi, _ = found.traces.ratios[1:]
    away = found.traces.curvature > 0.1
    np.testing.assert_allclose(sigma[away], 1.0, atol=1e-12)  # O13's tolerance
    np.testing.assert_allclose(psi[away], 0.0, atol=1e-12)
    expected = [x for x in (np.pi / 2, 3 * np.pi / 2) if x < end]
    assert found.traces.inflections == pytest.approx(expected, abs=1e-12)


def test_a_clad_helix_is_no_slant_one() -> None:
    """k = cos p, tau = sin p with p = -sqrt(1 - c^2 s^2)/c: psi = c (geometry.md, section 2)."""
    p = "(-sqrt(1 - 0.25*t*t)/0.5)"
    found = equations(f"cos({p})", f"sin({p})", [0, 1.1])
    assert classes(found) == ["clad", "g_clad"]
    assert abs(found.ratios["psi"].mean) == pytest.approx(0.5, rel=1e-12)


def test_a_g_clad_helix_is_no_clad_one() -> None:
    """With W ds = cos q du, q = -sqrt(1 - c^2 u^2)/c and p' = sin q: psi = c u/sqrt(1 - c^2 u^2),
    chi = c, for psi, chi only depend on the integral of W."""
    c = 0.5

    def q(u: np.ndarray, order: int) -> np.ndarray:
        x = taylor.variable(u, order)
        rest = -c * c * taylor.mul(x, x)
        rest[0] += 1.0
        return -taylor.sqrt(rest) / c

    def sine_of_q(u: np.ndarray) -> np.ndarray:
        return np.sin(q(u, 0)[0])[:, None]

    p_values = resolve(sine_of_q, np.array([0.0, 1.0])).antiderivative()

    def k_and_tau(u: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray]:
        sine, cosine = taylor.sin_cos(q(u, order))
        p = taylor.integral(p_values(u)[:, 0] + 0.4, sine)[: order + 1]
        sine_p, cosine_p = taylor.sin_cos(p)
        return taylor.mul(cosine, cosine_p), taylor.mul(cosine, sine_p)

    curve = natural(
        lambda u, k: k_and_tau(u, k)[0],
        lambda u, k: k_and_tau(u, k)[1],
        (0.0, 1.0),
        np.zeros(3),
        np.eye(3),
    )
    found = analyze(curve)
    assert classes(found) == ["g_clad"]
    assert abs(found.ratios["chi"].mean) == pytest.approx(c, rel=1e-10)  # six derivatives


def test_plane_curves_are_helices_and_pieces_of_several_planes_are_not() -> None:
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]]
    flat = [*corners[:3], [0, 1, 0]]
    assert classes(of(kind="polyline", points=flat, corner_radius=0.2)) == ALL
    assert classes(of(kind="polyline", points=corners, corner_radius=0.2)) == []
    assert classes(of(kind="polyline", points=corners)) == []


@pytest.mark.parametrize("name", ["cubic", "spline"])
def test_what_is_no_helix_says_by_how_much(name: str) -> None:
    """A spline through points of a helix is none: its ratio spreads by the spline's error."""
    u = np.linspace(0.0, 6.0, 40)
    points = np.column_stack([3 * np.cos(u), 3 * np.sin(u), 4 * u])
    found = CUBIC([0, 1]) if name == "cubic" else of(kind="points", points=points.tolist())
    assert classes(found) == []
    assert all(ratio.spread > 10.0 * ratio.limit for ratio in found.ratios.values())


@pytest.mark.slow
def test_a_chain_notes_what_jumps() -> None:
    u = np.linspace(0.0, 6.0, 12)
    points = np.column_stack([3 * np.cos(u), 3 * np.sin(u), 4 * u]).tolist()
    (quintic,) = of(kind="points", points=points).notes
    assert quintic.startswith("psi, chi may jump at the 6 breaks")
    (cubic,) = of(kind="points", points=points, degree=3).notes
    assert cubic.startswith("torsion, sigma, psi, chi may jump at the 8 breaks")


# --- developables --------------------------------------------------------------------------


def test_the_developables_of_a_helix() -> None:
    """O10 and section 2: f constant makes a cylinder, a cone with apex f T + B, a plane."""
    found = HELIX([0, 10])
    types = {each.kind: each.type for each in found.developables}
    assert types == {
        "tangent": "tangent",
        "rectifying": "cylinder",
        "darboux": "cone",
        "principal-normal-darboux": "plane",
        "focal": "tangent",
    }
    (apex,) = kind(found, "darboux").singularities
    assert apex.type == "apex" and apex.v == pytest.approx(4 / 3, rel=1e-12)
    np.testing.assert_allclose(apex.point, [0, 0, 5 / 3], atol=1e-12)  # O10
    (edge,) = kind(found, "focal").singularities
    # k' = 0: the centres of curvature, at radius 3 - 1/k = -16/3
    np.testing.assert_allclose(edge.point, [-16 / 3, 0, 0], atol=1e-12)


def test_a_curve_with_tau_over_k_linear_has_a_rectifying_cone() -> None:
    """O11."""
    cone = kind(equations("1", "t", [0, 2]), "rectifying")
    (apex,) = cone.singularities
    assert cone.type == "cone" and apex.type == "apex"
    assert apex.v == pytest.approx(-1.0, abs=1e-12)
    np.testing.assert_allclose(apex.point, [0, 0, -1], atol=1e-12)


def test_a_spherical_curve_has_a_focal_cone_with_its_centre() -> None:
    """Viviani's curve lies on x^2 + y^2 + z^2 = 4."""
    cone = kind(formula("1 + cos(t)", "sin(t)", "2*sin(t/2)", [0.5, 2.5]), "focal")
    (apex,) = cone.singularities
    assert cone.type == "cone"
    np.testing.assert_allclose(apex.point, 0.0, atol=1e-10)


def test_the_clad_helix_has_a_principal_normal_darboux_cone() -> None:
    p = "(-sqrt(1 - 0.25*t*t)/0.5)"
    cone = kind(equations(f"cos({p})", f"sin({p})", [0, 1.1]), "principal-normal-darboux")
    assert cone.type == "cone"
    assert abs(cone.singularities[0].v) == pytest.approx(0.5, rel=1e-10)


def test_swallowtails_of_the_twisted_cubic_are_where_section_2_has_them() -> None:
    """f = tau/k = (3/2) (S/Q)^(3/2): f' = 0 are roots of R = S' Q - S Q' (Darboux), and f'' = 0
    those of R' Q - (5/2) R Q' (rectifying), with primes d/dt; f'' is by the length."""
    s, q = P([1, 0, 4, 0, 9]), P([1, 0, 9, 0, 9])
    r = s.deriv() * q - s * q.deriv()
    second = r.deriv() * q - 2.5 * r * q.deriv()

    def roots(polynomial: Any) -> list[float]:
        found = polynomial.roots()
        real = np.sort(found[np.abs(found.imag) < 1e-9].real)
        return [float(x) for x in real if abs(x) < 1.0]

    found = CUBIC([-1, 1])
    darboux, rectifying = kind(found, "darboux"), kind(found, "rectifying")
    assert places(darboux, "swallowtail") == pytest.approx(roots(r), abs=1e-10)
    assert places(rectifying, "swallowtail") == pytest.approx(roots(second), abs=1e-9)
    assert places(darboux, "cuspidal-crosscap") == places(rectifying, "cuspidal-crosscap") == []
    for point in darboux.singularities:  # v = f, the point f T + B
        f = 1.5 * (s(point.t) / q(point.t)) ** 1.5
        assert point.v == pytest.approx(f, rel=1e-12)
        assert np.linalg.norm(point.point) == pytest.approx(np.hypot(1.0, f), rel=1e-12)


@pytest.mark.parametrize("t", [[-1, 1], [0, 1], [-1, 0]], ids=str)
def test_a_zero_of_the_torsion_is_a_crosscap_at_an_end_of_the_curve_too(t: list[Any]) -> None:
    """(t, t^2, t^4) has torsion 24 t / |r' x r''|^2 (up to sign), zero at 0 alone."""
    tangent = kind(formula("t", "t**2", "t**4", t), "tangent")
    assert places(tangent, "cuspidal-crosscap") == pytest.approx([0.0], abs=1e-12)
    (edge,) = [each for each in tangent.singularities if each.type == "cuspidal-edge"]
    assert edge.t != 0.0
    assert all(point.v == 0.0 or abs(point.v) < 1e-12 for point in tangent.singularities)


def test_a_closed_curve_has_the_crosscap_of_its_seam_once() -> None:
    """Torsion zero where sin 3t = 0: det(r', r'', r''') is a multiple of it."""
    tangent = kind(formula("2*cos(t)", "2*sin(t)", "cos(3*t)", TURN), "tangent")
    expected = [k * np.pi / 3 for k in range(6)]
    assert places(tangent, "cuspidal-crosscap") == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("factor", [1e-6, 1e-3, 1e4, 1e9])
def test_size_changes_no_type_and_no_place(factor: float) -> None:
    table = {"x": "t", "y": "sin(t)", "z": "cos(2*t)"}
    plain = formula(**table, t=[0.2, 1.4])
    scaled = formula(**{k: f"{factor!r}*({v})" for k, v in table.items()}, t=[0.2, 1.4])
    assert scaled.length == pytest.approx(factor * plain.length, rel=1e-14)
    for one, other in zip(plain.developables, scaled.developables, strict=True):
        size = 1.0 if "darboux" in one.kind else factor
        assert other.type == one.type
        assert len(other.singularities) == len(one.singularities)
        for mine, theirs in zip(one.singularities, other.singularities, strict=True):
            if mine.type != "cuspidal-edge":  # where it comes nearest to the extent
                assert theirs.type == mine.type
                assert theirs.t == pytest.approx(mine.t, abs=1e-9)
                assert theirs.v == pytest.approx(size * mine.v, rel=1e-6, abs=1e-9 * size)


@settings(max_examples=8, deadline=None)
@given(st.floats(0.3, 3.0), st.floats(-2.0, 2.0), st.floats(0.5, 3.0))
def test_every_singular_point_lies_on_its_ruling(a: float, b: float, end: float) -> None:
    """At the distance v from the curve, on the tangent developable."""
    spec = ADAPTER.validate_python(
        {"kind": "expression", "x": f"{a}*t", "y": "sin(t)", "z": f"{b}*t**2", "t": [0, end]}
    )
    curve = spec.curve()
    found = analyze(curve, spec)
    for point in kind(found, "tangent").singularities:
        distance = np.linalg.norm(point.point - curve.point(point.t)[0])
        assert distance == pytest.approx(abs(point.v), abs=1e-9)


def test_what_does_not_exist_says_why() -> None:
    line = formula("t", "2*t", "3*t", [0, 1])
    assert {(each.type, each.why) for each in line.developables} == {
        (None, "the curve is straight")
    }
    wave = formula("t", "sin(t)", "t**3", [-1, 1])
    assert kind(wave, "tangent").type == "tangent"
    assert kind(wave, "rectifying").type is None
    assert "inflection (curvature 0) at t = 0" in kind(wave, "rectifying").why
    cusp = formula("t**2", "t**3", "t**4", [-1, 1])
    assert kind(cusp, "tangent").why == "the curve stands still at t = 0"


def test_a_focal_developable_is_cut_where_its_ruling_stands_still() -> None:
    """An ellipse: the cylinder on its evolute, whose cusps belong to the four vertices."""
    focal = kind(of(kind="ellipse", radii=[3.0, 2.0], start=45.0, sweep=300.0), "focal")
    assert focal.type == "cylinder" and focal.pieces == 4
    assert focal.note.startswith("the ruling stands still at t = ")
    circle = kind(of(kind="circle", radius=3.0), "focal")
    assert circle.type is None and "normal planes meet in one line" in circle.why


def test_straight_stretches_are_passed_over_and_corners_too() -> None:
    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]]
    found = of(kind="polyline", points=corners, corner_radius=0.2)
    assert kind(found, "tangent").type == "plane" and kind(found, "tangent").pieces == 2
    assert kind(found, "rectifying").type == "cylinder"
    chain = of(
        kind="chain",
        curves=[
            {"kind": "helix", "radius": 1.0, "pitch": 3.0, "turns": 0.5},
            {"kind": "line", "from": [-1, 0, 1.5], "to": [-1, 0, 4]},
            {"kind": "circle", "radius": 1.0, "center": [0, 0, 4], "start": 180, "sweep": 90},
        ],
    )
    mixed = kind(chain, "tangent")
    assert mixed.type is None and mixed.why.startswith("it changes: tangent from t = 0 to ")
    assert kind(chain, "rectifying").type == "cylinder"


def test_a_spline_too_rough_for_a_strip_is_taken_piece_by_piece() -> None:
    random = np.random.default_rng(4)
    points = np.cumsum(random.normal(size=(7, 3)), axis=0).tolist()
    found = kind(of(kind="points", points=points, degree=3), "rectifying")
    assert found.type == "tangent" and found.pieces > 1
    assert "the ruling turns there" in found.note


def test_a_jump_of_the_torsion_is_no_crosscap() -> None:
    """At a knot of a cubic spline the torsion may change its sign without being 0."""
    random = np.random.default_rng(2)
    points = np.cumsum(random.normal(size=(8, 3)), axis=0).tolist()
    spec = ADAPTER.validate_python({"kind": "points", "points": points, "degree": 3})
    curve = spec.curve()
    signs = [np.sign(_torsion(curve, t)) for k in curve.breaks for t in (np.nextafter(k, 0.0), k)]
    assert -1.0 in np.multiply(signs[::2], signs[1::2])
    for t in places(kind(analyze(curve, spec), "tangent"), "cuspidal-crosscap"):
        assert min(abs(t - k) for k in curve.breaks) > 1e-9


def _torsion(curve: Curve, t: float) -> float:
    jet = curve.jet(np.array([t]), 3)
    return float(np.linalg.det(np.stack([jet[1, 0], 2 * jet[2, 0], 6 * jet[3, 0]])))


def test_many_spans_are_not_taken_apart() -> None:
    random = np.random.default_rng(1)
    points = np.cumsum(random.normal(size=(700, 3)), axis=0).tolist()
    found = of(kind="points", points=points)
    assert found.length > 0.0
    assert all("too many" in each.why for each in found.developables)


# --- the whole -----------------------------------------------------------------------------


def test_a_curve_knows_its_degrees_in_space_only() -> None:
    cubic = CUBIC([0, 1]).degrees
    assert cubic is not None
    assert (cubic.curve, cubic.tangent_developable, cubic.edge_surface) == (3, 4, 0)
    circle = of(kind="circle", radius=1.0).degrees
    assert circle is not None
    assert (circle.curve, circle.tangent_developable, circle.edge_surface) == (2, None, None)
    assert HELIX([0, 1]).degrees is None


def test_samples_follow_every_wave() -> None:
    """2 pi 1000/2 pi turns of a screw: at least eight samples on each, ends included."""
    t = formula("cos(1000*t)", "sin(1000*t)", "t", [0, 1]).traces.t
    assert t[0] == 0.0 and t[-1] == 1.0
    assert np.diff(t).max() < 2.0 * np.pi / 1000.0 / 8.0
