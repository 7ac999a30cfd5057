"""The Lorentzian figure as a file: its scale, its shape, and that nobody takes it for a pattern."""

from __future__ import annotations

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import devcad
from devcad.errors import CheckFailed, GeometryError, JobError
from devcad.export import Options, svg
from devcad.export import lorentz as exporter
from devcad.export.profile import profile
from devcad.geometry.taylor import Array
from devcad.part import Part

SVG = "{http://www.w3.org/2000/svg}"
SLANT, SECTOR, AREA = 1.2961085473277707, 9.695461572464488, 8.143690181079727  # O04
CONE = """\
kind = "line-of-curvature"
curve = { kind = "circle", radius = 2 }
metric = "minkowski"
angle = 1
extent = [0, 1.2961085473277707]
"""
TIMELIKE = """\
kind = "line-of-curvature"
curve = { kind = "expression", x = "10*cos(t)", y = "10*sin(t)", z = "20*t", t = [0, 2] }
metric = "minkowski"
causal = "timelike"
angle = 0.2
extent = [0, 8]
"""
PLANE = 'kind = "plane"\nwidth = 20\nheight = 10\n'


def built(folder: Path, surface: str, head: str = "") -> Part:
    job = folder / "job.toml"
    job.write_text(f'name = "figure"\n{head}[surface]\n{surface}')
    return devcad.build(job)


def read(path: Path) -> tuple[ElementTree.Element, dict[str, list[ElementTree.Element]]]:
    root = ElementTree.parse(path).getroot()
    return root, {str(g.get("id")): list(g) for g in root.findall(f"{SVG}g")}


def corners(data: str) -> Array:
    """The ends of a path's segments."""
    words = re.sub(r"[MLAZ]", " ", re.sub(r"A\S+ \S+ 0 0 [01]", "L", data)).split()
    return np.array(words, dtype=float).reshape(-1, 2)


def test_the_spacelike_cone_is_an_exact_sector_of_its_slant(tmp_path):
    part = built(tmp_path, CONE)
    (written,) = exporter.write(part, tmp_path, Options())
    assert written.path == tmp_path / "figure-lorentz-not-for-cutting.svg"
    assert (written.format, written.max_deviation) == ("lorentz-svg", 0.0)
    root, groups = read(written.path)
    (border,) = groups["LORENTZ_OUTLINE"]
    radii = [float(r) for r in re.findall(r"A(\S+)", border.get("d", ""))]
    np.testing.assert_allclose(radii, SLANT, rtol=1e-9)
    points = corners(border.get("d", ""))
    apex = points[1]  # from the rim to the apex and back to the rim
    angles = np.arctan2(*(points[2:-1] - apex).T[::-1])
    steps = np.abs((np.diff(angles) + np.pi) % (2.0 * np.pi) - np.pi)
    last = abs((np.arctan2(*(points[0] - apex)[::-1]) - angles[-1] + np.pi) % (2 * np.pi) - np.pi)
    assert steps.sum() + last == pytest.approx(SECTOR, rel=1e-9)
    width, height = (float(root.get(k, "").removesuffix("mm")) for k in ("width", "height"))
    assert root.get("viewBox") == f"0 0 {root.get('width')[:-2]} {root.get('height')[:-2]}"
    assert points.min() > 0.0
    assert np.all(points.max(axis=0) < [width, height])
    assert part.panels[0].facts["lorentz_area"] == pytest.approx(AREA, rel=1e-12)


def test_it_says_what_it_is_and_has_no_layer_or_colour_of_a_cutter(tmp_path):
    (written,) = exporter.write(built(tmp_path, TIMELIKE), tmp_path, Options())
    root, groups = read(written.path)
    assert list(groups) == ["LORENTZ_RULING", "LORENTZ_OUTLINE", "LORENTZ_TEXT"]
    cutters = {role.layer for role in profile("generic").roles.values()}
    assert not set(groups) & {*cutters, *svg.COLOURS}
    colours = {g.get("stroke") for g in root.iter(f"{SVG}g")} - {"none"}
    assert not colours & set(svg.COLOURS.values())
    told = [text.text for text in groups["LORENTZ_TEXT"]]
    assert told[0] == "Lorentzian unrolling - not for cutting"
    assert "dx^2 - dw^2" in str(told[1])
    assert "not for cutting" in str(root.findtext(f"{SVG}title"))
    height = float(root.get("height", "").removesuffix("mm"))
    assert all(0.0 < float(t.get("y", "nan")) < height for t in groups["LORENTZ_TEXT"])
    assert written.path.read_bytes().isascii()


def test_the_first_ruling_has_its_lorentz_length_in_millimetres(tmp_path):
    """The extent of these surfaces is Lorentz length: 8 mm, or 8 inches."""
    for units, unit in (("mm", 1.0), ("in", 25.4)):
        part = built(tmp_path, TIMELIKE, f'units = "{units}"\n')
        (written,) = exporter.write(part, tmp_path, Options())
        (border,) = read(written.path)[1]["LORENTZ_OUTLINE"]
        start, end = corners(border.get("d", ""))[:2]
        np.testing.assert_allclose(end - start, [8.0 * unit, 0.0], atol=1e-9 * unit)


@pytest.mark.parametrize("curves", ["arcs", "polyline", "spline"])
def test_the_figure_is_within_a_tenth_of_the_tolerance(tmp_path, curves):
    (written,) = exporter.write(built(tmp_path, TIMELIKE), tmp_path, Options(dxf_curves=curves))
    assert 0.0 < written.max_deviation <= 0.005
    assert ("A" in read(written.path)[1]["LORENTZ_OUTLINE"][0].get("d", "")) == (
        curves != "polyline"
    )


def test_thickness_bend_gap_and_place_do_not_change_the_metric(tmp_path):
    """The middle surface is drawn, as it was made: with its own time axis, and not bent."""
    plain = built(tmp_path, TIMELIKE).panels[0].facts["lorentz_area"]
    more = "bend = 0.5\nthickness = 0.2\n[place]\nz_axis = [1, 2, 2]\norigin = [3, 4, 5]\n"
    part = built(tmp_path, TIMELIKE, more)
    assert part.panels[0].facts["lorentz_area"] == pytest.approx(plain, rel=1e-12)
    (written,) = exporter.write(part, tmp_path, Options())
    assert written.checks[0].passed
    wide = built(tmp_path, CONE.replace("[0, 1.2961085473277707]", "[0, 0.5]\ngap = 0.1"))
    rim = 2.0 * np.pi * 2.0
    whole = AREA * (1.0 - (1.0 - 0.5 / SLANT) ** 2)
    assert wide.panels[0].facts["lorentz_area"] == pytest.approx(
        whole * (1.0 - 0.1 / rim), rel=1e-4
    )


def test_only_the_minkowski_panels_of_a_part_are_drawn(tmp_path):
    surface = CONE.replace("[0, 1.2961085473277707]", "[0, 1]")
    job = tmp_path / "job.toml"
    job.write_text(
        f'name = "both"\n[[panel]]\nname = "flat"\n[panel.surface]\n{PLANE}'
        f'[[panel]]\nname = "cone"\n[panel.surface]\n{surface}'
    )
    report = devcad.export(devcad.build(job), tmp_path / "out", formats=["lorentz-svg"])
    assert [f["path"] for f in report["files"]] == ["both-cone-lorentz-not-for-cutting.svg"]
    assert [p["lorentz_area"] is None for p in report["panels"]] == [True, False]
    assert report["svg_origin"] is None


def test_a_part_without_minkowski_surfaces_has_no_figure(tmp_path):
    part = built(tmp_path, PLANE)
    assert part.panels[0].facts["lorentz_area"] is None
    with pytest.raises(JobError, match="this part has none") as caught:
        devcad.export(part, tmp_path / "out", formats=["svg", "lorentz-svg"])
    assert caught.value.code == 2
    assert 'metric = "minkowski"' in caught.value.remedy
    assert not (tmp_path / "out").exists()


def test_a_boost_beyond_drawing_is_refused_by_the_figure_only(tmp_path):
    """A circle as a line of curvature of a timelike cone: the rapidity is 2 pi sinh(theta)."""
    cone = CONE.replace("angle = 1", 'angle = 3\ncausal = "timelike"')
    part = built(tmp_path, cone.replace("1.2961085473277707", "0.1"))
    area = 4.0 * np.pi * 0.1 - np.pi * np.sinh(3.0) * 0.1**2
    assert part.panels[0].facts["lorentz_area"] == pytest.approx(area, rel=1e-12)
    with pytest.raises(GeometryError, match=r"rapidity 62\.9\d, limit 30"):
        exporter.write(part, tmp_path, Options())


def test_equal_input_gives_equal_bytes(tmp_path):
    contents = []
    for name in "ab":
        (tmp_path / name).mkdir()
        (written,) = exporter.write(built(tmp_path, TIMELIKE), tmp_path / name, Options())
        contents.append(written.path.read_bytes())
    assert contents[0] == contents[1]


@pytest.mark.parametrize(
    ("old", "new"),
    [("Z", ""), ("</svg>", ""), ("OUTLINE", "OTHER"), ("A", "L"), ("not for cutting", "cut me")],
)
def test_a_damaged_figure_fails_the_read_back(tmp_path, monkeypatch, old, new):
    document = exporter._document
    monkeypatch.setattr(
        exporter,
        "_document",
        lambda *a, **k: [line.replace(old, new) for line in document(*a, **k)],
    )
    with pytest.raises(CheckFailed, match="svg-readback"):
        exporter.write(built(tmp_path, CONE), tmp_path, Options())
