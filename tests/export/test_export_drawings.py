"""Lines drawn on a sheet in the cut drawings, read by ezdxf and by an XML parser.

A frustum of radii 100 and 50 and height 120 unrolls to a sector about (260, 0); v counts from
its lower edge, 260 mm from the apex.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import ezdxf
import ezdxf.path
import numpy as np
import pytest
from drawings import job
from parts import frustum

from devcad.errors import CheckFailed
from devcad.export import Options, dxf, svg
from devcad.flatten.development import develop_chain
from devcad.flatten.outline import lay_out
from devcad.geometry.drawing import Drawing, OnSurface
from devcad.geometry.taylor import Array
from devcad.part import Part

APEX = np.array([260.0, 0.0])
SINE = 50.0 / 130.0
TURN = 2.0 * np.pi
SVG = "{http://www.w3.org/2000/svg}"


def along(t: float, dt: float, v: float, dv: float) -> OnSurface:
    """t and v grow evenly with u."""
    one = np.ones_like
    return lambda u: (t + dt * u, v + dv * u, dt * one(u), dv * one(u))


def straight_in_the_pattern(u: Array) -> tuple[Array, Array, Array, Array]:
    """A geodesic: at distance 150 from the apex where t = 2."""
    x = SINE * (u - 2.0)
    return u, 260.0 - 150.0 / np.cos(x), np.ones_like(u), -150.0 * SINE * np.tan(x) / np.cos(x)


PARALLEL = Drawing("ENGRAVE", 0, along(0.0, 1.0, 40.0, 0.0), (0.0, TURN))
BACKWARDS = Drawing("ENGRAVE", 0, along(4.0, -1.0, 60.0, 0.0), (0.0, 3.0))
MERIDIAN = Drawing("MARK", 0, along(2.0, 0.0, 0.0, 1.0), (0.0, 130.0))
GEODESIC = Drawing("SCORE", 0, straight_in_the_pattern, (1.0, 3.0))
SPIRAL = Drawing("ENGRAVE", 0, along(0.0, 1.0, 10.0, 19.0), (0.0, TURN))
ALL = (PARALLEL, BACKWARDS, MERIDIAN, GEODESIC, SPIRAL)


def part(*drawings: Drawing) -> Part:
    panel = frustum()
    pattern = lay_out(panel.chain, develop_chain(panel.chain), (np.zeros(0),), drawings)
    return job(replace(panel, pattern=pattern))


def written(folder: Path, made: Part, **options: Any) -> Any:
    (done,) = dxf.write(made, folder, Options(**options))
    document = ezdxf.readfile(done.path)
    assert not document.audit().has_errors
    return done, [e for e in document.modelspace() if not e.dxf.layer.startswith("CUT")]


def off_spiral(points: Array) -> Array:
    """The distance of pattern points from the spiral r = 250 - 19 t, t = angle / SINE: the foot
    by Newton on (P - S(t)) . S'(t) = 0."""
    x, y = (points - APEX).T
    t = np.arctan2(y, -x) / SINE
    for _ in range(30):
        r, w = 250.0 - 19.0 * t, np.pi - SINE * t
        cos, sin = np.cos(w), np.sin(w)
        d = np.stack([x - r * cos, y - r * sin])
        s1 = np.stack([-19.0 * cos + SINE * r * sin, -19.0 * sin - SINE * r * cos])
        s2 = np.stack(
            [
                -38.0 * SINE * sin - SINE**2 * r * cos,
                38.0 * SINE * cos - SINE**2 * r * sin,
            ]
        )
        t = np.clip(t + (d * s1).sum(0) / ((s1 * s1).sum(0) - (d * s2).sum(0)), 0.0, TURN)
    r, w = 250.0 - 19.0 * t, np.pi - SINE * t
    return np.asarray(np.hypot(x - r * np.cos(w), y - r * np.sin(w)))


@pytest.mark.parametrize("version", ["R12", "R2000", "R2010"])
def test_parallels_are_arcs_meridians_and_geodesics_lines(tmp_path, version):
    done, entities = written(tmp_path, part(*ALL), dxf_version=version)
    polyline = "POLYLINE" if version == "R12" else "LWPOLYLINE"
    assert [(e.dxftype(), e.dxf.layer, e.dxf.color) for e in entities] == [
        ("ARC", "ENGRAVE", 6),
        ("ARC", "ENGRAVE", 6),
        ("LINE", "MARK", 2),
        ("LINE", "SCORE", 4),
        (polyline, "ENGRAVE", 6),
    ]
    whole, back, meridian, geodesic, spiral = entities
    for arc, radius, sweep in ((whole, 220.0, TURN * SINE), (back, 200.0, 3.0 * SINE)):
        assert arc.dxf.radius == pytest.approx(radius, rel=1e-12)
        np.testing.assert_allclose(tuple(arc.dxf.center)[:2], APEX, atol=1e-10)
        turn = (arc.dxf.end_angle - arc.dxf.start_angle) % 360.0
        assert turn == pytest.approx(np.degrees(sweep), rel=1e-12)
    ends = np.array([tuple(meridian.dxf.start)[:2], tuple(meridian.dxf.end)[:2]])
    np.testing.assert_allclose(np.hypot(*(ends - APEX).T), [260.0, 130.0], rtol=1e-12)
    length = (geodesic.dxf.end - geodesic.dxf.start).magnitude
    assert length == pytest.approx(300.0 * np.tan(SINE), rel=1e-10)
    assert not (spiral.is_closed if version == "R12" else spiral.closed)
    assert 0.0 < done.max_deviation <= 0.005


@pytest.mark.parametrize("curves", ["arcs", "polyline", "spline"])
def test_the_deviation_of_a_drawing_counts(tmp_path, curves):
    done, (spiral,) = written(tmp_path, part(SPIRAL), dxf_curves=curves)
    corners = [tuple(p)[:2] for p in ezdxf.path.make_path(spiral).flattening(1e-5)]
    share = np.linspace(0.0, 1.0, 41)[:, None, None]
    chords = (1.0 - share) * np.array(corners[:-1]) + share * np.array(corners[1:])
    worst = off_spiral(chords.reshape(-1, 2)).max()
    assert worst <= done.max_deviation + 1e-5 <= 0.005 + 2e-5
    assert worst >= 0.95 * done.max_deviation - 1e-5  # a flattened chord may miss the top
    kind = "SPLINE" if curves == "spline" else "LWPOLYLINE"
    assert spiral.dxftype() == kind
    if curves == "polyline":
        assert not any(spiral.get_points("b")[0])


def test_lines_and_arcs_on_the_sheet_are_exact(tmp_path):
    for curves in ("arcs", "spline"):
        done, entities = written(
            tmp_path, part(PARALLEL, BACKWARDS, MERIDIAN, GEODESIC), dxf_curves=curves
        )
        assert done.max_deviation == 0.0
        assert {e.dxftype() for e in entities} == {"ARC", "LINE"}


def test_a_closed_drawing_that_is_a_circle_is_one(tmp_path):
    """A circle of radius 20 in the pattern, 190 mm from the apex, both ways round."""

    def path(way: float) -> OnSurface:
        def on_surface(u: Array) -> tuple[Array, Array, Array, Array]:
            z = 190.0 + 20.0 * np.exp(1j * way * u)
            dz = 20.0j * way * np.exp(1j * way * u)
            r, turn = np.abs(z), dz / z
            return np.angle(z) / SINE + 3.0, 260.0 - r, turn.imag / SINE, -r * turn.real

        return on_surface

    for way in (1.0, -1.0):
        done, (circle,) = written(tmp_path, part(Drawing("MARK", 0, path(way), (0.0, TURN))))
        assert (circle.dxftype(), circle.dxf.layer) == ("CIRCLE", "MARK")
        assert circle.dxf.radius == pytest.approx(20.0, rel=1e-12)
        assert (circle.dxf.center - ezdxf.math.Vec3(260, 0)).magnitude == pytest.approx(190.0)
        assert done.max_deviation == 0.0


@pytest.mark.parametrize("curves", ["arcs", "polyline"])
def test_the_svg_has_the_drawings_in_their_layers(tmp_path, curves):
    made = part(*ALL)
    (done,) = svg.write(made, tmp_path, Options(dxf_curves=curves))
    root = ElementTree.parse(done.path).getroot()
    groups = {g.get("id"): [p.get("d", "") for p in g] for g in root.findall(f"{SVG}g")}
    assert list(groups) == ["SCORE", "ENGRAVE", "MARK", "CUT_OUTER"]
    assert [len(paths) for paths in groups.values()] == [1, 3, 1, 1]
    assert not any(
        "Z" in d for layer, paths in groups.items() if layer != "CUT_OUTER" for d in paths
    )
    assert 0.0 < done.max_deviation <= 0.005
    x0, y0 = svg.svg_origin(made.panels[0])
    words = groups["MARK"][0].replace("M", "").replace("L", "").split()
    ends = np.array(words, dtype=float).reshape(2, 2) * [1, -1] + [x0, y0]
    np.testing.assert_allclose(np.hypot(*(ends - APEX).T), [260.0, 130.0], rtol=1e-10)
    if curves == "arcs":
        radii = {w[1:] for w in groups["ENGRAVE"][0].split() if w[0] == "A"}
        np.testing.assert_allclose([float(r) for r in radii], 220.0, rtol=1e-12)


@pytest.mark.parametrize("curves", ["arcs", "spline"])
@pytest.mark.parametrize("change", ["lost", "doubled"])
def test_a_dxf_that_lost_or_won_a_drawing_fails_the_read_back(
    tmp_path, monkeypatch, curves, change
):
    encoded = dxf._encoded

    def damaged(document: Any) -> bytes:
        space = document.modelspace()
        entity = next(e for e in space if e.dxf.layer == "ENGRAVE")
        space.delete_entity(entity) if change == "lost" else space.add_entity(entity.copy())
        return encoded(document)

    monkeypatch.setattr(dxf, "_encoded", damaged)
    with pytest.raises(CheckFailed, match="dxf-readback"):
        dxf.write(part(PARALLEL), tmp_path, Options(dxf_curves=curves))


def test_a_dxf_whose_drawing_moved_fails_the_deviation(tmp_path, monkeypatch):
    encoded = dxf._encoded

    def moved(document: Any) -> bytes:
        (line,) = [e for e in document.modelspace() if e.dxf.layer == "MARK"]
        line.dxf.end = line.dxf.end + ezdxf.math.Vec3(0, 0.02)
        return encoded(document)

    monkeypatch.setattr(dxf, "_encoded", moved)
    with pytest.raises(CheckFailed, match="dxf-deviation"):
        dxf.write(part(MERIDIAN), tmp_path, Options())


@pytest.mark.parametrize(("layer", "replaced"), [("ENGRAVE", "OTHER"), ("CUT_OUTER", "ENGRAVE")])
def test_an_svg_that_lost_or_won_a_drawing_fails_the_read_back(
    tmp_path, monkeypatch, layer, replaced
):
    document = svg._document
    monkeypatch.setattr(
        svg, "_document", lambda *a: [line.replace(layer, replaced) for line in document(*a)]
    )
    with pytest.raises(CheckFailed, match="svg-readback"):
        svg.write(part(PARALLEL), tmp_path, Options())
