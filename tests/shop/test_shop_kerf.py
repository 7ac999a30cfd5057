"""Kerf: what is left after a tool of that width has followed the contours is the pattern."""

from __future__ import annotations

import json
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import shapely

from devcad.errors import GeometryError
from devcad.flatten.pattern import Pattern
from devcad.pipeline import build, export, plan
from devcad.shop.kerf import with_kerf
from devcad.shop.polygons import fine_polygon

PLATE = """
name = "plate"
thickness = 1
[surface]
kind = "plane"
width = 100
height = 60
[[cutout]]
shape = "circle"
diameter = 20
at = [30, 30]
[[cutout]]
shape = "rectangle"
width = 20
height = 10
at = [70, 30]
[recipe.sheet]
kerf = 0.2
"""


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("kerf") / "plate.toml"
    path.write_text(PLATE)
    return path


@pytest.fixture(scope="module")
def pattern(plate: Path) -> Pattern:
    return build(plate).panels[0].pattern


def shape(pattern: Pattern) -> shapely.Polygon:
    rings = [fine_polygon(contour, 1e-5)[0] for contour in (pattern.outline, *pattern.holes)]
    return shapely.Polygon(rings[0], rings[1:])


@pytest.mark.parametrize("kerf", [0.2, -0.2, 1.5])
def test_cutting_along_the_middle_of_the_kerf_leaves_the_pattern(
    pattern: Pattern, kerf: float
) -> None:
    cut = with_kerf(pattern, kerf)
    left = shape(cut).buffer(-0.5 * kerf, quad_segs=256, join_style="mitre")
    lost = shapely.symmetric_difference(left, shape(pattern)).area
    assert lost < 1e-3  # mm2, of the round hole's two polygons
    assert cut.area == pytest.approx(shape(cut).area, abs=1e-3)
    reach = 0.5 * kerf * np.array([-1.0, -1.0, 1.0, 1.0])
    assert cut.bbox == pytest.approx(np.array(pattern.bbox) + reach, abs=1e-12)
    assert cut.lines == pattern.lines


def test_no_kerf_changes_nothing(pattern: Pattern) -> None:
    assert with_kerf(pattern, 0.0) is pattern


def test_a_hole_as_narrow_as_the_kerf_is_refused(pattern: Pattern) -> None:
    with pytest.raises(GeometryError, match=r"with a kerf of 10\.2 mm") as caught:
        with_kerf(pattern, 10.2)
    assert caught.value.place
    assert caught.value.remedy


def test_holes_that_grow_into_each_other_are_refused(pattern: Pattern) -> None:
    with_kerf(pattern, -19.9)  # 20 mm from hole to hole, 20 mm from hole to edge
    with pytest.raises(GeometryError, match="meet"):
        with_kerf(pattern, -20.1)


def test_the_cut_file_is_moved_and_the_part_is_not(plate: Path, tmp_path: Path) -> None:
    from devcad.job.load import load

    part = build(plate)
    recipe = plan(load(plate))
    report = export(part, tmp_path, formats=["dxf", "svg", "stl"], options=recipe.options)
    space = ezdxf.readfile(tmp_path / "plate" / "plate.dxf").modelspace()
    (circle,) = space.query("CIRCLE")
    assert circle.dxf.radius == pytest.approx(9.9, abs=1e-12)
    outer = np.array(next(iter(space.query("LWPOLYLINE[layer=='CUT_OUTER']"))).get_points("xy"))
    assert len(outer) == 4
    np.testing.assert_allclose(np.ptp(outer, axis=0), [100.2, 60.2], rtol=1e-14)
    assert part.panels[0].pattern.area == pytest.approx(6000.0 - 100.0 * np.pi - 200.0, rel=1e-12)
    assert report["panels"][0]["flat_area"] == pytest.approx(part.panels[0].pattern.area)
    notes = {file["format"]: file.get("note", "") for file in report["files"]}
    assert "kerf of 0.2 mm" in notes["dxf"]
    assert "kerf of 0.2 mm" in notes["svg"]
    assert "kerf" not in notes["stl"]
    assert json.loads((tmp_path / "plate" / "report.json").read_text()) == report
