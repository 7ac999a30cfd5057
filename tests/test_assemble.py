"""Whole panels at their edges: thick sheets described by a skin, apexes, mitres, huge parts."""

import numpy as np
import pytest
from patches import frustum

import devcad
from devcad.assemble import assemble
from devcad.errors import GeometryError, LimitError
from devcad.flatten.green import perimeter
from devcad.geometry import taylor
from devcad.geometry.drawing import Drawing
from devcad.geometry.patch import Patch, RulingJet
from devcad.making import PanelSpec
from devcad.mesh.build import volume


def built(folder, text):
    job = folder / "job.toml"
    job.write_text(f'name = "job"\n{text}')
    return devcad.build(job).panels[0]


def facing(mesh):
    corner = mesh.vertices[mesh.triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    return np.einsum("ij,ij->i", across, mesh.normals[mesh.triangles[:, 0]])


@pytest.mark.parametrize(("reference", "sign"), [("front", 1.0), ("back", -1.0)])
def test_the_middle_of_a_frustum_described_by_a_skin_is_steiner_wider(tmp_path, reference, sign):
    # area at distance d along n: A - d * (turning of n) * slant; front: d = -T / 2
    panel = built(
        tmp_path,
        f'thickness = 3\nreference = "{reference}"\n[surface]\nkind = "frustum"\n'
        "radius = 100\ntop_radius = 50\nheight = 120\n",
    )
    turning = 2 * np.pi * 120 / 130
    expected = 61261.05674500097 + sign * 1.5 * turning * 130
    assert panel.facts["area"] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("reference", ["front", "back", "middle"])
@pytest.mark.parametrize("sweep", [360, 200])
def test_a_pointed_cone_ends_in_its_own_apex_on_every_layer(tmp_path, reference, sweep):
    panel = built(
        tmp_path,
        f'thickness = 2\nreference = "{reference}"\ntolerance = 0.001\n[surface]\n'
        f'kind = "frustum"\nradius = 30\ntop_radius = 0\nheight = 40\nsweep = {sweep}\n',
    )
    assert panel.facts["apex"]
    # between the coaxial cones of slant 50 shifted along the axis; the base wall is normal
    share = sweep / 360
    area = panel.facts["area"]
    tip = 2.0**3 / 24 * (2 * np.pi * share) * 0.8**2 / 0.6
    # the described skin ends at its own apex: its slant is 50, the middle's 50 -+ tan
    lift = {"front": -1.0, "back": 1.0, "middle": 0.0}[reference]
    slant = 50.0 - lift * 0.8 / 0.6
    assert area == pytest.approx(0.5 * slant**2 * 2 * np.pi * share * 0.6, rel=1e-12)
    assert volume(panel.mesh) == pytest.approx(2 * area + tip, abs=area * 0.001)


def test_a_sharp_hopper_described_by_its_outside_has_mitred_middle_planes(tmp_path):
    panel = built(
        tmp_path,
        'thickness = 2\nreference = "back"\n[surface]\nkind = "cone"\napex = [0, 0, -400]\n'
        "extent = [0.25, 1]\n[surface.directrix]\n"
        'kind = "polyline"\nclosed = true\n'
        "points = [[200, -200, 0], [200, 200, 0], [-200, 200, 0], [-200, -200, 0]]\n",
    )
    apex = np.array([0.0, 0.0, -400.0])
    middles = [patch.frame([0.5 * sum(patch.domain)]) for patch in panel.chain.patches]
    heights = [abs(f.n[0] @ (f.c0[0] + f.v_from[0] * f.e[0] - apex)) for f in middles]
    np.testing.assert_allclose(heights, 1.0, rtol=1e-12)  # every plane moved by T / 2
    # neighbours still share their ruling, and the rulings' ends stay in two planes z = const
    rims = [f.c0[0] + f.v_to[0] * f.e[0] for f in middles]
    np.testing.assert_allclose([rim[2] for rim in rims], rims[0][2], rtol=1e-12)
    assert (facing(panel.mesh) > 0.0).all()
    error = abs(volume(panel.mesh) - 2 * panel.facts["area"])
    assert error < 1e-9 * panel.facts["area"]  # planes: the mesh is exact


def test_a_flat_fan_described_by_a_skin_is_a_trapezoid(tmp_path):
    panel = built(
        tmp_path,
        'thickness = 3\nreference = "front"\n[surface]\nkind = "cone"\napex = [0, 0, -300]\n'
        'extent = [0.4, 1]\ndirectrix = { kind = "line", from = [0, -100, 0], to = [70, -100, 0] }',
    )
    height = np.hypot(100, 300)
    assert panel.facts["area"] == pytest.approx(0.5 * 70 * height * (1 - 0.4**2), rel=1e-12)


@pytest.mark.parametrize("start", [0.0, 0.01, 0.3])
def test_no_triangle_folds_over_beside_the_regression_curve(tmp_path, start):
    panel = built(
        tmp_path,
        f'[surface]\nkind = "tangent"\nextent = [{start}, 30]\n'
        'curve = { kind = "helix", radius = 15, pitch = 20, turns = 0.5 }\n',
    )
    assert (facing(panel.mesh) > 0.0).all()
    corner = panel.mesh.flat[panel.mesh.triangles]
    u, w = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    assert (u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0] > 0.0).all()  # nor in the pattern


@pytest.mark.parametrize("thickness", [15.0, 19.9])
def test_a_very_thick_tube_keeps_its_volume_within_area_times_tolerance(tmp_path, thickness):
    panel = built(
        tmp_path,
        f'thickness = {thickness}\n[surface]\nkind = "cylinder"\nradius = 10\nlength = 30\n',
    )
    area = 2 * np.pi * 10 * 30
    assert abs(volume(panel.mesh) - area * thickness) <= area * 0.05


def test_what_float32_rounds_off_a_large_part_is_left_out_of_its_tolerance(tmp_path):
    panel = built(
        tmp_path,
        '[surface]\nkind = "frustum"\nradius = 9000\ntop_radius = 4000\nheight = 3000\nsweep = 40',
    )
    written = panel.mesh.vertices.astype(np.float32).astype(float)
    moved = np.linalg.norm(written - panel.mesh.vertices, axis=1).max()
    assert panel.mesh.deviation + moved <= 0.05


def test_a_moebius_band_has_no_thickness_without_a_gap():
    # the ruled band of a half turn: not developable, which is allowed here to reach the point
    def field(t, order):
        sin, cos = taylor.sin_cos(taylor.variable(t, order))
        up, out = taylor.sin_cos(0.5 * taylor.variable(t, order))
        e = np.stack([taylor.mul(out, cos), taylor.mul(out, sin), up], axis=-1)
        circle = 50.0 * np.stack([cos, sin, 0.0 * cos], axis=-1)
        v = taylor.constant(5.0, order, t.size)
        return RulingJet(circle, e, -v, v)

    spec = PanelSpec("band", "ruled", (Patch(field, (0.0, 2 * np.pi)),), True, 1.0, None, 0.0, None)

    def assembled(thickness):
        return assemble(
            "band",
            [spec],
            thickness=thickness,
            reference="middle",
            tolerance=0.05,
            bend=1.0,
            allow=frozenset({"twist", "overlap"}),
        )

    facts = assembled(0.0).panels[0].facts
    assert (facts["orientable"], facts["closed"]) == (False, False)
    with pytest.raises(GeometryError, match="Moebius"):
        assembled(1.0)


def test_a_part_in_the_wrong_units_is_refused_before_it_fills_the_memory(tmp_path):
    with pytest.raises(LimitError, match="rulings"):
        built(tmp_path, '[surface]\nkind = "cylinder"\nradius = 1e10\nlength = 1e10\n')


def test_a_middle_edge_square_to_an_aslant_cut_has_corners_where_the_bending_jumps(tmp_path):
    # the front's edge is smooth; at a fillet's end the middle's edge turns, as n' jumps there
    panel = built(
        tmp_path,
        'thickness = 10\nreference = "front"\n[surface]\nkind = "cylinder"\n'
        "direction = [0.3, 0.2, 1]\nextent = [0, 200]\n[surface.directrix]\n"
        'kind = "polyline"\npoints = [[0, 0, 0], [200, 0, 0], [200, 200, 0]]\ncorner_radius = 50\n',
    )
    tops = [edge for edge in panel.pattern.outline if edge.name == "top"]
    assert len(tops) == 3  # line, arc, line
    for edge in tops:
        point, slope = edge.curve(np.linspace(*edge.u[[0, -1]], 5))
        assert np.isfinite(point).all()
        assert np.isfinite(slope).all()
    report = devcad.export(
        devcad.build(tmp_path / "job.toml"), tmp_path / "out", formats=["dxf", "svg"]
    )
    assert {check["name"]: check["passed"] for check in report["checks"]}["dxf-deviation"]


def test_end_walls_that_would_lie_in_one_another_are_refused(tmp_path):
    surface = (
        '[surface]\nkind = "cylinder"\ndirection = [0, 0, 1]\nextent = [0, "50 + 10*t"]\n'
        'directrix = { kind = "circle", radius = 40 }\n'
    )
    assert built(tmp_path, surface).facts["closes"] is False
    with pytest.raises(GeometryError, match="does not return to its start"):
        built(tmp_path, f"thickness = 1\n{surface}")


def test_an_unbent_pointed_cone_with_thickness_is_built_at_once(tmp_path):
    panel = built(
        tmp_path,
        'thickness = 2\nbend = 0\n[surface]\nkind = "frustum"\nradius = 54\ntop_radius = 0\n'
        "height = 103\nsweep = 90\n",
    )
    assert volume(panel.mesh) == pytest.approx(2 * panel.facts["area"], abs=0.05 * 2 * 5000)


@pytest.mark.slow
def test_a_pipe_with_a_wavy_end_reaches_step(tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(
        'name = "job"\nthickness = 1\n[surface]\nkind = "cylinder"\nradius = 40\n'
        'extent = [0, "60 + 5*sin(40*t)"]\n'
    )
    part = devcad.build(job)
    assert part.panels[0].facts["area"] == pytest.approx(2 * np.pi * 40 * 60, rel=1e-12)
    report = devcad.export(part, tmp_path / "out", formats=["step"])
    deviation = {check["name"]: check["value"] for check in report["checks"]}["step-deviation"]
    assert deviation <= 1e-4


def circled(patches, cut=None, gap=0.0, mm_per_unit=1.0):
    """A closed cone frustum with the parallel half way up and a line across it at t = 1."""
    one = np.ones_like
    lines = []
    for k, patch in enumerate(patches):
        around = Drawing("ENGRAVE", k, lambda u: (u, 65 * one(u), one(u), 0 * u), patch.domain)
        lines.append(around)
    across = Drawing("ENGRAVE", 0, lambda u: (one(u), u, 0 * u, one(u)), (0.0, 130.0))
    spec = PanelSpec(
        "p", "cone", patches, True, mm_per_unit, cut, gap, None, drawings=(*lines, across)
    )
    part = assemble(
        "p", [spec], thickness=0, reference="middle", tolerance=0.05 * mm_per_unit, bend=1.0
    )
    return part.panels[0].pattern


HALVES = (frustum().restricted(0, 2), frustum().restricted(2, 2 * np.pi))


@pytest.mark.parametrize("patches", [(frustum(),), HALVES], ids=["one patch", "two"])
@pytest.mark.parametrize("cut", [None, 0.4, 2.0, 5.0, 2 * np.pi])
def test_drawings_stay_where_they_are_when_a_tube_is_opened_elsewhere(patches, cut):
    # on the flattened frustum the parallel is 195 from the apex, whole, the other line radial;
    # their angle from the first ruling is t sin(half angle)
    pattern = circled(patches, cut)
    arms = [(e, e.curve(e.u[[0, -1]])[0] - [260.0, 0.0]) for e in pattern.drawings]
    around = [(e, arm) for e, arm in arms if abs(np.hypot(*arm[0]) - np.hypot(*arm[1])) < 1]
    np.testing.assert_allclose([np.hypot(*arm.T) for _, arm in around], 195.0, rtol=1e-12)
    length = sum(perimeter((e,)) for e, _ in around)
    assert length == pytest.approx(2 * np.pi * 50 / 130 * 195, rel=1e-9)
    ((_, across),) = [pair for pair in arms if pair[0] not in [e for e, _ in around]]
    np.testing.assert_allclose(sorted(np.hypot(*across.T)), [130.0, 260.0], rtol=1e-12)
    turned = np.pi - np.arctan2(across[0, 1], across[0, 0])
    start = 0.0 if cut is None else cut
    assert turned == pytest.approx((1 - start) % (2 * np.pi) * 50 / 130, rel=1e-12)


def test_a_gap_cuts_the_drawings_that_it_removes():
    # the gap of 10 mm at the lower edge, radius 100, is a chord: t = 2 pi - 2 asin(0.05)
    (around, _) = circled((frustum(),), gap=10.0).drawings
    angle = 2 * np.pi - 2 * np.arcsin(0.05)
    assert perimeter((around,)) == pytest.approx(angle * 50 / 130 * 195, rel=1e-9)


def test_drawings_are_in_the_units_of_the_job():
    (around, across) = circled((frustum(),), mm_per_unit=25.4).drawings
    arm = around.curve(around.u[:1])[0][0] - [260.0 * 25.4, 0.0]
    assert np.hypot(*arm) == pytest.approx(195.0 * 25.4, rel=1e-12)
    assert perimeter((across,)) == pytest.approx(130.0 * 25.4, rel=1e-12)
