"""Curved creases in the cut drawings: one stroke of arcs on the layer SCORE, as other programs'
code reads it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import ezdxf
import ezdxf.path
import numpy as np
import pytest
from folds import RADIUS, SWEEP, folded
from pages import form, layers

from devcad.export import Options, dxf, pdf, svg
from devcad.part import Part

EXACT = 1e-12  # relative: rounding


def scores(part: Part, folder: Path, **options: Any) -> tuple[float, list[Any]]:
    """The deviation that a DXF file states, and its entities on the layer SCORE."""
    (made,) = dxf.write(part, folder, Options(**options))
    document = ezdxf.readfile(made.path)
    assert not document.audit().has_errors
    return made.max_deviation, [e for e in document.modelspace() if e.dxf.layer == "SCORE"]


def test_the_crease_of_an_annulus_is_one_arc_about_the_middle_of_its_edges(tmp_path: Path) -> None:
    """The pattern's first ruling lies along +x from the crease, so that the middle is (-60, 0)."""
    deviation, (arc,) = scores(folded("annulus"), tmp_path)
    assert (deviation, arc.dxftype(), arc.dxf.color) == (0.0, "ARC", 4)
    assert arc.dxf.radius == pytest.approx(RADIUS, rel=EXACT)
    np.testing.assert_allclose(tuple(arc.dxf.center)[:2], [-RADIUS, 0.0], atol=1e-10)
    turn = (arc.dxf.end_angle - arc.dxf.start_angle) % 360.0
    assert turn == pytest.approx(SWEEP, rel=EXACT)


@pytest.mark.slow
@pytest.mark.parametrize(("version", "kind"), [("R12", "POLYLINE"), ("R2000", "LWPOLYLINE")])
def test_a_crease_of_two_arcs_is_one_stroke_of_two_bulges(
    version: str, kind: str, tmp_path: Path
) -> None:
    deviation, (stroke,) = scores(folded("bends"), tmp_path, dxf_version=version)
    assert (deviation, stroke.dxftype()) == (0.0, kind)
    read = stroke.vertices if version == "R12" else stroke.get_points("b")
    bulges = [v.dxf.bulge if version == "R12" else v[0] for v in read]
    np.testing.assert_allclose(bulges[:2], np.tan(np.radians([40.0, 70.0]) / 4.0), rtol=1e-9)


def test_a_parabola_is_scored_within_the_tolerance_by_arcs_end_to_end(tmp_path: Path) -> None:
    """Laid back on its chord, from (-40, 16) to (40, 16), every point is near y = x^2 / 100."""
    deviation, (stroke,) = scores(folded("parabola"), tmp_path)
    assert stroke.dxftype() == "LWPOLYLINE"
    assert all(bulge for (bulge,) in stroke.get_points("b")[:-1])
    flattened = ezdxf.path.make_path(stroke).flattening(1e-5)
    points = np.array([tuple(p)[:2] for p in flattened])
    assert np.hypot(*(points[-1] - points[0])) == pytest.approx(80.0, rel=1e-10)
    along = (points[-1] - points[0]) / 80.0
    across = np.array([-along[1], along[0]])
    x, y = -40.0 + (points - points[0]) @ along, 16.0 + (points - points[0]) @ across
    off = np.abs(y - x**2 / 100.0) / np.hypot(1.0, x / 50.0)
    assert off.max() <= deviation + 1e-5 <= 0.005 + 1e-5  # a tenth of the tolerance; flattening


def test_svg_scores_the_crease_by_its_arc(tmp_path: Path) -> None:
    """A quarter of a turn to the left, which in the drawing's y downwards is sweep flag 0."""
    (made,) = svg.write(folded("annulus"), tmp_path, Options())
    (group,) = re.findall(r'<g id="SCORE"[^>]*>(.*?)</g>', made.path.read_text(), re.DOTALL)
    (data,) = re.findall(r'<path d="M(\S+) (\S+) A(\S+) (\S+) 0 0 0 (\S+) (\S+)"/>', group)
    x, y, radius, same, to_x, to_y = map(float, data)
    assert radius == same == pytest.approx(RADIUS, rel=EXACT)
    np.testing.assert_allclose([to_x - x, to_y - y], [-RADIUS, -RADIUS], rtol=1e-10)


def test_pdf_scores_the_crease_on_its_own_layer(tmp_path: Path) -> None:
    """In Beziers whose ends and middles are on the circle."""
    (made,) = pdf.write(folded("annulus"), tmp_path, Options())
    text = layers(form(made.path.read_bytes()))["SCORE"]
    numbers = re.findall(r"-?[\d.]+", text[text.index(" d\n") + 3 :])
    points = np.array(numbers, dtype=float).reshape(-1, 2)
    ends, handles = points[::3], points[1:].reshape(-1, 3, 2)[:, :2]
    middles = (ends[:-1] + 3.0 * handles[:, 0] + 3.0 * handles[:, 1] + ends[1:]) / 8.0
    to_centre = np.hypot(*(np.concatenate([ends, middles]) - [-RADIUS, 0.0]).T)
    np.testing.assert_allclose(to_centre, RADIUS, atol=made.max_deviation + 1e-7)
    np.testing.assert_allclose(ends[[0, -1]], [[0.0, 0.0], [-RADIUS, RADIUS]], atol=1e-7)
