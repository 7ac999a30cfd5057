"""Holes, notches and marks in DXF and SVG, read back by ezdxf and an XML parser."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import ezdxf
import numpy as np
import pytest
from drawings import job
from handcuts import (
    TURN,
    Piece,
    arc,
    circle,
    cut,
    line,
    on_cone,
    on_cylinder,
    over_seam,
    polygon,
    slot,
    track,
)
from parts import panel as empty_panel
from patches import frustum
from scipy.integrate import quad

from devcad.errors import CheckFailed
from devcad.export import Options, dxf, svg
from devcad.flatten.development import develop_chain
from devcad.flatten.outline import lay_out
from devcad.flatten.pattern import Pattern
from devcad.geometry.chain import link
from devcad.geometry.cuts import Cut
from devcad.geometry.drawing import Drawing
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array
from devcad.part import Part

RADIUS = 30.0
PIPE = frustum(RADIUS, RADIUS, 100.0)
ON_PIPE = on_cylinder(RADIUS)
CONE = frustum(100.0, 50.0, 120.0)
ON_CONE = on_cone(100.0, 50.0, 120.0)
CONE_AREA = np.pi * 150.0 * 130.0
TOLERANCE = 0.05


def sheet(patch: Patch, cuts: tuple[Cut, ...], marks: tuple[Drawing, ...] = ()) -> Pattern:
    chain = link((patch,), base_closed=False, tolerance=1e-3)
    rulings = (np.linspace(*patch.domain, 25),)
    return lay_out(chain, develop_chain(chain), rulings, marks, cuts)


def part(pattern: Pattern) -> Part:
    panel = empty_panel(shapes=(), area=pattern.area, name="sheet")
    return job(replace(panel, pattern=pattern), tolerance=TOLERANCE)


def entities(pattern: Pattern, folder: Path, options: Options | None = None) -> list[Any]:
    (written,) = dxf.write(part(pattern), folder, options or Options())
    assert written.max_deviation <= 0.1 * TOLERANCE
    document = ezdxf.readfile(written.path)
    assert not document.audit().has_errors
    return list(document.modelspace())


def on(found: list[Any], layer: str) -> list[Any]:
    return [entity for entity in found if entity.dxf.layer == layer]


def rows(entity: Any) -> Array:
    if entity.dxftype() == "LWPOLYLINE":
        return np.array(entity.get_points("xyb"))
    return np.array([[v.dxf.location.x, v.dxf.location.y, v.dxf.bulge] for v in entity.vertices])


def area(entity: Any) -> float:
    """Chords and circular segments, as the bulges say; of a circle as if run clockwise."""
    if entity.dxftype() == "CIRCLE":
        return -float(np.pi * entity.dxf.radius**2)
    x, y, bulge = rows(entity).T
    z = x - x[0] + 1j * (y - y[0])
    step = np.roll(z, -1) - z
    chords = 0.5 * (z.conj() * np.roll(z, -1)).imag.sum()
    bent = bulge != 0.0
    sweep = 4.0 * np.arctan(bulge[bent])
    radius2 = np.abs(step[bent]) ** 2 / (4.0 * np.sin(0.5 * sweep) ** 2)
    return float(chords + (0.5 * radius2 * (sweep - np.sin(sweep))).sum())


def shortest(entity: Any) -> float:
    x, y, bulge = rows(entity).T
    chord = np.hypot(np.roll(x, -1) - x, np.roll(y, -1) - y)
    return float((chord / np.sinc(2.0 * np.arctan(bulge) / np.pi)).min())


@pytest.mark.parametrize("version", ["R12", "R2000", "R2010"])
def test_a_round_hole_is_a_circle_also_on_a_cone(tmp_path, version):
    pattern = sheet(CONE, (circle(ON_CONE, (60.0, 30.0), 8.0),))
    found = entities(pattern, tmp_path, Options(dxf_version=version))
    (hole,) = on(found, "CUT_INNER")
    assert hole.dxftype() == "CIRCLE"
    assert hole.dxf.color == 1
    assert tuple(hole.dxf.center)[:2] == pytest.approx((60.0, 30.0), abs=1e-10)
    assert hole.dxf.radius == pytest.approx(8.0, rel=1e-12)
    (outer,) = on(found, "CUT_OUTER")
    assert area(outer) == pytest.approx(CONE_AREA, rel=1e-12)


@pytest.mark.parametrize("version", ["R12", "R2000"])
def test_a_slot_is_two_lines_and_two_half_circles(tmp_path, version):
    pattern = sheet(CONE, (cut(ON_CONE, slot((60.0, 50.0), 40.0, 10.0, 0.4)),))
    (hole,) = on(entities(pattern, tmp_path, Options(dxf_version=version)), "CUT_INNER")
    assert hole.dxftype() == ("POLYLINE" if version == "R12" else "LWPOLYLINE")
    assert rows(hole)[:, 2] == pytest.approx([0.0, -1.0, 0.0, -1.0], abs=1e-10)
    assert area(hole) == pytest.approx(-(300.0 + 25.0 * np.pi), rel=1e-12)  # clockwise


def test_a_hole_on_the_seam_is_exact_arcs_in_the_outline(tmp_path):
    chain = link((CONE,), base_closed=True, tolerance=1e-3)
    hole = cut(ON_CONE, over_seam(65.0, 9.0), period=TURN)
    pattern = lay_out(chain, develop_chain(chain), (np.linspace(0, TURN, 9),), (), (hole,))
    found = entities(pattern, tmp_path)
    assert on(found, "CUT_INNER") == []
    (outer,) = on(found, "CUT_OUTER")
    assert len(rows(outer)) == 8
    assert np.sort(np.abs(rows(outer)[:, 2]))[-2:] == pytest.approx([1.0, 1.0], rel=1e-9)
    assert area(outer) == pytest.approx(CONE_AREA - 81.0 * np.pi, abs=1e-10 * 81.0 * np.pi)


def drilled(y: float, r: float) -> Piece:
    return (
        lambda u: (50.0 + r * np.cos(u), y - RADIUS * np.arcsin(r * np.sin(u) / RADIUS)),
        0.3,
        0.3 + TURN,
    )


def drilled_area(r: float) -> float:
    def strip(s: Array) -> float:
        return float(2.0 * RADIUS * np.arcsin(r * np.cos(s) / RADIUS) * r * np.cos(s))

    return float(quad(strip, -0.5 * np.pi, 0.5 * np.pi, epsabs=1e-12)[0])


@pytest.mark.parametrize("version", ["R12", "R2010"])
@pytest.mark.parametrize("r", [0.5, 8.0, 25.0])
def test_a_drilled_hole_has_its_area_in_the_file(tmp_path, version, r):
    pattern = sheet(PIPE.restricted(0.0, 5.0), (cut(ON_PIPE, [drilled(70.0, r)]),))
    found = entities(pattern, tmp_path, Options(dxf_version=version))
    (hole,) = on(found, "CUT_INNER")
    assert area(hole) == pytest.approx(-drilled_area(r), rel=1e-8)  # the issue's
    assert shortest(hole) >= 0.01
    (outer,) = on(found, "CUT_OUTER")
    assert area(outer) + area(hole) == pytest.approx(pattern.area, rel=1e-11)


@pytest.mark.parametrize("curves", ["polyline", "spline"])
def test_other_curves_close_every_contour(tmp_path, curves):
    cuts = (
        cut(ON_PIPE, [drilled(70.0, 8.0)]),
        circle(ON_PIPE, (20.0, 30.0), 5.0),
        cut(ON_PIPE, polygon((60.0, 20.0), (60.0, 40.0), (80.0, 40.0), (80.0, 20.0))),
    )
    pattern = sheet(PIPE.restricted(0.0, 5.0), cuts)
    found = entities(pattern, tmp_path, Options(dxf_curves=curves))
    inner = on(found, "CUT_INNER")
    kinds = [entity.dxftype() for entity in inner]
    if curves == "polyline":
        assert kinds == ["LWPOLYLINE"] * 3
        assert all(entity.closed and not rows(entity)[:, 2].any() for entity in inner)
        areas = [drilled_area(8.0), 25.0 * np.pi, 400.0]
        # chords of 0.02 mm or less: the area differs by less than length x chord
        assert [-area(entity) for entity in inner] == pytest.approx(areas, abs=0.005 * 80.0)
    else:
        assert kinds == ["SPLINE", "CIRCLE", "LINE", "LINE", "LINE", "LINE"]
        control = np.array(inner[0].control_points)
        assert control[0] == pytest.approx(control[-1], abs=1e-9)


def marked() -> tuple[Drawing, ...]:
    """A line, and a stroke of a line, another at a right angle and an arc."""
    pieces = [
        line((10.0, 20.0), (40.0, 90.0)),
        line((20.0, 10.0), (20.0, 16.0)),
        line((20.0, 16.0), (26.0, 16.0)),
        arc((26.0, 13.0), 3.0, 0.5 * np.pi, np.pi),
    ]
    return tuple(track(ON_PIPE, piece).drawn("MARK") for piece in pieces)


@pytest.mark.parametrize("version", ["R12", "R2000"])
def test_marks_are_lines_and_strokes_on_their_layer(tmp_path, version):
    pattern = sheet(PIPE.restricted(0.0, 5.0), (circle(ON_PIPE, (25.0, 55.0), 6.0),), marked())
    found = entities(pattern, tmp_path, Options(dxf_version=version))
    marks = on(found, "MARK")
    stroke = "POLYLINE" if version == "R12" else "LWPOLYLINE"
    # the hole parts the line in two
    assert [mark.dxftype() for mark in marks] == ["LINE", "LINE", stroke]
    assert {mark.dxf.color for mark in marks} == {2}
    first, second = (np.array([m.dxf.start, m.dxf.end])[:, :2] for m in marks[:2])
    middle = np.array([25.0, 55.0])
    assert first[0] == pytest.approx([10.0, 20.0], abs=1e-11)
    assert second[1] == pytest.approx([40.0, 90.0], abs=1e-11)
    assert np.hypot(*(first[1] - middle)) == pytest.approx(6.0, rel=1e-11)
    assert np.hypot(*(second[0] - middle)) == pytest.approx(6.0, rel=1e-11)
    assert rows(marks[2])[:, :2] == pytest.approx(
        np.array([[20.0, 10.0], [20.0, 16.0], [26.0, 16.0], [26.0, 10.0]]), abs=1e-10
    )
    assert rows(marks[2])[:3, 2] == pytest.approx([0.0, 0.0, -1.0], abs=1e-10)
    cuts = [entity.dxftype() for entity in found if entity.dxf.layer.startswith("CUT")]
    assert cuts == ["CIRCLE", stroke]


def test_a_lost_stroke_is_found_when_read_back(tmp_path, monkeypatch):
    pattern = sheet(PIPE.restricted(0.0, 5.0), (), marked())
    monkeypatch.setattr(dxf, "add_drawings", lambda *_args: None)
    with pytest.raises(CheckFailed, match="dxf-readback"):
        dxf.write(part(pattern), tmp_path, Options())


def test_the_svg_draws_holes_before_the_outline_and_marks_as_strokes(tmp_path):
    holes = (
        circle(ON_PIPE, (25.0, 55.0), 6.0),
        cut(ON_PIPE, slot((70.0, 50.0), 30.0, 8.0, 0.2)),
    )
    (written,) = svg.write(
        part(sheet(PIPE.restricted(0.0, 5.0), holes, marked())), tmp_path, Options()
    )
    space = "{http://www.w3.org/2000/svg}"
    groups = {
        group.get("id"): group
        for group in ElementTree.parse(written.path).getroot().iter(f"{space}g")
    }
    assert list(groups)[-3:] == ["MARK", "CUT_INNER", "CUT_OUTER"]
    data = {name: [path.get("d") for path in group] for name, group in groups.items()}
    assert len(data["CUT_INNER"]) == 2
    assert all(path.endswith("Z") for path in data["CUT_INNER"] + data["CUT_OUTER"])
    assert [path.count("L") for path in data["MARK"]] == [1, 1, 2]
    assert not any(path.endswith("Z") for path in data["MARK"])
    assert groups["CUT_INNER"].get("stroke") == "#0000FF"
    assert written.max_deviation == 0.0
