"""What must not change the answer: motion, scale, mirror, reversal, parameter, splitting."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from patches import ellipse_cylinder, frustum, helix_tangent, slanted_pipe
from strategies import natural_equations, rigid_motions, scales

from devcad.assemble import assemble
from devcad.flatten.development import develop, develop_chain
from devcad.flatten.outline import lay_out, surface_area
from devcad.geometry import taylor
from devcad.geometry.chain import Chain, link
from devcad.geometry.constructions.tangent import Tangent
from devcad.geometry.curves import NaturalCurve
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.rulings import place
from devcad.making import PanelSpec

PARTS = {
    "frustum": frustum(sweep=5.0),
    "helix": helix_tangent(30.0, 15.0, 100.0, (25.0, 80.0)),
    "ellipse": ellipse_cylinder(90.0, 60.0, 30.0),
    "pipe": slanted_pipe(40.0),
}
parts = st.sampled_from(sorted(PARTS))


def outline_points(patch: Patch) -> np.ndarray:
    """Points of the pattern's boundary at the same material places, (n, 2)."""
    development = develop(patch)
    t = np.linspace(*patch.domain, 40)
    f = patch.frame(t)
    return np.concatenate([development.points(t, f.v_from), development.points(t, f.v_to)])


def reparametrised(patch: Patch, bend: float) -> Patch:
    """The same strip by the parameter s with t = t0 + L (s + bend s (1 - s)), s in [0, 1]."""
    low, length = patch.domain[0], patch.domain[1] - patch.domain[0]

    def field(s, order):
        x = taylor.variable(s, order)
        t = length * ((1.0 + bend) * x - bend * taylor.mul(x, x))
        t[0] += low
        jet = patch.field(t[0], order)
        return RulingJet(
            *(taylor.compose(series, t) for series in (jet.c0, jet.e, jet.v_from, jet.v_to))
        )

    return Patch(field, (0.0, 1.0))


def backwards(patch: Patch) -> Patch:
    """The same strip run from its end, rulings reversed too: the front stays the front."""
    low, high = patch.domain

    def field(s, order):
        jet = patch.field(low + high - s, order)
        sign = ((-1.0) ** np.arange(order + 1)).reshape(-1, 1)
        turned = [sign * jet.v_from, sign * jet.v_to]
        sign = sign[..., None]
        return RulingJet(sign * jet.c0, -sign * jet.e, -turned[1], -turned[0])

    return Patch(field, patch.domain)


@given(name=parts, motion=rigid_motions())
def test_moving_the_part_leaves_its_pattern_where_it_is(name, motion):
    moved = PARTS[name].transformed(motion)
    np.testing.assert_allclose(
        outline_points(moved),
        outline_points(PARTS[name]),
        atol=1e-10,  # 1e-13 of 1 m
    )


@given(name=parts, scale=scales(1e-3, 1e3))
def test_scaling_the_part_scales_its_pattern(name, scale):
    np.testing.assert_allclose(
        outline_points(PARTS[name].scaled(scale)) / scale, outline_points(PARTS[name]), atol=1e-10
    )


@pytest.mark.slow
@given(equations=natural_equations())
def test_a_tangent_surface_unrolls_to_the_turning_of_its_curve(equations):
    # the flat edge has the same curvature, so its turning is the integral of the curvature
    curvature, torsion, mean = equations
    curve = NaturalCurve(kind="natural", curvature=curvature, torsion=torsion, t=(0, 1))
    surface = Tangent(kind="tangent", curve=curve, extent=(0.1 / mean, 0.3 / mean))
    (patch,) = surface.build().panels[0].patches
    nodes, weights = np.polynomial.legendre.leggauss(60)
    k = eval(curvature, {"sin": np.sin, "t": 0.5 * (nodes + 1)})  # our own text
    turning = develop(patch).series(np.array([1.0]))[0, 0]
    assert turning == pytest.approx(0.5 * weights @ k, rel=1e-11)


@pytest.mark.parametrize("name", PARTS)
def test_mirroring_the_part_mirrors_its_pattern_and_turns_its_bends(name):
    mirror = np.diag([1.0, 1.0, -1.0, 1.0])
    patch, image = PARTS[name], PARTS[name].transformed(mirror)
    # the ruling is still +x and t still grows towards +y: the same outline, bent the other way
    np.testing.assert_allclose(outline_points(image), outline_points(patch), atol=1e-10)
    t = np.linspace(*patch.domain, 9)[1:-1]
    np.testing.assert_allclose(image.frame(t).c, -patch.frame(t).c, rtol=1e-12)


@given(name=parts, bend=st.floats(-0.6, 0.6))
def test_another_parameter_gives_the_same_strip(name, bend):
    patch, other = PARTS[name], reparametrised(PARTS[name], bend)
    s = np.linspace(0.0, 1.0, 40)
    low, high = patch.domain
    t = low + (high - low) * (s + bend * s * (1.0 - s))
    one, two = develop(patch), develop(other)
    np.testing.assert_allclose(
        two.points(s, other.frame(s).v_to), one.points(t, patch.frame(t).v_to), atol=1e-10
    )
    assert surface_area(other) == pytest.approx(surface_area(patch), rel=1e-12)


@pytest.mark.parametrize("name", PARTS)
def test_running_the_strip_backwards_gives_the_congruent_pattern(name):
    patch, other = PARTS[name], backwards(PARTS[name])
    between = lambda x: np.linalg.norm(x[:, None] - x[None], axis=-1)  # noqa: E731
    t = np.linspace(*patch.domain, 30)
    one = develop(patch).points(t, patch.frame(t).v_to)
    s = patch.domain[0] + patch.domain[1] - t
    two = develop(other).points(s, other.frame(s).v_from)
    np.testing.assert_allclose(between(two), between(one), atol=1e-10)
    # not mirrored: the front is still towards the viewer
    turn = lambda x: np.cross(np.append(x[5] - x[0], 0), np.append(x[20] - x[0], 0))[2]  # noqa: E731
    assert turn(two) == pytest.approx(turn(one), rel=1e-9, abs=1e-9)
    np.testing.assert_allclose(other.frame(s[1:-1]).n, patch.frame(t[1:-1]).n, atol=1e-12)


@pytest.mark.slow
@given(name=parts, share=st.floats(0.05, 0.95))
def test_splitting_the_strip_changes_neither_pattern_nor_area(name, share):
    patch = PARTS[name]
    low, high = patch.domain
    cut = low + share * (high - low)
    chain = link(
        (patch.restricted(low, cut), patch.restricted(cut, high)), base_closed=False, tolerance=1e-9
    )
    developments = develop_chain(chain)
    t = np.linspace(low, high, 40)
    part = np.where(t <= cut, 0, 1)
    v = patch.frame(t).v_to
    whole = develop(patch).points(t, v)
    split = np.where(
        (part == 0)[:, None], developments[0].points(t, v), developments[1].points(t, v)
    )
    np.testing.assert_allclose(split, whole, atol=1e-10)
    pattern = lay_out(chain, developments, tuple(np.array(p.domain) for p in chain.patches))
    assert pattern.area == pytest.approx(surface_area(patch), rel=1e-12)
    assert [line.layer for line in pattern.lines if line.angle] == []


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e2])
@pytest.mark.parametrize("thickness", [0.0, 0.01])
def test_the_whole_build_is_similar_to_itself(scale, thickness):
    def panel(k: float):
        spec = PanelSpec("p", "frustum", (frustum(),), True, k, None, 0.0, None)
        part = assemble(
            "p",
            [spec],
            thickness=100 * k * thickness,
            reference="middle",
            tolerance=0.05 * k,
            bend=1.0,
        )
        return part.panels[0]

    one, other = panel(1.0), panel(scale)
    assert len(one.rulings[0]) == len(other.rulings[0])
    np.testing.assert_allclose(other.mesh.vertices, scale * one.mesh.vertices, atol=1e-9 * scale)
    assert other.pattern.area == pytest.approx(scale**2 * one.pattern.area, rel=1e-12)
    assert other.facts["clearance"] == pytest.approx(scale * one.facts["clearance"], rel=1e-12)


def test_a_finer_tolerance_keeps_the_pattern():
    coarse, fine = (place(frustum(), (0.0,), tolerance).t for tolerance in (1.0, 0.01))
    assert len(fine) > 5 * len(coarse)
    chain = Chain((frustum(),))
    developments = develop_chain(chain)
    boxes = [lay_out(chain, developments, (t,)).bbox for t in (coarse, fine)]
    assert boxes[0] == boxes[1]
