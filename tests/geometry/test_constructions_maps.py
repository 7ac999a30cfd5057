"""Gores and conic maps against Snyder's worked examples, spheres, cones and cylinders."""

from __future__ import annotations

import numpy as np
import pytest
from constructing import area, build, inside, patch, refusal
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ellipe

from devcad.errors import GeometryError, JobError, LimitError
from devcad.flatten.development import develop
from devcad.geometry.classify import classify
from devcad.geometry.constructions.projections import conic

EXACT = 1e-12  # relative: rounding of a few hundred operations
CONES = ("equidistant", "lambert", "albers")


def table(**keys):
    """A map of the globe of radius 1 from 10 to 70 degrees north."""
    usual = {"radius": 1, "parallels": [20, 60], "latitudes": [10, 70], "longitudes": [-30, 60]}
    return {"kind": "conic-map"} | usual | keys


def figures(**keys):
    (panel,) = build(**table(**keys)).panels
    return {name: figure.value for name, figure in panel.figures.items()}


# --- gores ---------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [3, 4, 12, 360])
def test_gores_make_a_globe_of_tangent_cylinders(count):
    built = build(kind="gore", radius=2, count=count, panels="all")
    assert len(built.panels) == count
    whole = sum(area(panel.patches[0]) for panel in built.panels)
    assert whole == pytest.approx(4 * count * 4 * np.tan(np.pi / count), rel=EXACT)
    for k in (0, 1, count - 1):
        (gore,) = built.panels[k].patches
        longitude = 2 * np.pi * k / count
        t = inside(gore)
        sphere = np.array([np.cos(t) * np.cos(longitude), np.cos(t) * np.sin(longitude), np.sin(t)])
        frame = gore.frame(t)
        np.testing.assert_allclose(frame.c0, 2 * sphere.T, atol=1e-15 * 2)
        np.testing.assert_allclose(frame.n, sphere.T, atol=1e-15)  # it touches, front outside
        assert classify(gore).radius == pytest.approx(2, rel=EXACT)


@pytest.mark.parametrize("count", [3, 12])
def test_neighbouring_gores_meet_along_their_whole_seam(count):
    built = build(kind="gore", radius=2, count=count, panels="all")
    chain = [panel.patches[0] for panel in built.panels]
    for west, east in zip(chain, chain[1:] + chain[:1], strict=True):
        t = inside(west)
        np.testing.assert_allclose(
            west.point(t, west.jet(t, 0).v_to[0]),
            east.point(t, east.jet(t, 0).v_from[0]),
            atol=1e-15 * 8,
        )


@pytest.mark.parametrize("count", [3, 12, 360])
def test_a_seam_is_half_an_ellipse_and_both_are_equally_long(count):
    (panel,) = build(kind="gore", radius=2, count=count).panels
    west, east = (panel.figures[name].value for name in ("seam_west", "seam_east"))
    long = 2 / np.cos(np.pi / count)
    assert west == pytest.approx(2 * long * ellipe(1 - (2 / long) ** 2), rel=EXACT)
    assert west == pytest.approx(east, rel=1e-15)
    assert panel.figures["radial_error"].value == pytest.approx(long - 2, rel=EXACT)
    assert panel.figures["count"].value == count


def test_a_gore_ends_in_exact_points_on_the_axis():
    gore = patch(kind="gore", radius=100, count=12)
    jet = gore.jet(gore.domain, 0)
    np.testing.assert_array_equal(jet.v_from, 0.0)
    np.testing.assert_array_equal(jet.v_to, 0.0)
    np.testing.assert_array_equal(jet.c0[0], [[0, 0, -100], [0, 0, 100]])


def test_a_gore_unrolls_to_a_strip_of_half_width_tan_cos():
    gore = patch(kind="gore", radius=3, count=8)
    t = inside(gore)
    flat = develop(gore).points(t, gore.jet(t, 0).v_to[0])
    # the pattern's +y is the meridian from the south pole, its +x east
    wide = 3 * np.tan(np.pi / 8) * np.cos(t)
    np.testing.assert_allclose(flat, np.column_stack([wide, 3 * (t + np.pi / 2)]), atol=1e-14)


@pytest.mark.parametrize("count", [2, 0, -3, 3.5])
def test_a_globe_has_three_gores_or_more(count):
    with pytest.raises(ValueError, match="count"):
        build(kind="gore", radius=1, count=count)


# --- projections ---------------------------------------------------------------------------

SNYDER = {  # Map Projections: A Working Manual, pages 296, 298 and 292: seven digits
    "lambert": ([33, 45], 23, (0.2966785, 0.2462112)),
    "equidistant": ([29.5, 45.5], 23, (0.2952057, 0.2424021)),
    "albers": ([29.5, 45.5], 23, (0.2952720, 0.2416774)),
}


@pytest.mark.parametrize("projection", SNYDER)
def test_the_pattern_is_snyders_map_moved_rigidly(projection):
    parallels, origin, expected = SNYDER[projection]
    sheet = patch(
        **table(
            projection=projection,
            parallels=parallels,
            latitudes=[origin, 35],
            longitudes=[-96, -75],
        )
    )
    east = np.radians([-75.0])
    jet = sheet.jet(east, 0)
    (place,) = develop(sheet).points(east, jet.v_from[0])
    rho0 = jet.v_to[0, 0]
    # the first meridian is the pattern's +x axis with the apex at 0, Snyder's is -y from rho0
    np.testing.assert_allclose([place[1], rho0 - place[0]], expected, atol=6e-8)


def test_o39_albers_to_twelve_digits():
    sheet = patch(
        **table(
            projection="albers", parallels=[29.5, 45.5], latitudes=[23, 35], longitudes=[-96, -75]
        )
    )
    (place,) = develop(sheet).points(np.radians([-75.0]), sheet.jet([0.0], 0).v_from[0])
    n = figures(projection="albers", parallels=[29.5, 45.5])["n"]
    assert n == pytest.approx(0.6028370046288244, rel=EXACT)
    assert sheet.jet([0.0], 0).v_to[0, 0] == pytest.approx(1.5562263294996077, rel=EXACT)
    assert place[1] == pytest.approx(0.2952720069922353, rel=EXACT)
    assert 1.5562263294996077 - place[0] == pytest.approx(0.24167744921848097, rel=EXACT)


def test_o37_equidistant_conic():
    sheet = patch(**table(projection="equidistant", latitudes=[20, 40]))
    assert sheet.jet([0.0], 0).v_from[0, 0] == pytest.approx(1.1429519287572978, rel=EXACT)
    values = figures(projection="equidistant", latitudes=[39.999, 40])
    assert values["n"] == pytest.approx(0.6298132863519681, rel=EXACT)
    assert np.radians(values["half_aperture_deg"]) == pytest.approx(0.6813128090199201, rel=EXACT)
    assert conic("equidistant", *np.radians([20, 60])).parallel(np.radians(40)) == pytest.approx(
        0.9396926207859084, rel=EXACT
    )


def test_o41_cylindrical_equal_area():
    keys = {"projection": "cylindrical-equal-area", "parallels": 30, "latitudes": [0, 45]}
    sheet = patch(**table(**keys, longitudes=[0, 60]))
    (place,) = develop(sheet).points(np.radians([60.0]), np.array([0.0]))
    # the pattern's +x runs south from 45 degrees, its +y east
    np.testing.assert_allclose(place, [0, 0.9068996821171089], atol=1e-14)
    assert sheet.jet([0.0], 0).v_to[0, 0] == pytest.approx(0.816496580927726, rel=EXACT)
    np.testing.assert_allclose(
        sheet.point([0.5], [0.816496580927726]),
        [[np.cos(np.pi / 6) * np.cos(0.5), np.cos(np.pi / 6) * np.sin(0.5), 0.0]],
        atol=1e-15,
    )


def scales(projection, latitude, step=1e-5):
    """The scales along the meridian and the parallel, from distances on the sheet."""
    half = np.degrees(step)
    sheet = patch(
        **table(
            projection=projection, latitudes=[latitude - half, latitude + half], longitudes=[0, 1]
        )
    )
    jet = sheet.jet([0.0], 1)
    across = np.linalg.norm(jet.c0[1] + 0.5 * (jet.v_from[0] + jet.v_to[0])[:, None] * jet.e[1])
    return (jet.v_to[0, 0] - jet.v_from[0, 0]) / (2 * step), across / np.cos(np.radians(latitude))


@pytest.mark.parametrize("latitude", [12.0, 35.0, 66.0])
def test_each_projection_keeps_what_it_is_named_for(latitude):
    # central differences over 1e-5 rad: 1e-10 of the third derivative, 1e-16/1e-5 of rounding
    close = 1e-9
    h, k = scales("equidistant", latitude)
    assert h == pytest.approx(1, rel=close)
    h, k = scales("lambert", latitude)
    assert h == pytest.approx(k, rel=close)
    for name in ("albers", "cylindrical-equal-area"):
        parallels = {} if name == "albers" else {"parallels": 30}
        sheet = patch(**table(projection=name, latitudes=[latitude, latitude + 5], **parallels))
        zone = np.sin(np.radians(latitude + 5)) - np.sin(np.radians(latitude))
        assert area(sheet) == pytest.approx(np.pi / 2 * zone, rel=EXACT)


@pytest.mark.parametrize("projection", CONES)
@pytest.mark.parametrize(
    "parallels", [[20, 60], [60, 20], [-20, -60], [-10, 60], 40, [40], [40, 40]]
)
def test_the_standard_parallels_have_the_globes_radii_and_on_the_mean_its_heights(
    projection, parallels
):
    listed = [parallels] if isinstance(parallels, int) else parallels
    sides = []
    for p in listed:
        sheet = patch(
            **table(
                projection=projection, parallels=parallels, latitudes=[p - 5, p], longitudes=[0, 90]
            )
        )
        (point,) = sheet.point([0.0], sheet.jet([0.0], 0).v_from[0])
        assert point[0] == pytest.approx(np.cos(np.radians(p)), rel=EXACT)
        sides.append(point[2] - np.sin(np.radians(p)))
    assert np.mean(sides) == pytest.approx(0, abs=1e-14)


@pytest.mark.parametrize("projection", CONES)
@pytest.mark.parametrize("south", [False, True])
def test_north_is_up_and_the_front_is_the_outside(projection, south):
    side = -1 if south else 1
    keys = {"parallels": [-60, -20], "latitudes": [-70, -10]} if south else {}
    sheet = patch(**table(projection=projection, **keys))
    assert sheet.domain == pytest.approx(np.radians([-30, 60]))
    t = inside(sheet)
    frame = sheet.frame(t)
    shape = classify(sheet)
    assert shape.type == "cone"
    assert np.sin(shape.half_angle) == pytest.approx(
        abs(figures(projection=projection, **keys)["n"]), rel=1e-11
    )
    np.testing.assert_allclose(shape.point, frame.c0[0], atol=1e-12)
    assert (side * frame.v_from > 0).all()
    assert (frame.e[:, 2] < 0).all()  # southwards
    middle = sheet.point(t, 0.5 * (frame.v_from + frame.v_to))
    np.testing.assert_allclose(np.arctan2(middle[:, 1], middle[:, 0]), t, atol=1e-14)
    outward = np.column_stack([np.cos(t), np.sin(t)])
    assert (np.einsum("ij,ij->i", frame.n[:, :2], outward) > 0.5).all()


@pytest.mark.parametrize("projection", CONES)
def test_the_south_is_the_norths_mirror_image(projection):
    north = patch(**table(projection=projection))
    south = patch(**table(projection=projection, parallels=[-20, -60], latitudes=[-70, -10]))
    t = inside(north)
    low, high = (sheet.jet(t, 0) for sheet in (south, north))
    np.testing.assert_allclose(
        south.point(t, low.v_from[0]), north.point(t, high.v_to[0]) * [1, 1, -1], atol=1e-14
    )


@given(st.sampled_from(CONES), st.floats(-80, 80), st.floats(1e-12, 1e-3))
def test_two_parallels_become_one_without_a_jump(projection, middle, apart):
    if abs(middle) < 1:
        middle += 5
    one = conic(projection, *np.radians([middle, middle]))
    two = conic(projection, *np.radians([middle - apart, middle + apart]))
    assert one.n == pytest.approx(np.sin(np.radians(middle)), rel=EXACT)
    # the difference is of second order in the distance of the parallels
    assert two.n == pytest.approx(one.n, rel=1e-13 + 2e3 * np.radians(apart) ** 2)


@pytest.mark.parametrize("projection", CONES)
def test_the_smallest_scale_along_parallels_is_the_smallest_of_all(projection):
    of = conic(projection, *np.radians([20, 60]))
    sampled = [of.parallel(x) for x in np.radians(np.linspace(20, 60, 40001))]
    assert of.parallel(of.narrowest) == pytest.approx(min(sampled), rel=1e-9)
    values = figures(projection=projection, latitudes=[-20, 70])
    assert values["scale_along_parallels_min"] == pytest.approx(min(sampled), rel=1e-9)
    assert values["scale_along_parallels_max"] == pytest.approx(
        max(of.parallel(x) for x in np.radians([-20, 70])), rel=EXACT
    )


@pytest.mark.parametrize("projection", [*CONES, "cylindrical-equal-area"])
def test_figures_are_finite_up_to_the_poles_and_notes_tell_of_them(projection):
    parallels = 30 if projection.startswith("cyl") else [20, 60]
    (panel,) = build(**table(projection=projection, parallels=parallels, latitudes=[0, 90])).panels
    assert all(np.isfinite(figure.value) for figure in panel.figures.values())
    assert "not to the sphere" in panel.notes[0]
    assert "pole" in panel.notes[1]


@pytest.mark.parametrize(
    ("projection", "limit"), [("equidistant", lambda n: n), ("albers", np.sqrt)]
)
def test_a_pole_that_is_a_standard_parallel_lies_in_the_apex(projection, limit):
    keys = {"parallels": [30, 90], "latitudes": [60, 90]}
    sheet = patch(**table(projection=projection, **keys))
    assert sheet.jet([0.0], 0).v_from[0, 0] == 0.0
    of = conic(projection, *np.radians([30, 90]))
    near = of.parallel(np.radians(90 - 1e-4))
    assert of.parallel(np.radians(90)) == pytest.approx(near, rel=1e-9)
    assert of.parallel(np.radians(90)) == pytest.approx(limit(of.n), rel=EXACT)


# --- graticule -----------------------------------------------------------------------------


def lines(**keys):
    """The graticule as rows (t, v) of three places each."""
    (panel,) = build(**table(projection="albers", **keys)).panels
    out = []
    for drawing in panel.drawings:
        assert (drawing.layer, drawing.patch) == ("ENGRAVE", 0)
        u = np.linspace(*drawing.u, 3)
        t, v, dt, dv = drawing.path(u)
        np.testing.assert_allclose(np.gradient(t, u), dt, atol=1e-12)
        np.testing.assert_allclose(np.gradient(v, u), dv, atol=1e-12)
        out.append((t, v))
    return panel.patches[0], out


def test_the_graticule_lies_at_the_multiples_of_its_step_inside_the_panel():
    sheet, drawn = lines(latitudes=[10, 70], longitudes=[-30, 61])
    meridians = [np.degrees(t[0]) for t, v in drawn if np.ptp(t) == 0]
    np.testing.assert_allclose(meridians, np.arange(-20, 70, 10), atol=1e-12)
    parallels = [(t, v) for t, v in drawn if np.ptp(t) > 0]
    of = conic("albers", *np.radians([20, 60]))
    for latitude, (t, v) in zip(range(20, 70, 10), parallels, strict=True):
        np.testing.assert_allclose(t[[0, -1]], sheet.domain)
        np.testing.assert_allclose(v, of.along(np.radians(latitude)), rtol=EXACT)
    jet = sheet.jet([0.0], 0)
    for _, v in (line for line in drawn if np.ptp(line[0]) == 0):
        np.testing.assert_allclose(v[[0, -1]], [jet.v_from[0, 0], jet.v_to[0, 0]])


def test_the_graticule_of_a_cylinder_has_its_equator_in_the_plane_z_0():
    keys = {"projection": "cylindrical-equal-area", "parallels": 30, "latitudes": [-30, 45]}
    (panel,) = build(**table(**keys, graticule=30)).panels
    # parallels run over the whole domain; that of latitude 0 is the northern one's height down
    parallels = [line for line in panel.drawings if line.u == panel.patches[0].domain]
    heights = [line.path(np.zeros(1))[1][0] for line in parallels]
    equator = parallels[int(np.argmin(np.abs(np.array(heights) - np.sqrt(2 / 3))))]
    t, v, _, _ = equator.path(np.linspace(*equator.u, 5))
    np.testing.assert_allclose(panel.patches[0].point(t, v)[:, 2], 0, atol=1e-15)


def test_no_graticule_and_too_much_of_one():
    assert lines(graticule=0)[1] == []
    assert len(lines(graticule=360)[1]) == 1  # the meridian 0
    error = refusal(**table(projection="albers", graticule=1e-3))
    assert isinstance(error, LimitError)


# --- refusals ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("keys", "kind"),
    [
        ({"projection": "albers", "parallels": [-30, 30]}, GeometryError),
        ({"projection": "albers", "parallels": 0}, GeometryError),
        ({"projection": "lambert", "parallels": [-30, 30 + 1e-9]}, GeometryError),
        ({"projection": "lambert", "parallels": 90}, GeometryError),
        ({"projection": "lambert", "latitudes": [-90, 0]}, GeometryError),
        ({"projection": "lambert", "parallels": -30, "latitudes": [0, 90]}, GeometryError),
        ({"projection": "cylindrical-equal-area", "parallels": [20, 60]}, GeometryError),
        ({"projection": "cylindrical-equal-area", "parallels": 90}, GeometryError),
        ({"projection": "albers", "latitudes": [70, 10]}, JobError),
        ({"projection": "albers", "longitudes": [60, 60]}, JobError),
        ({"projection": "albers", "longitudes": [0, 360.5]}, JobError),
    ],
)
def test_what_is_no_map_is_refused(keys, kind):
    error = refusal(**table(**keys))
    assert isinstance(error, kind)
    assert error.remedy


@pytest.mark.parametrize(
    "keys",
    [{"parallels": [20, 95]}, {"parallels": []}, {"parallels": [1, 2, 3]}, {"latitudes": [0, 91]}],
)
def test_latitudes_lie_between_the_poles(keys):
    with pytest.raises(ValueError, match=r"parallels|latitudes"):
        build(**table(projection="albers", **keys))
