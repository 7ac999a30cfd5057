"""The press brake against closed forms: polygons, bend allowance, cones, and what it refuses."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from patches import cosine_cylinder, ellipse_cylinder, frustum
from scipy.integrate import quad

import devcad
from devcad.errors import GeometryError
from devcad.flatten.bendcells import by_count
from devcad.flatten.bending import stretches
from devcad.flatten.blank import lay_flat
from devcad.geometry import taylor
from devcad.geometry.chain import Chain, link
from devcad.geometry.patch import Patch, RulingJet
from devcad.mesh.build import volume
from devcad.shop.bendlines import bending_order
from devcad.shop.fibre import constant
from devcad.shop.pressbrake import Pressed, pressed
from devcad.shop.settings import Bends
from devcad.shop.springback import kept_share


def press(
    patches, how: Bends, *, fibre=None, thickness=0.0, bend=1.0, closed=False, flow=None
) -> Pressed:
    chain = link(tuple(patches), base_closed=closed, tolerance=0.05)
    blank = lay_flat(chain, fibre)
    return pressed("p", blank, how, thickness=thickness, bend=bend, tolerance=0.05, flow=flow)


def cylinder(radius: float, sweep: float, height: float = 50.0):
    return frustum(radius, radius, height, sweep)


def corners(chain: Chain):
    """The points where the facets' first rulings meet the base, and the last one's."""
    points = [patch.jet([patch.domain[0]], 0).c0[0, 0] for patch in chain.patches]
    last = chain.patches[-1]
    return np.array([*points, last.jet([last.domain[1]], 0).c0[0, 0]])


@pytest.mark.parametrize(
    ("radius", "degrees", "chord", "hits"),
    [
        (100.0, 90.0, 0.1, 18),
        (100.0, 90.0, 0.05, 25),
        (50.0, 360.0, 0.1, 50),
        (30.0, 200.0, 7.0, 3),
    ],
)
def test_a_cylinder_takes_the_hits_whose_arcs_rise_by_the_chord(
    radius, degrees, chord, hits
) -> None:
    angle = np.radians(degrees)
    assert hits == np.ceil(angle / (2.0 * np.arccos(1.0 - chord / radius)))
    made = press([cylinder(radius, angle)], Bends(chord=chord))
    assert len(made.bends) == hits
    (check,) = [check for check in made.checks if check.name == "chord"]
    assert 0.0 < check.value <= check.limit == chord


@pytest.mark.parametrize("count", [3, 4, 7, 60])
def test_a_tube_becomes_a_regular_prism(count) -> None:
    made = press([cylinder(40.0, 2.0 * np.pi)], Bends(count=count), closed=True)
    assert made.chain.closed
    assert made.figures["closing_gap"] < 1e-11
    side, half = 2.0 * np.pi * 40.0 / count, np.pi / count
    points = corners(made.chain)[1:-1, :2]
    centre = points.mean(axis=0)
    away = np.hypot(*(points - centre).T)
    assert away == pytest.approx(np.full(count, side / (2.0 * np.sin(half))), abs=1e-10)
    # facets touch inside, edges stand out: whichever is further is the distance
    inner, outer = side / (2.0 * np.tan(half)), side / (2.0 * np.sin(half))
    assert made.figures["chord"] == pytest.approx(max(40.0 - inner, outer - 40.0), rel=1e-6)


def test_the_pieces_of_one_smooth_bend_are_bent_as_one() -> None:
    whole = cylinder(100.0, 1.5)
    parts = [whole.restricted(a, b) for a, b in ((0.0, 0.4), (0.4, 0.47), (0.47, 1.5))]
    one, several = press([whole], Bends(count=7)), press(parts, Bends(count=7))
    for a, b in zip(one.bends, several.bends, strict=True):
        assert b.line.start == pytest.approx(a.line.start, abs=1e-10)
        assert b.line.angle == pytest.approx(1.5 / 7, abs=1e-13)
    points = np.array([patch.jet(patch.domain, 0).c0[0] for patch in several.chain.patches])
    assert np.abs(np.diff(points[:, 0], axis=0)).max() > 0.0
    assert several.figures["chord"] == pytest.approx(one.figures["chord"], rel=1e-3)


def test_no_bend_gathers_bending_of_both_signs() -> None:
    # y = cos x bends one way up to x = pi / 2: its tangent has turned by the slope there
    patch = cosine_cylinder()
    chain = Chain((patch,))
    parts = stretches(chain, lay_flat(chain).developments)
    made = press([patch], Bends(angle=np.radians(5.0)))
    assert sum(bend.line.angle for bend in made.bends) == pytest.approx(
        sum(part.angle for part in parts), abs=1e-12
    )
    for part in parts:
        mine = [b.line.angle for b in made.bends if b.line.angle * part.angle > 0.0]
        assert np.ptp(np.abs(mine)) == pytest.approx(0.0, abs=1e-12) or len(parts) > 2


@given(count=st.integers(1, 40), patch=st.sampled_from([ellipse_cylinder(), cylinder(5.0, 3.0)]))
def test_count_is_the_number_of_bends_or_is_refused(count, patch) -> None:
    chain = Chain((patch,))
    parts = stretches(chain, lay_flat(chain).developments)
    least = int(np.ceil(sum(abs(part.angle) for part in parts) / np.radians(150.0)))
    if count < least:
        with pytest.raises(GeometryError, match="too few"):
            by_count(parts, count)
    else:
        assert sum(by_count(parts, count)) == count


def test_the_bend_table_of_a_cone_is_that_of_a_sector() -> None:
    lower, upper, height, count = 200.0, 120.0, 250.0, 24
    made = press([frustum(lower, upper, height)], Bends(count=count), closed=True)
    slant = np.hypot(height, lower - upper)
    sine, cosine = (lower - upper) / slant, height / slant
    apex = np.array([lower / sine, 0.0])  # the pattern begins at (0, 0) along +x
    for k, bend in enumerate(made.bends):
        azimuth = 2.0 * np.pi * (k + 0.5) / count
        way = np.array([-np.cos(azimuth * sine), np.sin(azimuth * sine)])
        assert bend.line.start == pytest.approx(apex + lower / sine * way, abs=1e-9)
        assert bend.line.end == pytest.approx(apex + upper / sine * way, abs=1e-9)
        assert bend.datum == pytest.approx((lower * azimuth, upper * azimuth), abs=1e-9)
        assert bend.line.angle == pytest.approx(2.0 * np.pi * cosine / count, abs=1e-12)
        assert bend.line.radius == pytest.approx((lower / cosine, upper / cosine), rel=1e-12)


def test_a_bend_with_an_inside_radius_has_the_bend_allowance() -> None:
    radius, inside, thickness, k = 50.0, 4.0, 2.0, 0.4
    from devcad.flatten.neutral import Fibre

    fibre = Fibre(thickness, constant(k))
    made = press(
        [cylinder(radius, np.pi / 2)],
        Bends(count=1, inside_radius=inside),
        fibre=fibre,
        thickness=thickness,
    )
    blank = np.pi / 2 * (radius - (0.5 - k) * thickness)
    flat = 0.5 * (blank - np.pi / 2 * (inside + k * thickness))
    leg = flat + inside + 0.5 * thickness
    points = corners(made.full)
    assert np.linalg.norm(points[-1] - points[0]) == pytest.approx(np.hypot(leg, leg), rel=1e-12)
    arc = np.pi / 2 * (inside + 0.5 * thickness)
    assert made.full.patches[1].inside_radius == inside
    assert np.linalg.norm(points[2] - points[1]) == pytest.approx(
        np.sqrt(2.0) * arc / (np.pi / 2), rel=1e-12
    )


def test_half_bent_every_bend_has_half_its_angle() -> None:
    for how in (Bends(count=6), Bends(count=6, inside_radius=2.0)):
        made = press([cylinder(50.0, 1.2)], how, thickness=1.0, bend=0.5)
        ends = [
            made.chain.patches[k].frame([made.chain.patches[k].domain[k]]).n[0] for k in (0, -1)
        ]
        assert np.arccos(ends[0] @ ends[1]) == pytest.approx(0.6, abs=1e-12)
        first = [chain.patches[0].jet([0.0], 0) for chain in (made.full, made.chain)]
        assert np.abs(first[0].c0 - first[1].c0).max() < 1e-12


def test_an_over_bent_bend_springs_back_to_its_angle() -> None:
    flow = 235.0 / 210000.0 / 2.0
    made = press([cylinder(80.0, 1.0)], Bends(count=5), thickness=2.0, flow=flow)
    for bend in made.bends:
        loaded = 80.0 * bend.line.angle / bend.loaded  # the arc keeps its length
        assert bend.line.angle / bend.loaded == pytest.approx(
            float(kept_share(np.array([loaded * flow]))[0]), rel=1e-10
        )
    stiff = press([cylinder(80.0, 1.0)], Bends(count=5), thickness=2.0, flow=0.5 / 80.0)
    assert [bend.loaded for bend in stiff.bends] == [bend.line.angle for bend in stiff.bends]


def test_bends_go_from_both_ends_to_the_middle() -> None:
    assert bending_order(5) == [1, 2, 3, 5, 4]
    assert bending_order(4) == [1, 2, 4, 3]
    assert bending_order(0) == []


def test_strips_that_overlap_are_refused_with_their_place() -> None:
    how = Bends(count=24, inside_radius=150.0)
    with pytest.raises(GeometryError, match=r"no room for a bend .* top edge") as caught:
        press([frustum(200.0, 120.0, 250.0)], how, thickness=1.5, closed=True)
    assert caught.value.value < caught.value.limit
    assert "smaller inside radius" in caught.value.remedy


JOB = """
name = "j"
thickness = {thickness}
[recipe.bends]
mode = "press-brake"
{bends}
[surface]
kind = "{kind}"
{surface}
[[cutout]]
shape = "circle"
diameter = 40
at_surface = [0.47, 0.5]
[[cutout]]
shape = "circle"
diameter = 20
at_surface = [0.3, 0.0]
notch = true
"""


@pytest.mark.parametrize("radius", ["", pytest.param("inside_radius = 3", marks=pytest.mark.slow)])
def test_cuts_are_those_of_the_smooth_part(tmp_path, radius) -> None:
    text = JOB.format(
        thickness=1.0,
        bends=f"angle = 40\n{radius}",
        kind="frustum",
        surface="radius = 60\ntop_radius = 45\nheight = 80\ngap = 1",
    )
    (tmp_path / "j.toml").write_text(text)
    part = devcad.build(tmp_path / "j.toml")
    (panel,) = part.panels
    (hole,) = panel.pattern.holes
    smooth = tmp_path / "s.toml"
    smooth.write_text(
        text.replace('"press-brake"', '"rolled"')
        .replace("angle = 40", "")
        .replace(radius or "-", "")
    )
    other = devcad.build(smooth).panels[0]
    assert panel.pattern.area == pytest.approx(other.pattern.area, rel=1e-13)
    assert panel.area == pytest.approx(other.area, rel=1e-12)  # K = 1/2: bends are not longer
    assert panel.mesh.watertight
    assert len(hole) == len(other.pattern.holes[0])
    lines = [line for line in panel.pattern.lines if line.angle]
    assert len({line.order for line in lines}) == len(panel.bends)
    assert len(lines) > len(panel.bends)  # the hole interrupts some
    report = devcad.export(part, tmp_path, formats=["bends", "rolling"])
    assert report["panels"][0]["figures"]["bend_count"] == len(panel.bends)
    with (tmp_path / "j" / "j-bends.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["number"]) for row in rows] == list(range(1, len(rows) + 1))
    total = np.degrees(sum(bend.line.angle for bend in panel.bends))
    assert float(rows[-1]["cumulative_deg"]) == pytest.approx(total, abs=1e-8)
    assert len((tmp_path / "j" / "j-rolling.csv").read_text().splitlines()) == 1


def test_creases_stand_in_the_table_of_a_press_brake(tmp_path) -> None:
    (tmp_path / "j.toml").write_text(
        """
name = "j"
[recipe.bends]
mode = "press-brake"
count = 4
[surface]
kind = "cylinder"
direction = [0, 0, 1]
length = 30
[surface.directrix]
kind = "chain"
curves = [
  { kind = "line", from = [0, 0, 0], to = [50, 0, 0] },
  { kind = "line", from = [50, 0, 0], to = [50, 40, 0] },
  { kind = "circle", radius = 20, center = [30, 40, 0], sweep = 90 },
]
"""
    )
    (panel,) = devcad.build(tmp_path / "j.toml").panels
    angles = np.degrees([bend.line.angle for bend in panel.bends])
    assert angles == pytest.approx([90.0, *[22.5] * 4], abs=1e-9)
    assert panel.bends[0].line.radius is None
    assert [bend.datum[0] for bend in panel.bends] == pytest.approx(
        [50.0, *(90.0 + 20.0 * np.pi / 2 * (np.arange(4) + 0.5) / 4)], abs=1e-9
    )


def corrugated(length: float) -> Patch:
    """The cylinder of height 30 on x = t, y = 10 sin(t / 20), t up to ``length``."""

    def field(t, order):
        x = taylor.variable(t, order)
        along = np.stack([x, 10.0 * taylor.sin_cos(x / 20.0)[0], np.zeros_like(x)], axis=-1)
        up = taylor.constant_vector([0.0, 0.0, 1.0], order, t.size)
        low, high = (taylor.constant(v, order, t.size) for v in (0.0, 30.0))
        return RulingJet(along, up, low, high)

    return Patch(field, (0.0, length))


@pytest.mark.parametrize("longest", [4.0, 9.0, 25.0])
def test_length_takes_little_more_than_even_pitches(longest) -> None:
    # bends of equal angle would crowd between inflections, where little is left for those beside
    length = 70.0 * np.pi
    made = press([corrugated(length)], Bends(length=longest))
    at = np.array([bend.datum[0] for bend in made.bends])
    total = quad(lambda t: np.hypot(1.0, 0.5 * np.cos(t / 20.0)), 0.0, length, limit=200)[0]
    assert np.diff(at).max() <= longest * (1.0 + 1e-9)
    assert max(at[0], total - at[-1]) <= longest
    stretches_of_it = 4
    assert total / longest - 1.0 <= len(at) <= total / longest + 3 * stretches_of_it
    ends = np.arctan(0.5 * np.cos(np.array([0.0, length]) / 20.0))
    turned = sum(bend.line.angle for bend in made.bends)
    assert abs(turned) == pytest.approx(abs(ends[1] - ends[0]), abs=1e-12)


@pytest.mark.parametrize(
    "how", [Bends(count=501), Bends(angle=1e-12), Bends(chord=1e-9), Bends(length=1e-9)]
)
def test_more_bends_than_are_pressed_are_refused_at_once(how) -> None:
    with pytest.raises(GeometryError, match="limit 500") as caught:
        press([cylinder(80.0, 1.7)], how)
    assert caught.value.value > caught.value.limit == 500


def test_ends_that_lie_in_one_another_are_told() -> None:
    count, radius, angle = 4, 40.0, 2.0 * np.pi + 0.01
    ways = radius * angle / count * np.exp(1j * angle / count * np.arange(count + 1))
    ways[[0, -1]] *= 0.5
    how = Bends(count=count)
    (note,) = press([cylinder(radius, angle)], how, thickness=1.0).notes
    assert f"the ends overlap by {ways.sum().real:.3g} mm" in note
    assert press([cylinder(radius, 2.0 * np.pi - 0.01)], how, thickness=1.0).notes == ()


def test_a_crease_beside_what_is_pressed_is_mitred(tmp_path) -> None:
    # the facets are plane, so that the thick sheet may have a sharp crease in its straight part
    (tmp_path / "j.toml").write_text(
        """
name = "j"
thickness = 1.5
[recipe.bends]
mode = "press-brake"
count = 3
[surface]
kind = "cylinder"
direction = [0, 0, 1]
length = 30
[surface.directrix]
kind = "chain"
curves = [
  { kind = "line", from = [0, 0, 0], to = [50, 0, 0] },
  { kind = "line", from = [50, 0, 0], to = [50, 40, 0] },
  { kind = "circle", radius = 20, center = [30, 40, 0], sweep = 90 },
]
"""
    )
    (panel,) = devcad.build(tmp_path / "j.toml").panels
    assert panel.mesh.watertight
    blank = 30.0 * (50.0 + 40.0 + 20.0 * np.pi / 2)
    assert panel.pattern.area == pytest.approx(blank, rel=1e-12)
    assert volume(panel.mesh) == pytest.approx(1.5 * blank, rel=1e-9)


def test_the_chord_is_seen_beside_a_regression_curve_too() -> None:
    # the tangents of a helix from the helix on: there the surface stands still across its rulings
    radius, rise, longest = 40.0, 60.0 / (2.0 * np.pi), 70.0
    speed = np.hypot(radius, rise)

    def field(t, order):
        sin, cos = taylor.sin_cos(taylor.variable(t, order))
        turn = taylor.variable(t, order)
        helix = np.stack([radius * cos, radius * sin, rise * turn], axis=-1)
        along = taylor.constant(rise, order, t.size)
        tangent = np.stack([-radius * sin, radius * cos, along], axis=-1) / speed
        ends = (taylor.constant(v, order, t.size) for v in (0.0, longest))
        return RulingJet(helix, tangent, *ends)

    made = press([Patch(field, (0.0, 2.0 * np.pi))], Bends(count=42))
    # an arc of the sharpest radius, v tau / k at the top, rises so much over half of a bend
    angle = abs(made.bends[0].line.angle)
    assert made.figures["chord"] < longest * radius / rise * angle**2 / 8.0
