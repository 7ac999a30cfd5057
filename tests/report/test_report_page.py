"""The page of a job: its numbers fold the part, its policy lets nothing else in, names are text."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from jobs import JOBS, built

from devcad.part import Part
from devcad.report import make_report, to_bytes
from devcad.report.page import Row, job_page, overview_page, picture_in

HOSTILE = "</script><script>alert(1)</script>\"'><img src=x onerror=alert(2)>\u2028\u202ekcab &amp;"


class Reader(HTMLParser):
    """The elements of a page with their attributes, and the text inside scripts and styles."""

    def __init__(self, page: bytes) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.raw: list[tuple[str, dict[str, str | None], str]] = []
        self.text = ""
        self._open = False
        self.feed(page.decode("utf-8"))
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self._open = tag in ("script", "style")
        if self._open:
            self.raw.append((tag, dict(attrs), ""))

    def handle_endtag(self, tag: str) -> None:
        self._open = False

    def handle_data(self, data: str) -> None:
        if self._open:
            tag, attributes, text = self.raw[-1]
            self.raw[-1] = (tag, attributes, text + data)
        else:
            self.text += data

    def block(self, name: str) -> Any:
        """The tree of a JSON block."""
        (text,) = [text for _, attributes, text in self.raw if attributes.get("id") == name]
        return json.loads(text)


def page_of(part: Part) -> bytes:
    return job_page(part, make_report(part, checks=part.checks))


# --- the numbers ---------------------------------------------------------------------------


def arrays(told: dict[str, Any]) -> list[dict[str, Any]]:
    """The panels with their arrays read out."""
    raw = base64.b64decode(told["data"])

    def read(value: Any) -> Any:
        stored = isinstance(value, list) and value and isinstance(value[0], str)
        return np.frombuffer(raw, "<" + value[0], value[2], value[1]) if stored else value

    return [{key: read(value) for key, value in panel.items()} for panel in told["panels"]]


def turn(axis: Any, angle: float) -> np.ndarray:
    """Rodrigues' formula, written again."""
    x, y, z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def walked(panel: dict[str, Any], f: float) -> np.ndarray:
    """The points of a panel at f from the page's own numbers: (n, 3)."""
    angles, hinges = panel["angles"], panel["hinges"].reshape(-1, 2, 2)
    n, anchor = len(angles) + 1, panel["anchor"]
    size = float(np.linalg.norm(panel["turn"]))
    r = turn(panel["turn"], size * (1 - f)) if size else np.eye(3)
    pivot = np.append(panel["pivot"], 0.0)
    goal = pivot + np.append(panel["shift"], 0.0)
    place = (1 - f) * np.array(panel["place"]) + f * goal - r @ pivot
    motions = {anchor: (r, place)}
    for k in [*range(anchor + 1, n), *range(anchor - 1, -1, -1)]:
        before, hinge, sign = (k - 1, k - 1, 1) if k > anchor else (k + 1, k, -1)
        start = np.append(hinges[hinge, 0], 0.0)
        along = np.append(hinges[hinge, 1] - hinges[hinge, 0], 0.0)
        r, place = motions[before]
        step = turn(along, sign * (1 - f) * angles[hinge])
        motions[k] = (r @ step, r @ (start - step @ start) + place)
    flat = np.column_stack([panel["flat"].reshape(-1, 2), np.zeros(len(panel["body"]))])
    return np.array(
        [motions[b][0] @ x + motions[b][1] for b, x in zip(panel["body"], flat, strict=True)]
    )


def lengths(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    corner = points[triangles.reshape(-1, 3)]
    return np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)


@pytest.mark.parametrize("name", JOBS)
def test_the_numbers_of_the_page_fold_the_part_into_its_pattern(name: str) -> None:
    part = built(name)
    (panel,) = arrays(Reader(page_of(part)).block("part"))
    start = walked(panel, 0.0)
    size = float(np.abs(start).max())
    for f in (0.3, 0.7, 1.0):
        found = lengths(walked(panel, f), panel["triangles"])
        assert np.abs(found - lengths(start, panel["triangles"])).max() < 1e-6 * size  # float32
    mesh = part.panels[0].mesh
    if not part.panels[0].cuts:
        used = mesh.vertices[np.unique(mesh.triangles)]
        apart = np.linalg.norm(used[:, None] - start[None], axis=2).min(axis=1)
        assert apart.max() < 1e-6 * size
    flat = walked(panel, 1.0)
    assert np.abs(flat[:, 2]).max() < 1e-6 * size
    xmin, ymin, xmax, ymax = part.panels[0].pattern.bbox
    box = [*flat[:, :2].min(axis=0), *flat[:, :2].max(axis=0)]
    np.testing.assert_allclose(box, [xmin, ymin, xmax, ymax], atol=2.5 * part.tolerance)


def test_the_colours_know_the_curvature_between_points() -> None:
    """On a cone c / (q + v a) is 1 / (distance to the apex x tan of the half angle)."""
    part = built("drilled")
    (panel,) = arrays(Reader(page_of(part)).block("part"))
    x, y, _ = walked(panel, 0.0).T
    radius = np.hypot(x, y)
    found = np.abs(panel["bending"] / panel["height"])
    cosine = 50.0 / np.hypot(50.0, 30.0)
    np.testing.assert_allclose(found, cosine / radius, rtol=2e-3)  # of chords: the tolerance


def test_the_regression_curve_is_the_helix_itself() -> None:
    """A tangent surface's edge is the curve it is made from; at f = 0 its points lie there."""
    (panel,) = arrays(Reader(page_of(built("helix"))).block("part"))
    curve = {**panel, "flat": panel["curve"], "body": panel["curveBody"]}
    x, y, _ = walked(curve, 0.0).T
    assert len(x) >= 2 * (panel["rulings"] - 2)
    np.testing.assert_allclose(np.hypot(x, y), 20.0, atol=0.05)


def test_several_panels_lie_side_by_side() -> None:
    part = built("arc")
    twins = replace(part, panels=(part.panels[0], replace(part.panels[0], name="other")))
    left, right = arrays(Reader(page_of(twins)).block("part"))
    a, b = walked(left, 1.0), walked(right, 1.0)
    assert b[:, 0].min() - a[:, 0].max() == pytest.approx(10.0, abs=0.1)
    assert b[:, 1].min() == pytest.approx(a[:, 1].min(), abs=1e-3)


# --- curved creases ------------------------------------------------------------------------


def around(point: np.ndarray, r: np.ndarray, place: np.ndarray) -> np.ndarray:
    """The motion (4, 4) that turns by r and carries a point to a place."""
    out = np.eye(4)
    out[:3, :3] = r
    out[:3, 3] = place - r @ point
    return out


def scored(panel: dict[str, Any], f: float) -> np.ndarray:
    """The points of a sheet with creases at f from the page's own numbers: (n, 3)."""
    flanks, poses = panel["flanks"], panel["poses"]
    r = panel["rulings"] // flanks
    scores = np.zeros((flanks - 1, r, 3))
    scores[:, :, :2] = panel["scores"].reshape(flanks - 1, r, 2)
    along = np.zeros_like(scores)
    along[:, :, :2] = panel["along"].reshape(flanks - 1, r, 2)
    # the polynomial through the poses, by Lagrange's own formula
    share = np.array([np.prod([(f - q) / (p - q) for q in poses if q != p]) for p in poses])
    steps = np.tensordot(share, panel["steps"].reshape(len(poses), r - 1, 6), 1)
    mus = panel["mus"].reshape(flanks - 1, -1) @ share

    def turned(vector: np.ndarray) -> np.ndarray:
        size = float(np.linalg.norm(vector))
        return turn(vector, size) if size else np.eye(3)

    pivot = np.append(panel["pivot"], 0.0)
    place = (1 - f) * np.array(panel["place"]) + f * (pivot + np.append(panel["shift"], 0.0))
    anchor = panel["anchor"]
    motions = {anchor: around(pivot, turned(np.array(panel["turn"]) * (1 - f)), place)}
    small = [
        around(scores[0, k + 1], turned(steps[k, :3]), scores[0, k + 1] + steps[k, 3:])
        for k in range(r - 1)
    ]
    for k in range(anchor + 1, r):
        motions[k] = motions[k - 1] @ small[k - 1]
    for k in range(anchor - 1, -1, -1):
        motions[k] = motions[k + 1] @ np.linalg.inv(small[k])
    for j, parent in enumerate(panel["parents"]):
        for k in range(r):
            angle = 2 * np.arcsin(mus[j] * panel["sines"][r * j + k])
            about = around(scores[j, k], turned(along[j, k] * angle), scores[j, k])
            motions[r * (j + 1) + k] = motions[r * parent + k] @ about
    flat = panel["flat"].reshape(-1, 2)
    points = np.column_stack([flat, np.zeros(len(flat)), np.ones(len(flat))])
    return np.array(
        [(motions[b] @ x)[:3] for b, x in zip(panel["body"].tolist(), points, strict=True)]
    )


def test_the_numbers_of_the_page_fold_a_ring_along_its_crease() -> None:
    """Folded by 2 alpha the crease of radius 100 is a circle of radius 100 cos(alpha)."""
    part = built("annulus")
    (panel,) = arrays(Reader(page_of(part)).block("part"))
    flat = panel["flat"].reshape(-1, 2)
    start = scored(panel, 0.0)
    mesh = part.panels[0].mesh.vertices
    assert np.linalg.norm(mesh[:, None] - start[None], axis=2).min(axis=1).max() < 1e-4  # float32
    crease = part.panels[0].pattern.drawings[0]
    (middle, _) = crease.curve(np.linspace(crease.u[0], crease.u[-1], 7))
    on = np.linalg.norm(flat[:, None] - middle, axis=2).argmin(axis=0)
    for f in (0.3, 0.7):
        found = scored(panel, f)
        a, b, c = found[on[0]], found[on[3]], found[on[6]]
        sides = [np.linalg.norm(x - y) for x, y in ((a, b), (b, c), (c, a))]
        twice = np.linalg.norm(np.cross(b - a, c - a))
        radius = 100.0 * np.cos(np.radians(30.0 * (1 - f)))
        assert np.prod(sides) / (2.0 * twice) == pytest.approx(radius, abs=2e-4)
        change = lengths(found, panel["triangles"]) - lengths(start, panel["triangles"])
        assert np.abs(change).max() < part.tolerance / 50  # chords of arcs
    np.testing.assert_allclose(scored(panel, 1.0)[:, :2], flat, atol=1e-4)


def test_a_page_tells_how_a_sheet_folds() -> None:
    page = page_of(built("annulus"))
    reader = Reader(page)
    assert "valley" in reader.text
    assert "60.00" in reader.text
    assert f"{100 * np.pi * 120 / 180:.2f}" in reader.text  # the crease's length
    assert [a for tag, a in reader.tags if tag == "g" and a.get("data-layer") == "SCORE"]
    assert [a for tag, a in reader.tags if a.get("data-toggles") == "SCORE"]
    picture = ElementTree.fromstring(picture_in(page))
    faces = [e for e in picture.iter() if e.get("stroke", "none") == e.get("fill")]
    assert len(faces) == len(built("annulus").panels[0].mesh.triangles)  # of both flanks
    assert len(page) < 200_000


def test_a_sheet_that_cannot_fold_says_why_and_stands_still() -> None:
    reader = Reader(page_of(built("stuck")))
    assert reader.text.count("bend differently") == 2  # beside the slider, and among the notes
    (slider,) = [a for _, a in reader.tags if a.get("id") == "unroll"]
    assert "disabled" in slider
    (panel,) = arrays(reader.block("part"))
    still = panel["still"].reshape(-1, 3, 4)
    points = np.column_stack(
        [panel["flat"].reshape(-1, 2), 0 * panel["share"], 1 + 0 * panel["share"]]
    )
    found = np.einsum("nij,nj->ni", still[panel["body"]], points)
    mesh = built("stuck").panels[0].mesh.vertices
    assert np.linalg.norm(mesh[:, None] - found[None], axis=2).min(axis=1).max() < 1e-4


# --- the policy ----------------------------------------------------------------------------


def policy(reader: Reader) -> dict[str, str]:
    (text,) = [
        str(attributes["content"])
        for tag, attributes in reader.tags
        if tag == "meta" and attributes.get("http-equiv") == "Content-Security-Policy"
    ]
    return dict(part.strip().split(" ", 1) for part in text.split(";"))


def source(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def overview() -> bytes:
    rows = [Row("a", "done", link="a/index.html"), Row("b", "failed", HOSTILE)]
    return overview_page("parts", rows)


@pytest.mark.parametrize("page", [page_of(built("arc")), overview()], ids=["job", "overview"])
def test_the_policy_lets_in_what_is_there_and_nothing_else(page: bytes) -> None:
    reader = Reader(page)
    told = policy(reader)
    assert told["default-src"] == told["connect-src"] == told["base-uri"] == "'none'"
    scripts = [text for tag, a, text in reader.raw if tag == "script" and "type" not in a]
    styles = [text for tag, _, text in reader.raw if tag == "style"]
    assert told["script-src"].split() == ([source(*scripts)] if scripts else ["'none'"])
    assert told["style-src"] == source(*styles)
    for tag, attributes in reader.tags:
        assert not {"src", "style", "srcset", "action"} & set(attributes)
        assert not [name for name in attributes if name.startswith("on")]
        assert tag not in ("link", "iframe", "object", "embed", "base", "img", "form")
        assert ":" not in str(attributes.get("href", ""))


def test_no_asset_names_another_place() -> None:
    page = page_of(built("arc")).decode()
    found = set(re.findall(r"https?://[^\"'\s<]+", page))
    assert found <= {"http://www.w3.org/2000/svg"}  # a name, not an address


# --- names ---------------------------------------------------------------------------------


def named(name: str) -> Part:
    part = built("arc")
    (panel,) = part.panels
    checks = tuple(replace(check, panel=name) for check in part.checks)
    panels = (replace(panel, name=name), replace(panel, name=f"{name}2"))
    return replace(
        part, name=name, panels=panels, checks=checks, description=name, part_number=name
    )


def test_hostile_names_are_text() -> None:
    good, bad = Reader(page_of(named("plain"))), Reader(page_of(named(HOSTILE)))
    assert [tag for tag, _ in good.tags] == [tag for tag, _ in bad.tags]
    assert [sorted(a) for _, a in good.tags] == [sorted(a) for _, a in bad.tags]
    assert bad.block("report")["job"] == HOSTILE
    assert bad.block("part")["panels"][0]["name"] == HOSTILE
    assert HOSTILE in bad.text
    raw = page_of(named(HOSTILE)).decode()
    for block in re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', raw, re.S):
        assert not set("<>\u2028\u2029") & set(block)


def test_an_overview_takes_hostile_rows_as_text() -> None:
    rows = [
        Row(HOSTILE, HOSTILE, HOSTILE, link=HOSTILE),
        Row("b", "done", link="javascript:alert(1)"),
        Row("c", "done", link="//elsewhere/index.html"),
        Row("d", "done", link=" data:text/html,x"),
        Row("e", "done", link="e/index.html"),
    ]
    reader = Reader(overview_page(HOSTILE, rows))
    links = [str(a["href"]) for tag, a in reader.tags if tag == "a"]
    assert links == [HOSTILE, "e/index.html"]
    assert reader.text.count(HOSTILE) >= 4
    assert not [tag for tag, _ in reader.tags if tag in ("img", "script")]


def test_an_overview_counts_and_shows_every_job() -> None:
    picture = picture_in(page_of(built("arc")))
    rows = [Row(f"job{k}", "failed" if k == 1 else "done", picture=picture) for k in range(3)]
    reader = Reader(overview_page("night", rows))
    assert "2 done, 1 failed" in reader.text
    assert [tag for tag, _ in reader.tags].count("svg") == 3
    assert [a["data-state"] for tag, a in reader.tags if tag == "li"] == ["done", "failed", "done"]


# --- the rest ------------------------------------------------------------------------------


def test_the_page_holds_the_report() -> None:
    part = built("drilled")
    report = make_report(part, checks=part.checks)
    held = Reader(job_page(part, report)).block("report")
    assert to_bytes(held) == to_bytes(report)


def test_checks_and_files_are_told_with_their_hashes(tmp_path: Any) -> None:
    import devcad

    part = built("arc")
    report = devcad.export(part, tmp_path, formats=["svg"])
    reader = Reader((tmp_path / "arc" / "index.html").read_bytes())
    for check in report["checks"]:
        assert check["name"] in reader.text
    (file,) = report["files"]
    assert file["sha256"] in reader.text
    assert ("a", {"href": "arc.svg"}) in reader.tags


def test_equal_parts_have_equal_pages() -> None:
    part = built("drilled", 2.0)
    assert page_of(part) == page_of(part)


def test_two_hundred_rulings_take_less_than_700_kb() -> None:
    part = built("cone", 1.0, 0.002)
    assert part.panels[0].facts["ruling_count"] >= 200
    assert len(page_of(part)) < 700_000


def test_the_picture_is_an_svg_without_scripts() -> None:
    root = ElementTree.fromstring(picture_in(page_of(built("drilled"))))
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert not [e for e in root.iter() if e.tag.endswith(("script", "foreignObject"))]
    assert picture_in(overview()) == ""


def test_the_drawing_is_as_large_as_the_pattern() -> None:
    part = built("drilled")
    page = page_of(part).decode()
    (data,) = re.findall(r'<path class="line CUT_OUTER" d="([^"]*)"', page)
    numbers = np.array(re.findall(r"-?[\d.]+", data), dtype=float).reshape(-1, 2)
    xmin, ymin, xmax, ymax = part.panels[0].pattern.bbox
    np.testing.assert_allclose(numbers.min(axis=0), [xmin, -ymax], atol=0.03)
    np.testing.assert_allclose(numbers.max(axis=0), [xmax, -ymin], atol=0.03)
    assert f"{xmax - xmin:.2f} mm" in page


def test_a_hole_is_drawn_as_large_as_it_is() -> None:
    part = built("drilled")
    (hole,) = part.panels[0].pattern.holes
    assert [edge.u.size for edge in hole] == [2]  # one closed piece, whose chord is nothing
    (data,) = re.findall(r'<path class="line CUT_INNER" d="([^"]*)"', page_of(part).decode())
    x, y = np.array(re.findall(r"-?[\d.]+", data), dtype=float).reshape(-1, 2).T
    area = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    # a polygon within a fifth of a thousandth of the drawing: 0.03 mm of the radius of 7
    assert area == pytest.approx(49.0 * np.pi, rel=0.01)
