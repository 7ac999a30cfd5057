"""The worked cases, through the job file and the whole build."""

from pathlib import Path

import numpy as np
import oracles
import pytest

import devcad
from devcad.errors import CheckFailed, GeometryError
from devcad.geometry.curves import CircleCurve, ExpressionCurve
from devcad.geometry.frames import LORENTZ, ROWS, frenet


def built(folder: Path, surface: str, name: str = "case"):
    job = folder / "case.toml"
    # a tolerance far below the part, so that the mesh has something to do
    job.write_text(f'name = "{name}"\ntolerance = 0.001\n[surface]\n{surface}\n')
    return devcad.build(job)


@pytest.mark.parametrize("oracle", oracles.ORACLES, ids=lambda o: o.name)
def test_worked_case(oracle, tmp_path):
    part = built(tmp_path, f'kind = "{oracle.kind}"\n{oracle.surface}')
    (panel,) = part.panels
    facts = panel.facts
    for key, value in oracle.facts.items():
        if isinstance(value, float | list):
            assert facts[key] == pytest.approx(value, rel=oracle.rel, abs=1e-12), key
        else:
            assert facts[key] == value, key
    assert facts["flat_area"] == pytest.approx(facts["area"], rel=1e-11)
    size = np.hypot(*np.subtract(facts["flat_bbox"][2:], facts["flat_bbox"][:2]))
    if oracle.apex:
        (apex,) = facts["singularities"]
        assert apex["type"] == "apex"
        np.testing.assert_allclose(apex["point"], oracle.apex, atol=1e-11 * size)
    if oracle.regression_start:
        np.testing.assert_allclose(
            facts["regression"]["points"][0], oracle.regression_start, rtol=1e-10, atol=1e-12 * size
        )
    if oracle.end:
        t = panel.chain.patches[0].domain
        f = panel.chain.patches[0].frame(t)
        (top,) = [e for e in panel.pattern.outline if e.name == "top"]
        (last,) = [e for e in panel.pattern.outline if e.name == "end"]
        outer = top.curve(np.array(t[1:]))[0][0]
        direction = last.curve(last.u[:1])[1][0]
        tip = outer - f.v_to[1] * direction
        np.testing.assert_allclose(tip, oracle.end, rtol=oracle.rel, atol=1e-12)


@pytest.mark.parametrize("name", oracles.REFUSED)
def test_what_is_no_developable_is_refused_in_one_line(name, tmp_path):
    surface, words = oracles.REFUSED[name]
    with pytest.raises((GeometryError, CheckFailed)) as caught:
        built(tmp_path, surface)
    message = str(caught.value)
    assert words in message
    assert "\n" not in message
    assert caught.value.code == 3
    assert caught.value.remedy
    assert [p.name for p in tmp_path.iterdir()] == ["case.toml"]


def test_the_rectifying_curve_unrolls_to_a_straight_line_at_distance_one_from_the_apex(tmp_path):
    (case,) = [o for o in oracles.ORACLES if o.name.startswith("O11")]
    part = built(tmp_path, f'kind = "{case.kind}"\n{case.surface}')
    frame = part.panels[0].chain.patches[0].frame(np.linspace(0, 2, 21))
    # distance of the apex from the straight line: |v*| times the sine of the ruling angle
    np.testing.assert_allclose(np.abs(frame.q / frame.a) * frame.q, 1.0, rtol=1e-10)


def test_the_type_and_the_pattern_do_not_depend_on_units(tmp_path):
    facts = []
    for units, k in (("mm", 25.4), ("in", 1.0), ("m", 0.0254), ("cm", 2.54)):
        job = tmp_path / f"{units}.toml"
        job.write_text(
            f'name = "f"\nunits = "{units}"\ntolerance = {0.05 * k / 25.4}\n'
            f'thickness = {0.04 * k}\n[surface]\nkind = "frustum"\n'
            f"radius = {4 * k}\ntop_radius = {2 * k}\nheight = {5 * k}\n"
        )
        facts.append(devcad.build(job).panels[0].facts)
    for other in facts[1:]:
        assert other["area"] == pytest.approx(facts[0]["area"], rel=1e-12)
        assert other["flat_bbox"] == pytest.approx(facts[0]["flat_bbox"], rel=1e-12, abs=1e-9)
        assert other["ruling_count"] == facts[0]["ruling_count"]


def turning_rate(curve, theta0, row, t):
    """|mu k| ds/dt and ds/dt at t (n,): how fast the Lorentzian unrolling turns."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    torsion = lambda s: (lambda d: d.torsion[0] * d.speed[0])(frenet(curve.jet(s, 3), LORENTZ))  # noqa: E731
    start = curve.domain[0]
    turned = [
        0.5 * (x - start) * weights @ torsion(start + 0.5 * (x - start) * (nodes + 1)) for x in t
    ]
    data = frenet(curve.jet(t, 3), LORENTZ)
    mu = ROWS[row].mu(theta0 - np.array(turned))
    return mu * data.curvature[0] * data.speed[0], data.speed[0]


def test_lorentzian_figures_of_the_spacelike_cone():
    # O04: slant, sector angle and area of the Lorentzian unrolling
    curve = CircleCurve(kind="circle", radius=2).curve()
    rate, speed = turning_rate(curve, 1.0, "SB", np.array([0.5, 3.0]))
    slant = speed / np.abs(rate)
    angle = 2 * np.pi * np.abs(rate)
    np.testing.assert_allclose(slant, 1.2961085473277707, rtol=1e-12)
    np.testing.assert_allclose(angle, 9.695461572464488, rtol=1e-12)
    np.testing.assert_allclose(0.5 * slant**2 * angle, 8.143690181079727, rtol=1e-12)


def test_lorentzian_figures_of_the_spacelike_helix():
    # O05: arc length 1.5, height 0.5; area density |1 + t mu k| and turning |mu k| per length
    curve = ExpressionCurve(
        kind="expression", x="2*cos(t)", y="2*sin(t)", z="t", t=(0, 1.5 / np.sqrt(3.0))
    ).curve()
    nodes, weights = np.polynomial.legendre.leggauss(40)
    half = 0.5 * curve.domain[1]
    rate, speed = turning_rate(curve, 0.5, "SB", half * (nodes + 1))
    assert half * weights @ np.abs(rate) == pytest.approx(1.0421906109874948, rel=1e-11)
    density = 0.5 * speed + 0.5**2 / 2 * rate  # 1 + t mu k > 0 throughout
    assert half * weights @ density == pytest.approx(0.6197261736265631, rel=1e-11)


def test_the_timelike_helix_is_singular_where_the_oracle_says(tmp_path):
    # O08: t* = 1 / (k sin theta0), a Lorentz length along the unit ruling
    (case,) = [o for o in oracles.ORACLES if o.name.startswith("O08")]
    part = built(tmp_path, f'kind = "{case.kind}"\n{case.surface}')
    frame = part.panels[0].chain.patches[0].frame([0.0])
    lorentz = np.sqrt(abs(frame.e[0] @ (LORENTZ * frame.e[0])))
    assert -frame.q[0] / frame.a[0] * lorentz == pytest.approx(15.100468643017033, rel=1e-11)
