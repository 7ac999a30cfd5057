"""Mechanisms in a cylinder, built and exported, against their circle and their sheet."""

import json
from pathlib import Path

import ezdxf
import numpy as np
import pytest
from constructing import refusal

import devcad
from devcad.export import Options
from devcad.geometry.constructions import SURFACES
from devcad.geometry.staggering import Span, banded, conflicts, ordered, pinned_through

SAMPLES = Path(__file__).parents[2] / "samples"
O27 = "radius = 10\njoints = [0, 50, 170, 290]\nwidths = 8\npin = 1\n"


def job(folder: Path, surface: str, top: str = "") -> Path:
    path = folder / "linkage.toml"
    path.write_text(
        f'name = "linkage"\n{top}\n[surface]\nkind = "cylindrical-mechanism"\n{surface}'
    )
    return path


def model(surface: str) -> object:
    import tomllib

    return SURFACES["cylindrical-mechanism"].model_validate(
        {"kind": "cylindrical-mechanism", **tomllib.loads(surface)}
    )


def test_worked_case_o27_in_the_exported_files(tmp_path):
    part = devcad.build(job(tmp_path, O27))
    devcad.export(part, tmp_path / "out", formats=["dxf"])
    report = json.loads((tmp_path / "out" / "linkage" / "report.json").read_text())
    (told,) = report["mechanisms"]
    assert (told["grashof"], told["conformal"]) == (True, "open")
    lengths = [8.452365234813989, 17.320508075688775, 17.320508075688775, 11.471528727020923]
    spacings = [8.726646259971648, 20.943951023931955, 20.943951023931955]
    np.testing.assert_allclose(told["link_lengths"], lengths, rtol=1e-12)
    np.testing.assert_allclose([r["flat_spacing"] for r in told["links"][:3]], spacings, rtol=1e-12)
    for panel, length in zip(report["panels"], lengths, strict=True):
        assert panel["figures"]["link_length"] == pytest.approx(length, rel=1e-12)
    for k, spacing in enumerate(spacings, start=1):  # between the holes that are cut
        space = ezdxf.readfile(tmp_path / "out" / "linkage" / f"linkage-{k}.dxf").modelspace()
        holes = np.array([(*hole.dxf.center, hole.dxf.radius) for hole in space.query("CIRCLE")])
        assert len(holes) == 4
        np.testing.assert_allclose(holes[:, 3], 0.5, rtol=1e-12)
        assert np.ptp(holes[:, 1]) == pytest.approx(spacing, rel=1e-12)


def test_all_links_come_in_one_drawing_too(tmp_path):
    part = devcad.build(job(tmp_path, O27))
    options = Options(dxf_together=True)
    devcad.export(part, tmp_path / "out", formats=["dxf"], options=options)
    folder = tmp_path / "out" / "linkage"
    names = {path.name for path in folder.glob("*.dxf")}
    assert names == {f"linkage-{k}.dxf" for k in (1, 2, 3, 4, "together")}
    space = ezdxf.readfile(folder / "linkage-together.dxf").modelspace()
    centres = np.array([(hole.dxf.center.x, hole.dxf.center.y) for hole in space.query("CIRCLE")])
    # widths of 8 mm, 10 mm apart, holes 1.5 mm from their edges; the lowest row is level
    row = np.sort(centres[np.isclose(centres[:, 1], 1.5), 0])
    np.testing.assert_allclose(row, np.ravel([[k + 1.5, k + 6.5] for k in (0, 18, 36, 54)]))
    assert len(centres) == 16


@pytest.mark.parametrize(
    ("top", "more", "radius"),
    [
        ("thickness = 0.5", "layers = [0, 1, 2, -1]", [10.0, 10.5, 11.0, 9.5]),
        ('thickness = 0.5\nreference = "front"', "", [10.25] * 4),
        ('thickness = 0.5\nreference = "back"', "layers = [2, 2, 2, 2]", [10.75] * 4),
        ("thickness = 0.5\n[recipe.neutral]\nk = 0.4", "", [9.95] * 4),
    ],
)
def test_each_link_is_cut_at_its_own_neutral_radius(top, more, radius, tmp_path):
    part = devcad.build(job(tmp_path, O27 + more, top))
    for panel, link, own in zip(part.panels, part.linkages[0].links, radius, strict=True):
        figures = panel.facts["figures"]
        assert figures["neutral_radius"] == pytest.approx(own, rel=1e-12)
        assert figures["flat_spacing"] == pytest.approx(own * abs(link.sweep), rel=1e-12)
        assert figures["link_length"] == pytest.approx(20 * np.sin(abs(link.sweep) / 2), rel=1e-12)


def test_living_hinges_keep_one_sheet_with_scores_as_far_apart_as_the_joints(tmp_path):
    part = devcad.build(job(tmp_path, O27.replace("pin = 1", 'hinge = "living"')))
    (panel,) = part.panels
    scores = [line for line in panel.pattern.drawings if line.name == "SCORE"]
    heights = sorted(float(line.curve(line.u[:1])[0][0, 1]) for line in scores)
    np.testing.assert_allclose(np.diff(heights), 10 * np.radians([50, 120, 120]), rtol=1e-12)
    assert panel.facts["figures"]["link_2_flat_spacing"] == pytest.approx(20.943951023931955)


def test_perforations_leave_bridges(tmp_path):
    surface = O27.replace("pin = 1", 'hinge = "living"\nperforation = [1.5, 0.5, 0.2]')
    (panel,) = devcad.build(job(tmp_path, surface)).panels
    # four rows of as many cuts as leave a bridge everywhere; a slot is a bar with round ends
    cut = 4 * 3 * (1.3 * 0.2 + np.pi * 0.1**2)
    assert panel.facts["area"] == pytest.approx(8 * (20 * np.pi - 0.1) - cut, rel=1e-12)


def test_knuckles_of_links_in_one_band_share_it_and_lie_apart(tmp_path):
    surface = (
        'radius = 20\njoints = [0, 90, 180, 270]\nwidths = 10\nhinge = "tab"\npin = 1\nreach = 3\n'
        "knuckles = 5\nclearance = 0.2"
    )
    part = devcad.build(job(tmp_path, surface))
    assert {link.band for link in part.linkages[0].links} == {((0.0, 10.0),)}
    # a quarter with ears; off it three fingers at one end (two beyond the edge, to the clearance)
    # and two at the other, each as deep as a knuckle and the clearance beyond both
    depth = 3 + 3.2
    area = 10 * (10 * np.pi + 6) - depth * (2 * 2.1 + 2.2) - depth * 2 * 2.2
    for panel in part.panels:
        assert panel.facts["area"] == pytest.approx(area, rel=1e-12)


def test_crossed_links_have_bands_in_an_order_that_no_pin_passes_a_link():
    linkage = model('links = [14, 24, 18, 25]\nconformal = "crossed"\nhinge = "tab"').linkage()
    bands = [link.band[0] for link in linkage.links]
    assert bands[0] == bands[2]
    assert bands[0][0] > min(bands[1][0], bands[3][0])
    assert bands[0][1] < max(bands[1][1], bands[3][1])


def test_bands_keep_links_apart_that_touch_or_cover_one_another():
    spans = [Span(np.radians(a), np.radians(s), 0.05) for a, s in ((0, 50), (50, 120), (170, 120))]
    spans.append(Span(np.radians(290), np.radians(70), 0.05))
    assert banded(4, conflicts(spans, interleaved=False, slack=0.0)) == (0, 1, 0, 1)
    assert banded(4, conflicts(spans, interleaved=True, slack=0.0)) == (0, 0, 0, 0)
    covering = [
        Span(0.0, 1.0, 0.0),
        Span(1.0, -0.6, 0.0),
        Span(0.4, 1.2, 0.0),
        Span(1.6, -1.6, 0.0),
    ]
    bands = banded(4, conflicts(covering, interleaved=True, slack=0.0))
    assert len(set(bands)) == 4
    assert len(pinned_through(covering, ordered(covering, bands, 0.0), 0.0)) <= len(
        pinned_through(covering, bands, 0.0)
    )


@pytest.mark.parametrize("way", [1, -1])
def test_a_link_of_half_a_turn_goes_on_in_the_others_direction(way):
    # in floats 170 degrees are less than 350 less 180
    joints = [way * angle for angle in (170, 350, 390, 470)]
    surface = model(f'radius = 10\njoints = {joints}\nhinge = "living"')
    (half, *others) = (link.sweep for link in surface.linkage().links)
    assert half == way * np.pi
    assert sum(others) == pytest.approx(way * np.pi, abs=1e-13)
    (sheet,) = surface.build().panels
    assert np.ptp(sheet.patches[0].domain) < 2.0 * np.pi


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"radius": 1}, "links or a radius"),
        ({"radius": 1, "joints": [0, 0, 90, 180]}, "are the same"),
        ({"radius": 1, "joints": [0, 50, 170, 290], "widths": [1, 2]}, "2 widths for 4 links"),
        ({"radius": 1, "joints": [0, 50, 170, 290], "bands": [0, 0, 1, 1]}, "lie in one another"),
        ({"links": [1, 1, 1, 1], "hinge": "living", "pin": 1}, "does not belong"),
        ({"links": [1, 1, 1, 1], "widths": 1, "pin": 0.3}, "too narrow"),
        ({"radius": 10, "joints": [0, 50, 170, 290], "reach": 28}, "goes round onto itself"),
        ({"radius": 10, "joints": [0, 0.01, 170, 290]}, "too short for hinges"),
        ({"links": [1, 1, 1, 1, 1], "conformal": "crossed"}, "no one crossed pose"),
    ],
)
def test_what_cannot_be_made_is_refused(table, says):
    error = refusal(kind="cylindrical-mechanism", **table)
    assert says in error.what
    assert error.remedy


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tube-fourbar", "gripper", "eight-link-ring"])
def test_links_of_the_samples_are_solids_that_do_not_touch(name):
    from manifold3d import Manifold, Mesh64

    solids = []
    for panel in devcad.build(SAMPLES / f"{name}.toml").panels:
        corners = panel.mesh.vertices[panel.mesh.triangles].reshape(-1, 3)
        # the skins and the walls of a mesh have their own vertices at the edges
        points, index = np.unique(corners.round(9), axis=0, return_inverse=True)
        solids.append(Manifold(Mesh64(points, index.reshape(-1, 3).astype(np.uint64))))
    for k, one in enumerate(solids):
        assert one.volume() > 0
        for other in solids[k + 1 :]:
            assert (one ^ other).volume() == pytest.approx(0.0, abs=1e-6)
