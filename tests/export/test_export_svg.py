from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from drawings import APEX, INNER, LAMPSHADE_AREA, OUTER, job, lampshade, lens, off_ellipse

from devcad.errors import CheckFailed, FileError
from devcad.export import Options
from devcad.export import svg as exporter
from devcad.flatten.pattern import Pattern
from devcad.geometry.taylor import Array

SVG = "{http://www.w3.org/2000/svg}"


def read(path: Path) -> ElementTree.Element:
    return ElementTree.parse(path).getroot()


def groups(root: ElementTree.Element) -> dict[str, list[str]]:
    return {g.get("id", ""): [p.get("d", "") for p in g] for g in root.findall(f"{SVG}g")}


def drawn(data: str, per_segment: int = 400) -> Array:
    """Dense points on path data; arcs by the conversion of the SVG recommendation, F.6.5."""
    words = re.findall(r"[MLAZ]|-?[\d.]+(?:e-?\d+)?", data)
    here = np.array([float(words[1]), float(words[2])])
    out, k = [here[None]], 3
    while words[k] != "Z":
        if words[k] == "L":
            there = np.array([float(words[k + 1]), float(words[k + 2])])
            share = np.linspace(0.0, 1.0, per_segment)[1:, None]
            out.append(here + share * (there - here))
            k += 3
        else:
            rx, ry, turn, large, sweep = (float(w) for w in words[k + 1 : k + 6])
            there = np.array([float(words[k + 6]), float(words[k + 7])])
            assert rx == ry
            assert (turn, large) == (0.0, 0.0)
            out.append(_arc(here, there, rx, sweep == 1.0, per_segment))
            k += 8
        here = there
    return np.concatenate(out)


def _arc(a: Array, b: Array, radius: float, positive: bool, count: int) -> Array:
    half = 0.5 * (a - b)
    factor = np.sqrt(max(0.0, radius**2 - half @ half) / (half @ half))
    centre = 0.5 * (a + b) + (factor if positive else -factor) * np.array([half[1], -half[0]])
    start, end = (np.arctan2(*(p - centre)[::-1]) for p in (a, b))
    sweep = (end - start) % (2 * np.pi) if positive else -((start - end) % (2 * np.pi))
    angle = start + sweep * np.linspace(0.0, 1.0, count)[1:]
    return np.asarray(centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def in_pattern(points: Array, origin: tuple[float, float]) -> Array:
    return np.stack([origin[0] + points[:, 0], origin[1] - points[:, 1]], axis=1)


def test_one_user_unit_is_one_millimetre(tmp_path):
    panel = lampshade()
    (written,) = exporter.write(job(panel), tmp_path, Options())
    root = read(written.path)
    width, height = (float(root.get(k, "").removesuffix("mm")) for k in ("width", "height"))
    assert root.get("width", "").endswith("mm")
    assert root.get("viewBox") == f"0 0 {root.get('width')[:-2]} {root.get('height')[:-2]}"
    x0, y0, x1, y1 = panel.pattern.bbox
    np.testing.assert_allclose([width, height], [x1 - x0 + 2, y1 - y0 + 2], rtol=1e-12)


def test_the_origin_and_a_flip_bring_every_point_back(tmp_path):
    panel = lampshade()
    (written,) = exporter.write(job(panel), tmp_path, Options())
    found = groups(read(written.path))
    origin = exporter.svg_origin(panel)
    assert origin == (panel.pattern.bbox[0] - 1.0, panel.pattern.bbox[3] + 1.0)
    (outer,) = found["CUT_OUTER"]
    points = in_pattern(drawn(outer), origin)
    radii = np.hypot(*(points - [APEX, 0.0]).T)
    assert radii.min() == pytest.approx(INNER, abs=1e-9)
    assert radii.max() == pytest.approx(OUTER, abs=1e-9)
    x, y = points.T
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    assert area == pytest.approx(LAMPSHADE_AREA, rel=1e-5)  # chords of 0.004 rad; counterclockwise
    (ruling,) = found["RULING"]
    ends = np.array([[float(x) for x in w[1:].split(" ")] for w in re.split(r" (?=L)", ruling)])
    np.testing.assert_allclose(in_pattern(ends, origin), [[20, 8], [120, 7]], atol=1e-9)


def test_layers_are_groups_inner_cuts_before_outer_ones(tmp_path):
    (written,) = exporter.write(job(lampshade()), tmp_path, Options())
    root = read(written.path)
    seen = [(g.get("id"), g.get("stroke"), len(g)) for g in root.findall(f"{SVG}g")]
    assert seen == [
        ("RULING", "#F36926", 1),
        ("BEND_UP", "#00E000", 1),
        ("CUT_INNER", "#0000FF", 2),
        ("CUT_OUTER", "#000000", 1),
    ]
    for group in root.findall(f"{SVG}g"):
        assert group.get("fill") == "none"
        assert float(group.get("stroke-width", "nan")) == 0.1
    assert not [e for e in root.iter() if e.get("transform")]


def test_the_drawing_holds_the_pattern_and_its_strokes(tmp_path):
    panel = lampshade()
    (written,) = exporter.write(job(panel), tmp_path, Options())
    root = read(written.path)
    size = np.array([float(x) for x in root.get("viewBox", "").split()[2:]])
    for data in groups(root)["CUT_OUTER"]:
        points = drawn(data)
        assert np.all(points >= 0.99)
        assert np.all(points <= size - 0.99)


def test_lines_and_arcs_are_exact(tmp_path):
    shade = lampshade()
    plain = replace(
        shade, pattern=Pattern(shade.pattern.outline, (), LAMPSHADE_AREA, shade.pattern.bbox)
    )
    (written,) = exporter.write(job(plain), tmp_path, Options())
    assert written.max_deviation == 0.0


@pytest.mark.parametrize("curves", ["arcs", "polyline", "spline"])
@pytest.mark.parametrize("scale", [0.01, 1.0, 50.0])
def test_the_deviation_is_the_distance_from_the_ellipse(tmp_path, scale, curves):
    panel = lens(scale)
    (written,) = exporter.write(job(panel), tmp_path, Options(dxf_curves=curves))
    (outer,) = groups(read(written.path))["CUT_OUTER"]
    points = in_pattern(drawn(outer), exporter.svg_origin(panel))
    points = points[points[:, 1] > 1e-9]
    worst = off_ellipse(points, 80.0 * scale, 30.0 * scale).max()
    assert worst <= written.max_deviation <= 0.005
    assert worst >= 0.98 * written.max_deviation


def test_names_are_plain_text_in_the_title(tmp_path):
    part = job(lens(), name="lens")
    odd = replace(part, panels=(lampshade("a<b"), lampshade("zwölf")))
    written = exporter.write(odd, tmp_path, Options())
    titles = [read(w.path).findtext(f"{SVG}title") for w in written]
    assert titles == ["lens a<b", r"lens zw\xf6lf"]
    assert all(w.path.read_bytes().isascii() for w in written)


def test_equal_input_gives_equal_bytes(tmp_path):
    contents = []
    for name in "ab":
        (tmp_path / name).mkdir()
        (written,) = exporter.write(job(lampshade()), tmp_path / name, Options())
        contents.append(written.path.read_bytes())
    assert contents[0] == contents[1]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("Z", "", "svg-readback: not readable: a contour is open"),
        ("</svg>", "", "svg-readback: not readable"),
        ("CUT_OUTER", "CUT_OTHER", "svg-readback"),
        ("A", "L", "svg-readback"),
    ],
)
def test_a_damaged_drawing_fails_the_read_back(tmp_path, monkeypatch, old, new, message):
    document = exporter._document
    monkeypatch.setattr(
        exporter, "_document", lambda *a: [line.replace(old, new) for line in document(*a)]
    )
    with pytest.raises(CheckFailed, match=message):
        exporter.write(job(lens()), tmp_path, Options())


def test_an_unwritable_folder_is_a_file_error(tmp_path):
    with pytest.raises(FileError):
        exporter.write(job(lens()), tmp_path / "missing", Options())
