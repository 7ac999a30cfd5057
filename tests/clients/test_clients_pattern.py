"""Patterns as a shop's programs see them: one closed contour of the reported size."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import ezdxf.path
import numpy as np
import pytest
from exported import Exported, Look
from numpy.typing import NDArray

pytestmark = pytest.mark.clients

COLOURS = {
    "CUT_OUTER": 7,
    "CUT_INNER": 1,
    "BEND_UP": 3,
    "BEND_DOWN": 5,
    "RULING": 9,
    "ENGRAVE": 6,
    "MARK": 2,
    "SCORE": 4,
}
MILLIMETRES = 4  # $INSUNITS


def test_a_shop_finds_one_closed_contour_and_nothing_odd(exported: Exported) -> None:
    for path in exported.files("dxf"):
        drawing = ezdxf.readfile(path)
        assert not drawing.audit().has_errors
        assert drawing.header["$INSUNITS"] == MILLIMETRES
        model = list(drawing.modelspace())
        outer = [entity for entity in model if entity.dxf.layer == "CUT_OUTER"]
        assert [entity.dxftype() for entity in outer] == ["LWPOLYLINE"]
        assert outer[0].closed
        assert {e.dxftype() for e in model} <= {"LWPOLYLINE", "LINE", "CIRCLE", "ARC"}
        assert {e.dxf.layer: e.dxf.color for e in model}.items() <= COLOURS.items()
        repeated = [key for key, times in Counter(map(_key, model)).items() if times > 1]
        assert not repeated


def test_the_contour_is_counterclockwise_without_tiny_segments(exported: Exported) -> None:
    for path in exported.files("dxf"):
        points = _contour(path)
        x, y = points.T
        assert np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0.0
        corners = np.array([(v[0], v[1]) for v in _outer(path).get_points("xy")])
        assert np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).min() > 1e-4  # mm


def test_the_contour_encloses_the_reported_flat_area(exported: Exported) -> None:
    """A contour within d of the true one encloses its area to d times its length."""
    for path, panel in zip(exported.files("dxf"), exported.panels, strict=True):
        area = _enclosed(_contour(path)) - sum(area for area, _ in _holes(path))
        allowed = _distance(exported, panel) * panel["cut_length"]
        assert area == pytest.approx(panel["flat_area"], abs=allowed)


def test_the_contour_fills_the_reported_box(exported: Exported) -> None:
    for path, panel in zip(exported.files("dxf"), exported.panels, strict=True):
        points = _contour(path)
        box = [*points.min(axis=0), *points.max(axis=0)]
        allowed = _distance(exported, panel)
        np.testing.assert_allclose(box, panel["flat_bbox"], rtol=0, atol=allowed)


def test_reference_lines_stay_on_the_panel(exported: Exported) -> None:
    from shapely import LineString, Polygon

    for path, panel in zip(exported.files("dxf"), exported.panels, strict=True):
        outline = Polygon(_contour(path)).buffer(2.0 * _distance(exported, panel))
        for entity in ezdxf.readfile(path).modelspace().query("LINE"):
            line = LineString([tuple(entity.dxf.start)[:2], tuple(entity.dxf.end)[:2]])
            assert outline.covers(line)


def test_quoting_tools_see_a_closed_polyline(exported: Exported, in_node: Look) -> None:
    for path in exported.files("dxf"):
        seen = in_node(path)
        assert seen["units"] == MILLIMETRES
        assert seen["version"] == "AC1015"
        outer = [entity for entity in seen["entities"] if entity["layer"] == "CUT_OUTER"]
        assert [(e["type"], e["closed"]) for e in outer] == [("LWPOLYLINE", True)]
        assert outer[0]["vertices"] == len(_outer(path))


def test_freecad_imports_the_contour_at_true_length(exported: Exported, in_freecad: Look) -> None:
    for path, panel in zip(exported.files("dxf"), exported.panels, strict=True):
        layers = in_freecad(path)["layers"]
        length = sum(layer["length"] for name, layer in layers.items() if name.startswith("CUT_"))
        assert length == pytest.approx(panel["cut_length"], rel=1e-5)  # arcs against the true edge


@pytest.mark.parametrize("layer", ["ENGRAVE", "SCORE"])
def test_freecad_imports_what_is_drawn_on_the_sheet_at_its_length(
    exported: Exported, in_freecad: Look, layer: str
) -> None:
    for path in exported.files("dxf"):
        layers = in_freecad(path)["layers"]
        found = sum(seen["length"] for name, seen in layers.items() if name.startswith(layer))
        drawn = ezdxf.readfile(path).modelspace().query(f'*[layer=="{layer}"]')
        paths = [ezdxf.path.make_path(entity, segments=64) for entity in drawn]
        steps = (pairwise(line.flattening(1e-4)) for line in paths)
        length = sum((b - a).magnitude for pairs in steps for a, b in pairs)
        assert found == pytest.approx(length, rel=1e-5)  # chords of 0.1 um against arcs


def test_freecad_imports_the_svg_at_true_size(exported: Exported, in_freecad: Look) -> None:
    for path, panel in zip(exported.files("svg"), exported.panels, strict=True):
        outline = in_freecad(path)["outline"]
        (drawing,) = (d for d in exported.files("dxf") if d.stem == path.stem)
        length = panel["cut_length"] - sum(length for _, length in _holes(drawing))
        assert outline["length"] == pytest.approx(length, rel=1e-5)


PER_ARC = 1024  # points on an arc
SAGITTA = 6e-7  # between them, over the diameter of a half circle: (pi / 2 / PER_ARC)^2 / 4


def _distance(exported: Exported, panel: dict[str, Any]) -> float:
    """How far the contour's points may lie from the true outline, mm."""
    x0, y0, x1, y1 = panel["flat_bbox"]
    return exported.deviation("dxf") + SAGITTA * max(x1 - x0, y1 - y0)


def _outer(path: Path) -> Any:
    return ezdxf.readfile(path).modelspace().query('LWPOLYLINE[layer=="CUT_OUTER"]').first


def _holes(path: Path) -> list[tuple[float, float]]:
    """Area and length of every hole."""
    found = []
    for entity in ezdxf.readfile(path).modelspace().query('*[layer=="CUT_INNER"]'):
        if entity.dxftype() == "CIRCLE":
            radius = entity.dxf.radius
            found.append((np.pi * radius**2, 2.0 * np.pi * radius))
        else:
            points = _points(entity)
            steps = np.roll(points, -1, axis=0) - points
            found.append((-_enclosed(points), float(np.hypot(*steps.T).sum())))
    return found


def _enclosed(points: NDArray[np.float64]) -> float:
    """The area inside a closed contour, positive counterclockwise."""
    x, y = points.T
    return float(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def _contour(path: Path) -> NDArray[np.float64]:
    return _points(_outer(path))


def _points(entity: Any) -> NDArray[np.float64]:
    """Points on a closed contour (n, 2), lines by their ends and arcs densely.

    A vertex's bulge is the tangent of a quarter of the arc's angle, positive
    counterclockwise: p(s) on the arc from a chord d = b - a is a + (sin(s w) / sin w) R(s w - w) d
    with the half angle w = 2 atan(bulge) and R a rotation, 0 <= s <= 1.
    """
    vertices = np.array(entity.get_points("xyb"), dtype=float)
    pieces = []
    for (x, y, bulge), (x1, y1, _) in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
        start, chord = complex(x, y), complex(x1 - x, y1 - y)
        half = 2.0 * np.arctan(bulge)
        s = np.arange(PER_ARC) / PER_ARC if bulge else np.zeros(1)
        ratio = np.sin(s * half) / np.sin(half) if bulge else s
        points = start + ratio * np.exp(1j * (s - 1.0) * half) * chord
        pieces.append(np.stack([points.real, points.imag], axis=1))
    return np.concatenate(pieces)


def _key(entity: Any) -> tuple[object, ...]:
    """Two entities with one key lie on each other."""
    points = list(ezdxf.path.make_path(entity).flattening(0.05))
    length = sum((b - a).magnitude for a, b in pairwise(points))
    ends = sorted((round(p.x, 4), round(p.y, 4)) for p in (points[0], points[-1]))
    return (entity.dxftype(), *ends, round(length, 3))
