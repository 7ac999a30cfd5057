"""Trimming by planes, against closed forms, conservation of area, and the plane itself."""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from patches import frustum, helix_tangent, prism

from devcad.errors import GeometryError
from devcad.geometry.chain import Chain, link
from devcad.geometry.constructions import SURFACES
from devcad.geometry.drawing import Drawing
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array
from devcad.geometry.trimming import Trimmed, trimmed

GAUSS, WEIGHTS = np.polynomial.legendre.leggauss(40)
EXACT = 1e-12  # rounding of sums of a hundred terms


def area(patches: Sequence[Patch], parts: int = 16) -> float:
    """The integral of q + v a over t and v, by Gauss quadrature: shape alone, no pattern."""
    total = 0.0
    for patch in patches:
        for low, high in zip(patch.ends[:-1], patch.ends[1:], strict=True):
            ends = np.linspace(low, high, parts + 1)
            half = 0.5 * np.diff(ends)[:, None]
            f = patch.frame((0.5 * (ends[:-1] + ends[1:])[:, None] + half * GAUSS).ravel())
            across = f.q * (f.v_to - f.v_from) + 0.5 * f.a * (f.v_to**2 - f.v_from**2)
            total += float(((half * WEIGHTS).ravel() * across).sum())
    return total


def cut(
    patches: tuple[Patch, ...], point: Sequence[float], normal: Sequence[float], closed: bool = True
) -> Trimmed:
    return trimmed(patches, np.array(point), np.array(normal), base_closed=closed)


def chain(found: Trimmed) -> Chain:
    """The patches as the house links them: neighbours share a ruling or it raises."""
    return link(found.patches, base_closed=found.base_closed, tolerance=0.05)


def rail(patch: Patch, name: str, count: int = 33) -> Array:
    jet = patch.jet(np.linspace(*patch.domain, count), 0)
    return np.asarray(jet.rail(getattr(jet, name))[0])


def rectangle(width: float = 40.0, height: float = 30.0) -> tuple[Patch, ...]:
    keys = {"kind": "plane", "width": width, "height": height}
    return SURFACES["plane"].model_validate(keys).build().panels[0].patches


# --- tubes ---------------------------------------------------------------------------------


def test_a_tube_cut_by_a_slanted_plane_is_the_oracle_o48() -> None:
    found = cut((frustum(10, 10, 50),), [0, 0, 20], [-1, 0, 1])
    (patch,) = found.patches
    assert chain(found).closed
    assert area([patch]) == pytest.approx(1256.6370614359173, rel=EXACT)
    t = np.linspace(0.0, 2 * np.pi, 50)
    assert patch.jet(t, 0).v_to[0] == pytest.approx(20 + 10 * np.cos(t), abs=1e-13)


@pytest.mark.parametrize("order", [0, 1, 5, 12])
def test_the_new_extent_has_derivatives_of_every_order(order: int) -> None:
    patch = cut((frustum(10, 10, 50),), [0, 0, 20], [-1, 0, 1]).patches[0]
    t = np.array([0.3, 1.9, 4.0])
    series = patch.jet(t, order).v_to
    for k in range(order + 1):
        exact = 10 * np.cos(t + 0.5 * np.pi * k) / factorial(k) + (20 if k == 0 else 0)
        assert series[k] == pytest.approx(exact, abs=1e-14 if k else 1e-13)


def test_an_elbow_piece_mitred_at_both_ends_unrolls_to_its_axis_times_its_girth() -> None:
    """Both ends are ellipses about the axis: what one side lacks the other has too much."""
    steep = np.tan(np.pi / 8)
    one = cut((frustum(50, 50, 300),), [100, 0, 200], [steep, 0, 1])
    both = cut(one.patches, [100, 0, 100], [steep, 0, -1])
    axis = 100 + 2 * 100 * steep
    assert chain(both).closed
    assert area(both.patches) == pytest.approx(2 * np.pi * 50 * axis, rel=EXACT)


def test_where_the_plane_leaves_the_rim_the_patch_is_split_there() -> None:
    """z <= 20 + x on a tube of height 25: the rim is met where cos t = 1/2."""
    found = cut((frustum(10, 10, 25),), [0, 0, 20], [-1, 0, 1])
    third = np.pi / 3
    assert [patch.domain for patch in found.patches] == [
        (0.0, pytest.approx(third, abs=1e-15)),
        (pytest.approx(third, abs=1e-15), pytest.approx(5 * third, rel=1e-15)),
        (pytest.approx(5 * third, rel=1e-15), 2 * np.pi),
    ]
    assert chain(found).closed
    above = 10 * 10 * (2 * np.sin(third) - third)  # of 20 + 10 cos t over 25, off the slanted tube
    assert area(found.patches) == pytest.approx(1256.6370614359173 - above, rel=EXACT)


def test_a_corner_between_two_pieces_is_one_point_to_the_bit() -> None:
    found = cut((frustum(10, 10, 25),), [0, 0, 20], [-1, 0, 1])
    for before, after in zip(found.patches[:-1], found.patches[1:], strict=True):
        one, other = rail(before, "v_to")[-1], rail(after, "v_to")[0]
        assert (one == other).all()


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_tube_split_along_its_axis_is_open(side: float) -> None:
    """With the seam in what is left, the piece runs over it."""
    found = cut((frustum(10, 10, 25),), [5 * side, 0, 0], [side, 0, 0])
    assert not found.base_closed
    assert not chain(found).closed
    assert area(found.patches) == pytest.approx(25 * 10 * 4 * np.pi / 3, rel=EXACT)


def test_a_steep_plane_leaves_a_hoof_that_ends_in_two_tips() -> None:
    """z <= r x / r with the seam inside: the hoof's side has the area 2 r h."""
    found = cut((frustum(10, 10, 50),), [0, 0, 0], [-2, 0, 1])
    assert not found.base_closed
    assert area(found.patches) == pytest.approx(2 * 10 * 20, rel=EXACT)
    for patch, end in ((found.patches[0], 0), (found.patches[-1], -1)):
        jet = patch.jet(patch.domain, 0)
        assert jet.v_to[0, end] == jet.v_from[0, end]


@pytest.mark.parametrize("turn", [0.0, 1.0, np.pi])
def test_a_throat_of_no_length_opens_the_tube_there(turn: float) -> None:
    """z <= 10 + 10 cos(t - turn): the plane only touches the lower rim, in a point."""
    found = cut((frustum(10, 10, 25),), [0, 0, 10], [-np.cos(turn), -np.sin(turn), 1])
    assert not chain(found).closed
    assert found.patches[0].domain[0] == pytest.approx((turn + np.pi) % (2 * np.pi), abs=1e-7)
    assert area(found.patches) == pytest.approx(2 * np.pi * 100, rel=EXACT)


# --- cones, planes, prisms, tangent surfaces ---------------------------------------------------


@pytest.mark.parametrize("steep", [0.1, 0.5, 1.2])
def test_a_cone_cut_obliquely_has_the_area_of_its_shadow_over_the_sine(steep: float) -> None:
    """The shadow of the ellipse is one with a focus on the axis: r = L / (1 - eps cos phi)."""
    tan = 0.5
    found = cut((frustum(0.5 * 300, 0.0, 300),), [0, 0, 200], [-steep, 0, -1])
    shadow_parameter, eps = 100 * tan, steep * tan
    exact = np.pi * shadow_parameter**2 / (1 - eps**2) ** 1.5 / np.sin(np.arctan(tan))
    assert chain(found).closed
    assert area(found.patches) == pytest.approx(exact, rel=EXACT)
    assert np.abs(rail(found.patches[0], "v_from") @ [-steep, 0, -1] + 200).max() < 1e-11


def test_a_plane_through_the_apex_leaves_a_sector() -> None:
    found = cut((frustum(30, 0, 40),), [0, 0, 40], [1, 0, 0])
    assert area(found.patches) == pytest.approx(0.5 * np.pi * 30 * 50, rel=EXACT)


def test_a_rectangle_cut_along_its_diagonal_is_a_triangle_with_a_tip() -> None:
    found = cut(rectangle(), [40, 0, 0], [3, 4, 0], closed=False)
    (patch,) = found.patches
    assert area([patch]) == pytest.approx(0.5 * 40 * 30, rel=EXACT)
    jet = patch.jet([30.0], 0)
    assert jet.v_from[0, 0] == jet.v_to[0, 0] == 0.0


def test_a_rectangle_cut_across_a_corner_keeps_a_pentagon() -> None:
    found = cut(rectangle(), [30, 30, 0], [1, 1, 0], closed=False)
    assert [patch.domain for patch in found.patches] == [(0.0, 20.0), (20.0, 30.0)]
    assert area(found.patches) == pytest.approx(40 * 30 - 50, rel=EXACT)


def test_a_rectangle_cut_along_a_ruling_is_a_shorter_one() -> None:
    found = cut(rectangle(), [0, 12, 0], [0, 5, 0], closed=False)
    assert found.patches[0].domain == (0.0, pytest.approx(12.0, rel=1e-15))


def test_a_prism_cut_obliquely_keeps_walls_of_their_mean_height() -> None:
    corners = np.array([[0.0, 0], [30, 0], [30, 20], [0, 20]])
    walls = prism(corners, 100.0)
    found = cut(walls, [0, 0, 40], [-0.5, 0.25, 1])
    height = 40 + corners @ [0.5, -0.25]
    length = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    exact = (length * 0.5 * (height + np.roll(height, -1))).sum()
    assert chain(found).closed
    assert len(found.patches) == 4
    assert area(found.patches) == pytest.approx(exact, rel=EXACT)


def test_a_plane_through_a_crease_leaves_no_sliver() -> None:
    """The crease lies in the plane to rounding only: the walls on one side stay whole."""
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    corners = np.array([[0.0, 0], [30, 0], [30, 20], [0, 20]]) @ turn.T
    across = turn @ [20.0, 30.0]  # normal of the diagonal through corners 1 and 3
    found = cut(prism(corners, 10.0), [*corners[1], 0], [*across, 0])
    assert found.sources == (3, 0)
    assert area(found.patches) == pytest.approx(10 * 50, rel=EXACT)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.3, -0.2, 1.0)])
def test_both_sides_of_a_cut_tangent_surface_make_the_whole(normal: Sequence[float]) -> None:
    whole = (helix_tangent(3.0, 4.0, 10.0, (1.0, 6.0)),)
    point = [0.0, 0.0, 6.0]
    sides = [cut(whole, point, sign * np.array(normal), closed=False) for sign in (1.0, -1.0)]
    total = sum(area(side.patches) for side in sides)
    assert total == pytest.approx(area(whole), rel=EXACT)
    for side, sign in zip(sides, (1.0, -1.0), strict=True):
        for patch in side.patches:
            for name in ("v_from", "v_to"):
                above = sign * (rail(patch, name) - point) @ normal
                assert above.max() < 1e-12


# --- what does not matter ------------------------------------------------------------------


@settings(deadline=None, max_examples=25)
@given(
    angles=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    shift=st.tuples(*[st.floats(-1e3, 1e3)] * 3),
    factor=st.sampled_from([1e-3, 0.7, 1.0, 25.4, 1e3]),
)
def test_moving_or_scaling_panel_and_plane_alike_changes_no_share(
    angles: tuple[float, float, float], shift: tuple[float, float, float], factor: float
) -> None:
    matrix = np.eye(4)
    for axis, angle in enumerate(angles):
        turn = np.eye(4)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn[[i, i, j, j], [i, j, i, j]] = [
            np.cos(angle),
            -np.sin(angle),
            np.sin(angle),
            np.cos(angle),
        ]
        matrix = matrix @ turn
    matrix[:3, 3] = shift
    point, normal = np.array([2.0, 1.0, 30.0]), np.array([0.4, -0.3, 1.0])
    cone = frustum(40, 20, 50)
    plain = trimmed((cone,), point, normal, base_closed=True)
    moved = trimmed(
        (cone.transformed(matrix, factor),),
        factor * matrix[:3, :3] @ point + matrix[:3, 3],
        matrix[:3, :3] @ normal,
        base_closed=True,
    )
    rounding = 1e-12 * (1 + 1e3 / (40 * factor))  # far away the numbers say less of the part
    assert area(moved.patches) == pytest.approx(factor**2 * area(plain.patches), rel=rounding)


def test_the_normals_length_does_not_matter() -> None:
    for size in (1e-9, 1.0, 1e9):
        found = cut((frustum(10, 10, 50),), [0, 0, 20], [-size, 0, size])
        assert area(found.patches) == pytest.approx(1256.6370614359173, rel=EXACT)


def test_drawings_go_with_every_part_of_their_patch() -> None:
    def path(u: Array) -> tuple[Array, Array, Array, Array]:
        return u, 5.0 + 0.0 * u, np.ones_like(u), np.zeros_like(u)

    found = cut((frustum(10, 10, 25),), [0, 0, 20], [-1, 0, 1])
    carried = found.carried([Drawing("ENGRAVE", 0, path, (0.0, 6.0))])
    assert [drawing.patch for drawing in carried] == [0, 1, 2]


# --- refusals ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("point", "normal", "what"),
    [
        ([0, 0, 60], [0, 0, 1], "cuts nothing off"),
        ([0, 0, 50], [0, 0, 1], "cuts nothing off"),
        ([0, 0, 50], [0, 0, -1], "cuts everything off"),
        ([0, 0, -1], [0, 0, 1], "cuts everything off"),
    ],
)
def test_a_useless_plane_is_refused_with_a_remedy(
    point: list[float], normal: list[float], what: str
) -> None:
    with pytest.raises(GeometryError, match=what) as error:
        cut((frustum(10, 10, 50),), point, normal)
    assert error.value.remedy


def test_a_plane_through_a_ruling_that_touches_the_regression_curve_is_refused() -> None:
    """Beside it the plane runs along the regression curve, where it would meet the rulings."""
    whole = helix_tangent(3.0, 4.0, 10.0, (0.0, 6.0))
    jet = whole.jet([5.0], 1)
    normal = np.cross(jet.e[0, 0], [0.0, 0.0, 1.0])
    with pytest.raises(GeometryError, match="lies in the plane") as error:
        trimmed((whole,), jet.c0[0, 0], normal, base_closed=False)
    assert error.value.value == pytest.approx(5.0, abs=1e-6)  # a double root


def test_a_plane_that_leaves_two_pieces_says_where_they_begin() -> None:
    """A sheet bent to half a tube: the plane leaves both its feet."""
    half = (frustum(10, 10, 25, np.pi),)
    with pytest.raises(GeometryError, match=r"2 pieces, beginning at t = 0, 2\.09"):
        cut(half, [0, 5 * np.sqrt(3), 0], [0, 1, 0], closed=False)
