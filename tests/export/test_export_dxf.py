from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import ezdxf
import ezdxf.bbox
import numpy as np
import pytest
from drawings import (
    APEX,
    INNER,
    LAMPSHADE_AREA,
    OUTER,
    drawn,
    job,
    lampshade,
    lens,
    off_ellipse,
)
from scipy.interpolate import BSpline

from devcad.checks import at_most
from devcad.errors import CheckFailed, FileError, JobError
from devcad.export import Options
from devcad.export import dxf as exporter
from devcad.flatten.pattern import Pattern
from devcad.geometry.taylor import Array

VERSIONS = ["R12", "R2000", "R2010"]
COLOURS = {"CUT_OUTER": 7, "CUT_INNER": 1, "BEND_UP": 3, "RULING": 9}
DEFINED = {"BEND_DOWN": 5, "ENGRAVE": 6, "MARK": 2, "SCORE": 4, **COLOURS}
HERE = Path(__file__).parent


def read(path: Path) -> Any:
    document = ezdxf.readfile(path)
    assert not document.audit().has_errors
    return document


def contour(entity: Any) -> tuple[Array, Array]:
    if entity.dxftype() == "LWPOLYLINE":
        rows = np.array(entity.get_points("xyb"))
    else:
        rows = np.array(
            [[v.dxf.location.x, v.dxf.location.y, v.dxf.bulge] for v in entity.vertices]
        )
    return rows[:, :2], rows[:, 2]


def signed_area(points: Array) -> float:
    x, y = points.T
    return float(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def on(document: Any, layer: str) -> list[Any]:
    return [entity for entity in document.modelspace() if entity.dxf.layer == layer]


@pytest.mark.parametrize("version", VERSIONS)
def test_layers_colours_and_entities_are_the_contracts(tmp_path, version):
    (written,) = exporter.write(job(lampshade()), tmp_path, Options(dxf_version=version))
    document = read(written.path)
    polyline = "POLYLINE" if version == "R12" else "LWPOLYLINE"
    kinds = [(e.dxftype(), e.dxf.layer, e.dxf.color) for e in document.modelspace()]
    assert kinds == [
        ("LINE", "RULING", 9),
        ("LINE", "BEND_UP", 3),
        ("CIRCLE", "CUT_INNER", 1),
        (polyline, "CUT_INNER", 1),
        (polyline, "CUT_OUTER", 7),
    ]
    table = {x.dxf.name: x.dxf.color for x in document.layers if x.dxf.name in DEFINED}
    assert table == DEFINED
    for layer in ("BEND_UP", "BEND_DOWN"):
        assert document.layers.get(layer).dxf.linetype == "DASHED"
    assert on(document, "BEND_UP")[0].dxf.linetype == "DASHED"
    if version != "R12":  # which has no word for the unit; the file's name says it
        assert (document.header["$INSUNITS"], document.header["$MEASUREMENT"]) == (4, 1)
    mark = "-mm" if version == "R12" else ""
    assert written.path == tmp_path / f"job{mark}.dxf"


@pytest.mark.parametrize("version", VERSIONS)
def test_the_outer_contour_is_closed_and_counterclockwise_holes_clockwise(tmp_path, version):
    (written,) = exporter.write(job(lampshade()), tmp_path, Options(dxf_version=version))
    document = read(written.path)
    (outer,) = on(document, "CUT_OUTER")
    assert outer.closed if version != "R12" else outer.is_closed
    points, bulges = contour(outer)
    assert len(points) == 4  # the first point is not repeated
    assert list(bulges == 0.0) == [True, False, True, False]
    area = signed_area(drawn(points, bulges, 20000))
    assert area == pytest.approx(LAMPSHADE_AREA, rel=1e-8)  # chords of 1e-4 rad
    oval = on(document, "CUT_INNER")[1]
    assert signed_area(drawn(*contour(oval))) == pytest.approx(-np.pi * 60.0, rel=1e-3)


@pytest.mark.parametrize("version", VERSIONS)
def test_numbers_are_the_patterns_to_rounding(tmp_path, version):
    part = job(lampshade())
    exporter.write(part, tmp_path, Options(dxf_version=version))
    document = read(next(tmp_path.iterdir()))
    points, bulges = contour(on(document, "CUT_OUTER")[0])
    np.testing.assert_allclose(np.hypot(*(points - [APEX, 0]).T), [260, 130, 130, 260], rtol=1e-15)
    assert tuple(points[0]) == (0.0, 0.0)
    np.testing.assert_allclose(bulges[[1, 3]], np.tan(2.4166097335306103 / 4) * np.array([-1, 1]))
    hole = on(document, "CUT_INNER")[0]
    found = [hole.dxf.center.x, hole.dxf.center.y, hole.dxf.radius]
    np.testing.assert_allclose(found, [70.0, 40.0, 8.0], rtol=1e-13)
    ruling = on(document, "RULING")[0]
    assert (tuple(ruling.dxf.start)[:2], tuple(ruling.dxf.end)[:2]) == ((20, 8), (120, 7))


def test_a_pattern_of_lines_and_arcs_is_exact(tmp_path):
    shade = lampshade()
    plain = replace(
        shade, pattern=Pattern(shade.pattern.outline, (), LAMPSHADE_AREA, shade.pattern.bbox)
    )
    (written,) = exporter.write(job(plain), tmp_path, Options())
    assert written.max_deviation == 0.0
    checks = [(c.name, c.value, c.passed) for c in written.checks]
    assert checks == [("dxf-deviation", 0.0, True), ("dxf-profile", 0.0, True)]


@pytest.mark.parametrize("curves", ["arcs", "polyline"])
@pytest.mark.parametrize("scale", [0.01, 1.0, 50.0])
def test_the_deviation_is_the_distance_from_the_ellipse(tmp_path, scale, curves):
    """No more than a tenth of the tolerance, and as large as reported."""
    (written,) = exporter.write(job(lens(scale)), tmp_path, Options(dxf_curves=curves))
    points, bulges = contour(on(read(written.path), "CUT_OUTER")[0])
    dense = drawn(points, bulges)
    dense = dense[dense[:, 1] > 1e-9 * scale]
    worst = off_ellipse(dense, 80.0 * scale, 30.0 * scale).max()
    assert worst <= written.max_deviation <= 0.005
    assert worst >= 0.98 * written.max_deviation
    assert not bulges.any() or curves == "arcs"


def test_splines_follow_the_ellipse_and_join_bitwise(tmp_path):
    part = job(lens(), tolerance=0.1)
    (written,) = exporter.write(part, tmp_path, Options(dxf_curves="spline"))
    line, spline = on(read(written.path), "CUT_OUTER")
    assert (line.dxftype(), spline.dxftype()) == ("LINE", "SPLINE")
    control = np.array([tuple(p)[:2] for p in spline.control_points])
    assert len(control) <= 25
    assert tuple(control[0]) == tuple(line.dxf.end)[:2]
    assert tuple(control[-1]) == tuple(line.dxf.start)[:2]
    knots = np.array(spline.knots)
    dense = BSpline(knots, control, spline.dxf.degree)(np.linspace(knots[0], knots[-1], 20001))
    worst = off_ellipse(dense, 80.0, 30.0).max()
    assert worst <= written.max_deviation <= 0.01
    assert worst >= 0.98 * written.max_deviation


def test_a_spline_drawing_of_lines_and_arcs_has_lines_arcs_and_circles(tmp_path):
    shade = lampshade()
    pattern = replace(
        shade.pattern, holes=shade.pattern.holes[:1], area=LAMPSHADE_AREA - np.pi * 64.0
    )
    part = job(replace(shade, pattern=pattern))
    (written,) = exporter.write(part, tmp_path, Options(dxf_curves="spline"))
    document = read(written.path)
    assert [e.dxftype() for e in on(document, "CUT_INNER")] == ["CIRCLE"]
    chain = on(document, "CUT_OUTER")
    assert [e.dxftype() for e in chain] == ["LINE", "ARC", "LINE", "ARC"]
    np.testing.assert_allclose([chain[1].dxf.radius, chain[3].dxf.radius], [INNER, OUTER])
    assert written.max_deviation == 0.0


def test_several_panels_give_a_file_each(tmp_path):
    part = job(lampshade("left"), lampshade("right"), name="shade")
    written = exporter.write(part, tmp_path, Options())
    assert [w.path.name for w in written] == ["shade-left.dxf", "shade-right.dxf"]


@pytest.mark.parametrize(
    ("version", "name"), [("R2000", "job-approximate.dxf"), ("R12", "job-approximate-mm.dxf")]
)
def test_a_pattern_of_a_twisted_panel_is_called_approximate(tmp_path, version, name):
    twisted = at_most("twist", "body", 1.0, 0.01, "deg")
    part = replace(job(lens()), checks=(twisted,))
    (written,) = exporter.write(part, tmp_path, Options(dxf_version=version))
    assert written.path.name == name


SCRIPT = """
import sys
sys.path.insert(0, {here!r})
from pathlib import Path
from drawings import job, lampshade
from devcad.export import Options, dxf
for version in {versions!r}:
    dxf.write(job(lampshade(), name=version), Path({folder!r}), Options(dxf_version=version))
"""


def test_equal_input_gives_equal_bytes_and_leaves_nothing_behind(tmp_path):
    """Two fresh interpreters that hash differently; no output, nothing in the home folder."""
    contents = []
    for seed in ("1", "2"):
        folder, home = tmp_path / seed, tmp_path / f"home{seed}"
        folder.mkdir()
        home.mkdir()
        environment = {k: v for k, v in os.environ.items() if not k.startswith("XDG_")}
        script = SCRIPT.format(here=str(HERE), folder=str(folder), versions=VERSIONS)
        run = subprocess.run(
            [sys.executable, "-c", script],
            env={**environment, "PYTHONHASHSEED": seed, "HOME": str(home)},
            capture_output=True,
            text=True,
            check=True,
        )
        assert (run.stdout, run.stderr) == ("", "")
        assert list(home.iterdir()) == []
        contents.append({p.name: p.read_bytes() for p in folder.iterdir()})
    assert len(contents[0]) == len(VERSIONS)
    assert contents[0] == contents[1]


def test_the_librarys_switches_are_put_back(tmp_path):
    before = ezdxf.options.write_fixed_meta_data_for_testing
    exporter.write(job(lens()), tmp_path, Options())
    assert ezdxf.options.write_fixed_meta_data_for_testing == before


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (Options(dxf_version="R14"), "dxf.version is 'R14' (use one of R12, R2000, R2010)"),
        (
            Options(dxf_profile="gerber"),
            "dxf.profile is 'gerber' (use one of generic, inventor, sendcutsend, lightburn, astm)",
        ),
        (Options(dxf_curves="nurbs"), "dxf.curves is 'nurbs' (use one of arcs, polyline, spline)"),
        (
            Options(dxf_version="R12", dxf_curves="spline"),
            'DXF R12 has no splines (use dxf.curves = "arcs" or dxf.version = "R2000")',
        ),
    ],
)
def test_options_that_no_file_can_have_are_refused(tmp_path, options, message):
    with pytest.raises(JobError) as failure:
        exporter.write(job(lens()), tmp_path, options)
    assert str(failure.value) == message
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("curves", ["arcs", "spline"])
def test_a_file_that_lost_its_contour_fails_the_read_back(tmp_path, monkeypatch, curves):
    """As if the disk had swallowed it: what is read counts, not what was meant."""
    encoded = exporter._encoded

    def without_outer(document: Any) -> bytes:
        for entity in on(document, "CUT_OUTER")[:1]:
            document.modelspace().delete_entity(entity)
        return encoded(document)

    monkeypatch.setattr(exporter, "_encoded", without_outer)
    with pytest.raises(CheckFailed, match="dxf-readback"):
        exporter.write(job(lens()), tmp_path, Options(dxf_curves=curves))


def test_a_truncated_file_fails_the_read_back(tmp_path, monkeypatch):
    encoded = exporter._encoded
    monkeypatch.setattr(exporter, "_encoded", lambda document: encoded(document)[:4000])
    with pytest.raises(CheckFailed, match="dxf-readback"):
        exporter.write(job(lens()), tmp_path, Options())


@pytest.mark.parametrize("shift", [0.02, -0.02])
def test_a_moved_vertex_fails_the_deviation(tmp_path, monkeypatch, shift):
    encoded = exporter._encoded

    def moved(document: Any) -> bytes:
        (outer,) = on(document, "CUT_OUTER")
        outer.lwpoints.values[4, 1] += shift
        return encoded(document)

    monkeypatch.setattr(exporter, "_encoded", moved)
    with pytest.raises(CheckFailed, match="dxf-deviation") as failure:
        exporter.write(job(lens()), tmp_path, Options())
    assert failure.value.value == pytest.approx(abs(shift), abs=0.007)  # plus the fit's own 0.005


def test_a_pattern_of_another_area_fails_the_read_back(tmp_path):
    flat = lens()
    wrong = replace(flat, pattern=replace(flat.pattern, area=flat.pattern.area + 2.0))
    with pytest.raises(CheckFailed, match=r"dxf-readback: an area of 3769\.\d+ mm2 was read"):
        exporter.write(job(wrong), tmp_path, Options())


def test_an_unwritable_folder_is_a_file_error(tmp_path):
    with pytest.raises(FileError):
        exporter.write(job(lens()), tmp_path / "missing", Options())
