from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drawings import (
    INNER,
    OUTER,
    ROLES,
    bow,
    job,
    lampshade,
    lens,
    off_ellipse,
    panel,
    straight,
    workpiece,
)
from hypothesis import given
from hypothesis import strategies as st
from pages import form, layers, pages, paths, squares, streams

from devcad.errors import CheckFailed, FileError, JobError, LimitError
from devcad.export import Options, pdfcanvas
from devcad.export import pdf as exporter
from devcad.export.pdflayout import Plan, plan
from devcad.flatten.pattern import Edge
from devcad.geometry.taylor import Array
from devcad.part import Panel
from devcad.shop.settings import PAPERS, Pdf

REPOSITORY = Path(__file__).parents[2]
ONE = Pdf("one", None, 10.0)


def paper(name: str, overlap: float = 10.0) -> Pdf:
    return Pdf(name, PAPERS[name], overlap)


def ring(*corners: tuple[float, float], name: str = "side") -> tuple[Edge, ...]:
    pairs = zip(corners, [*corners[1:], corners[0]], strict=True)
    return tuple(straight(name, a, b) for a, b in pairs)


def rectangle(width: float, height: float, x: float = 0.0, y: float = 0.0) -> tuple[Edge, ...]:
    return ring((x, y), (x + width, y), (x + width, y + height), (x, y + height))


def hole(width: float, height: float, x: float, y: float) -> tuple[Edge, ...]:
    return ring((x, y), (x, y + height), (x + width, y + height), (x + width, y), name="cutout")


def plate(width: float, height: float, *holes: tuple[Edge, ...]) -> Panel:
    area = width * height - sum(
        float(np.prod(np.ptp([e.curve(e.u[:1])[0][0] for e in edges], axis=0))) for edges in holes
    )
    return panel(rectangle(width, height), area, holes=holes)


def file_of(tmp_path: Path, made: Panel, pdf: Pdf = ONE, **options: str) -> bytes:
    (written,) = exporter.write(job(made), tmp_path, Options(pdf=pdf, **options))
    return written.path.read_bytes()


# --- true size -----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["A4", "Letter", "A3", "A5"])
def test_every_page_has_the_paper_and_both_control_squares(tmp_path, name):
    found = pages(file_of(tmp_path, plate(500.0, 400.0), paper(name)))
    assert len(found) > 2
    for page in found:
        assert sorted([page.width, page.height]) == pytest.approx(sorted(PAPERS[name]), abs=1e-6)
        assert squares(page) == [
            pytest.approx((50.0, 50.0), abs=1e-9),
            pytest.approx((50.8, 50.8), abs=1e-9),
        ]


def test_printers_are_asked_not_to_scale(tmp_path):
    assert b"/PrintScaling /None" in file_of(tmp_path, lens())


def test_the_pattern_stands_in_the_file_in_its_own_millimetres(tmp_path):
    groups = layers(form(file_of(tmp_path, lampshade(), paper("A4"))))
    (outer,) = paths(groups["CUT_OUTER"])
    radii = np.hypot(*(outer - [260.0, 0.0]).T)
    # a Bezier's largest distance from its arc is at most 5e-5 mm
    assert radii.min() == pytest.approx(INNER, abs=5.1e-5)
    assert radii.max() == pytest.approx(OUTER, abs=5.1e-5)
    ruling, bend = paths(groups["RULING"])[0], paths(groups["BEND_UP"])[0]
    np.testing.assert_allclose(ruling, [[20.0, 8.0], [120.0, 7.0]], atol=1e-8)
    np.testing.assert_allclose(bend, [[20.1, 9.3], [120.0, 12.0]], atol=1e-8)


def test_each_tile_shows_its_window_at_true_size(tmp_path):
    """Where a page puts the pattern is where its tile lies in the grid."""
    shade = lampshade()
    data = file_of(tmp_path, shade, paper("A4"))
    laid = plan([_outline(shade)], shade.pattern.bbox, paper("A4"))
    tiles = pages(data)[1:]
    assert len(tiles) == len(laid.printed)
    for page, tile in zip(tiles, laid.printed, strict=True):
        clip, move = re.findall(
            r"q (.*?) re W n 1 0 0 1 (.*?) cm [\d.]+ w /pattern Do", page.content
        )[0]
        x, y, width, height = (float(word) for word in clip.split())
        dx, dy = (float(word) for word in move.split())
        window = np.array([x - dx, y - dy, x - dx + width, y - dy + height])
        np.testing.assert_allclose(window, tile.box, atol=1e-8)


@pytest.mark.parametrize("curves", ["arcs", "polyline", "spline"])
@pytest.mark.parametrize("scale", [0.01, 1.0, 20.0])
def test_the_deviation_is_the_distance_from_the_ellipse(tmp_path, scale, curves):
    made = lens(scale)
    (written,) = exporter.write(job(made), tmp_path, Options(pdf=ONE, dxf_curves=curves))
    (points,) = paths(layers(form(written.path.read_bytes()))["CUT_OUTER"])
    if curves == "polyline":  # a chord is farthest from the curve between its ends
        share = np.linspace(0.0, 1.0, 50)[:, None, None]
        points = ((1.0 - share) * points[:-1] + share * points[1:]).reshape(-1, 2)
    points = points[points[:, 1] > 1e-9]
    worst = off_ellipse(points, 80.0 * scale, 30.0 * scale).max()
    assert worst <= written.max_deviation <= 0.005
    assert worst >= 0.95 * written.max_deviation  # beziers and arcs are bounded apart: 5e-5 mm


def test_straight_lines_are_exact(tmp_path):
    (written,) = exporter.write(job(plate(300.0, 200.0)), tmp_path, Options(pdf=ONE))
    assert written.max_deviation == 0.0


@given(
    radius=st.floats(0.5, 3000.0),
    share=st.floats(0.05, 1.0),
    finest=st.sampled_from([5e-5, 1e-6]),
)
def test_a_bezier_stays_by_its_arc(radius, share, finest):
    """Against the circle itself, whatever the radius and the sweep."""
    from devcad.export.pdfpaths import open_path
    from devcad.flatten.loops import arc_path

    sweep = share * 2.0 * np.pi
    arc = arc_path(np.zeros(2), radius, 0.4, sweep)
    (points,) = paths(open_path(arc, finest))
    off = np.abs(np.hypot(*points.T) - radius).max()
    assert off <= finest + 2e-8  # digits of 1e-8 mm
    angle = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
    assert angle[-1] - angle[0] == pytest.approx(sweep, abs=1e-7 / radius + 1e-9)


# --- tiles ---------------------------------------------------------------------------------


def _outline(made: Panel) -> Array:
    return np.concatenate(
        [e.curve(np.linspace(e.u[0], e.u[-1], 400)[:-1])[0] for e in made.pattern.outline]
    )


def _covered(laid: Plan, points: Array) -> Array:
    """How many printed tiles show each point."""
    boxes = np.array([tile.box for tile in laid.printed])
    x, y = points[:, 0, None], points[:, 1, None]
    inside = (boxes[:, 0] <= x) & (x <= boxes[:, 2]) & (boxes[:, 1] <= y) & (y <= boxes[:, 3])
    return np.asarray(inside.sum(axis=1))


@given(
    size=st.tuples(st.floats(20.0, 1500.0), st.floats(20.0, 1500.0)),
    turn=st.floats(0.0, 3.0),
    name=st.sampled_from(["A4", "Letter", "A3"]),
    overlap=st.sampled_from([0.0, 10.0, 25.0]),
)
def test_the_tiles_show_the_whole_sheet_and_none_is_empty(size, turn, name, overlap):
    """A turned rectangle: each of its points lies on a tile, each tile has one of its points."""
    c, s = np.cos(turn), np.sin(turn)
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * size @ np.array([[c, s], [-s, c]])
    box = (*corners.min(axis=0).tolist(), *corners.max(axis=0).tolist())
    laid = plan([corners], box, paper(name, overlap))
    share = np.linspace(0.0, 1.0, 120)
    u, v = np.meshgrid(share, share)
    inside = np.stack([u.ravel() * size[0], v.ravel() * size[1]], axis=1)
    points = inside @ np.array([[c, s], [-s, c]])
    assert _covered(laid, points).min() >= 1
    assert _covered(laid, corners).min() >= 1
    wide = np.array(
        [[t.box[0] - 20, t.box[1] - 20, t.box[2] + 20, t.box[3] + 20] for t in laid.printed]
    )
    x, y = points[:, 0, None], points[:, 1, None]  # 20 mm: the points' own distance
    near = (wide[:, 0] <= x) & (x <= wide[:, 2]) & (wide[:, 1] <= y) & (y <= wide[:, 3])
    assert near.any(axis=0).all()


def test_neighbours_share_the_overlap():
    corners = np.array([[0.0, 0.0], [700.0, 0.0], [700.0, 600.0], [0.0, 600.0]])
    laid = plan([corners], (0.0, 0.0, 700.0, 600.0), paper("A4", 12.0))
    by_place = {(tile.row, tile.column): tile.box for tile in laid.tiles}
    for (row, column), box in by_place.items():
        right, above = by_place.get((row, column + 1)), by_place.get((row - 1, column))
        if right:
            assert box[2] - right[0] == pytest.approx(12.0, abs=1e-9)
        if above:
            assert box[3] - above[1] == pytest.approx(12.0, abs=1e-9)


def test_a_tile_inside_the_sheet_is_printed_and_one_inside_a_hole_is_not():
    """A4 windows are 190 x 221 mm upright, 221 x 190 across: in 900 x 900 mm some have no line."""
    outer = np.array([[0.0, 0.0], [900.0, 0.0], [900.0, 900.0], [0.0, 900.0]])
    opening = 60.0 + outer[::-1] * (780.0 / 900.0)
    box = (0.0, 0.0, 900.0, 900.0)
    full, frame = plan([outer], box, paper("A4")), plan([outer, opening], box, paper("A4"))
    assert all(tile.printed for tile in full.tiles)
    assert len(frame.printed) < len(frame.tiles)


def test_a_part_that_fits_has_one_page_and_no_map(tmp_path):
    found = pages(file_of(tmp_path, plate(150.0, 180.0), paper("A4")))
    assert len(found) == 1
    assert "TILES" not in layers(found[0].content)


def test_paper_lies_the_way_that_takes_fewer_pages(tmp_path):
    """180 x 220 fits upright only, 220 x 180 across only."""
    upright, across = (
        pages(file_of(tmp_path, plate(*size), paper("A4")))
        for size in ((180.0, 218.0), (218.0, 180.0))
    )
    assert [(p.width < p.height) for p in upright + across] == [True, False]


def test_one_page_is_as_large_as_the_pattern(tmp_path):
    (page,) = pages(file_of(tmp_path, plate(1500.0, 800.0), ONE))
    assert page.width == pytest.approx(1500.0 + 2.0 + 20.0)
    assert page.height == pytest.approx(800.0 + 2.0 + 20.0 + 50.8 + 5.0)  # squares, a gap


def test_rows_have_letters_from_the_top_and_columns_numbers():
    corners = np.array([[0.0, 0.0], [400.0, 0.0], [400.0, 5900.0], [0.0, 5900.0]])
    laid = plan([corners], (0.0, 0.0, 400.0, 5900.0), paper("A4"))
    labels = [tile.label for tile in laid.tiles]
    assert labels[:4] in (["A1", "A2", "A3", "B1"], ["A1", "A2", "B1", "B2"])
    assert laid.tiles[0].box[3] == max(tile.box[3] for tile in laid.tiles)
    assert "Z1" in labels
    assert "AA1" in labels


# --- limits --------------------------------------------------------------------------------


@pytest.mark.parametrize("side", [4000.0, 1e6, 1e12])
def test_too_many_tiles_are_refused(side):
    corners = side * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    with pytest.raises(LimitError, match="tiles, at most 200") as caught:
        plan([corners], (0.0, 0.0, side, side), paper("A4"))
    assert "pdf.paper" in caught.value.remedy


def test_a_page_that_no_reader_takes_is_refused():
    corners = 6000.0 * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.1], [0.0, 0.1]])
    with pytest.raises(LimitError, match="at most 5080 mm"):
        plan([corners], (0.0, 0.0, 6000.0, 600.0), ONE)


@pytest.mark.parametrize("pdf", [Pdf("", (100.0, 400.0), 10.0), Pdf("", (210.0, 297.0), 200.0)])
def test_paper_without_room_is_refused(pdf):
    corners = np.array([[0.0, 0.0], [90.0, 0.0], [90.0, 90.0]])
    with pytest.raises(JobError, match="no room for tiles"):
        plan([corners], (0.0, 0.0, 90.0, 90.0), pdf)


# --- what the file says of itself ------------------------------------------------------------


def test_layers_are_optional_content_groups(tmp_path):
    data = file_of(tmp_path, lampshade(), paper("A4"))
    names = {name.decode() for name in re.findall(rb"/Name \((\w+)\) /Type /OCG", data)}
    assert names == {"RULING", "BEND_UP", "CUT_INNER", "CUT_OUTER", "TILES", "CONTROL"}
    assert data.startswith(b"%PDF-1.5")  # optional content came with 1.5
    assert b"/OCProperties" in data


def test_every_role_is_a_layer_that_the_legend_explains(tmp_path):
    data = file_of(tmp_path, workpiece(), paper("A4"))
    names = {name.decode() for name in re.findall(rb"/Name \((\w+)\) /Type /OCG", data)}
    roles = {*ROLES, "RULING", "BEND_UP", "BEND_DOWN", "STITCH", "CUT_INNER", "CUT_OUTER"}
    assert names == roles | {"TILES", "CONTROL"}
    told = "".join(text for _, text in streams(data))
    for words in ("sew", "grain", "label", "glue here", "match with the neighbour"):
        assert f"({words}) Tj" in told


def test_holes_are_drawn_before_the_outline_and_nothing_is_filled(tmp_path):
    text = form(file_of(tmp_path, lampshade(), ONE))
    assert text.index("CUT_INNER") < text.index("CUT_OUTER")
    assert not set(text.split()) & {"f", "F", "B", "b", "f*", "B*", "b*", "Do", "BI", "Tj"}


def test_equal_input_gives_equal_bytes_in_any_process(tmp_path):
    code = (
        "import sys; sys.path[:0] = sys.argv[2:]\n"
        "from pathlib import Path; from drawings import job, lampshade\n"
        "from devcad.export import Options, writer\n"
        "for name in ('pdf', 'traveller', 'cutlist'):\n"
        "    writer(name)(job(lampshade('zwölf')), Path(sys.argv[1]), Options())\n"
    )
    found = []
    for seed, zone in (("1", "UTC"), ("2", "Asia/Tokyo")):
        folder = tmp_path / seed
        folder.mkdir()
        environment = {**os.environ, "PYTHONHASHSEED": seed, "TZ": zone}
        environment.pop("SOURCE_DATE_EPOCH", None)
        words = [sys.executable, "-c", code, str(folder), str(Path(__file__).parent)]
        subprocess.run(words, check=True, cwd=REPOSITORY, env=environment)
        found.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert len(found[0]) == 3
    assert found[0] == found[1]
    assert not any(b"Date" in data for data in found[0].values())


def test_a_date_is_told_only_when_it_is_given(tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1000000000")  # 2001-09-09 01:46:40 UTC
    data = file_of(tmp_path, lens())
    assert b"D:20010909014640Z" in data
    assert any("(date 2001-09-09)" in text for _, text in _streams(data))


def _streams(data: bytes) -> list[tuple[bytes, str]]:
    from pages import streams

    return streams(data)


@pytest.mark.parametrize("seconds", ["yesterday", "-5", "1e9", "9" * 30])
def test_a_date_that_is_none_is_refused(tmp_path, monkeypatch, seconds):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", seconds)
    with pytest.raises(JobError, match="SOURCE_DATE_EPOCH"):
        file_of(tmp_path, lens())


@pytest.mark.parametrize(
    ("words", "plain"),
    [
        ("Zwölf Stück à 3 €", "Zwölf Stück à 3 €"),
        ("Łódź – Ørsted", "Lódz – Ørsted"),
        ("Zwo\u0308lf", "Zwölf"),
        ("漢字 A", "?? A"),
        ("tab\tand\nline", "tab and line"),
        ("ﬁn \ud800 x", "fin   x"),
        ("(a) \\ b", "(a) \\ b"),
    ],
)
def test_words_are_shown_in_the_letters_there_are(words, plain):
    assert pdfcanvas.plain(words) == plain


@given(st.text(max_size=60))
def test_no_words_break_a_file(words):
    page = pdfcanvas.Page(200.0, 200.0, (pdfcanvas.Text(10.0, 10.0, words),))
    data = pdfcanvas.written(words, [page])
    assert data.rstrip().endswith(b"%%EOF")


def test_long_names_are_wrapped_into_their_box(tmp_path):
    name = "a-" * 31 + "z"
    part = replace(job(lampshade()), name=name, revision="R" * 200, part_number="7" * 300)
    (written,) = exporter.write(part, tmp_path, Options(pdf=paper("A5")))
    assert written.path.is_file()
    lines = [(f"{name} {'x' * 500}", 1.0, True)] * 3
    texts, _ = pdfcanvas.fitted(lines, (0.0, 0.0, 30.0, 50.0), 3.0)
    assert all(pdfcanvas.width(t.words, t.size, bold=t.bold) <= 30.0 + 1e-9 for t in texts)
    assert min(t.y for t in texts) >= 0.0


# --- what is read back ---------------------------------------------------------------------

TORN = {
    "cut off": lambda data: data[: len(data) // 2],
    "a page less": lambda data: data.replace(b"/Count 5", b"/Count 4"),
    "another size": lambda data: data.replace(b"841.88976378", b"792.00000000"),
    "may be scaled": lambda data: data.replace(b"/PrintScaling /None", b"/PrintScaling /Nnoe"),
    "objects moved": lambda data: data.replace(b"1 0 obj", b" 1 0 obj", 1),
    "a stream damaged": lambda data: data.replace(b"stream\nx", b"stream\ny", 1),
    "empty": lambda data: b"",
}


@pytest.mark.parametrize("harm", TORN.values(), ids=TORN)
def test_a_damaged_file_is_not_delivered(tmp_path, monkeypatch, harm):
    whole = exporter.written
    changed = []

    def damaged(*words: object) -> bytes:
        data = whole(*words)  # type: ignore[arg-type]
        changed.append(harm(data) != data)
        return bytes(harm(data))

    monkeypatch.setattr(exporter, "written", damaged)
    with pytest.raises(CheckFailed, match="pdf-readback"):
        file_of(tmp_path, lampshade(), paper("A4"))
    assert changed == [True]


WRONG = {
    "a square too small": (" 50 50 re S", " 49.99 50 re S"),
    "a tile moved": ("re W n 1 0 0 1 ", "re W n 1 0 0 1 7"),
    "a tile enlarged": ("re W n 1 0 0 1 ", "re W n 1.0001 0 0 1 "),
    "a vertex moved": (" m\n", "1 m\n"),
    "a contour open": ("h S", "S"),
    "a line too many": ("h S", "h S 0 0 m 1 1 l S"),
}


@pytest.mark.parametrize(("old", "new"), WRONG.values(), ids=WRONG)
def test_a_wrong_drawing_is_not_delivered(tmp_path, monkeypatch, old, new):
    """The same file with one thing drawn wrongly, as a fault of the writer would."""
    whole = exporter.written
    changed = []

    def wrong(title, pages, layers, form):
        def spoilt(item):
            if not isinstance(item, str) or old not in item:
                return item
            changed.append(item)
            return item.replace(old, new)

        pages = [replace(page, items=tuple(map(spoilt, page.items))) for page in pages]
        form = replace(form, operators=str(spoilt(form.operators)))
        return whole(title, pages, layers, form)

    monkeypatch.setattr(exporter, "written", wrong)
    with pytest.raises(CheckFailed, match=r"pdf-(readback|deviation)"):
        file_of(tmp_path, lampshade(), paper("A4"))
    assert changed


def test_a_folder_that_is_not_there_is_a_file_error(tmp_path):
    with pytest.raises(FileError, match="cannot write"):
        file_of(tmp_path / "none", lens())


def test_several_panels_have_a_file_each(tmp_path):
    part = replace(job(lens()), panels=(replace(lens(), name="a"), replace(lens(), name="b")))
    written = exporter.write(part, tmp_path, Options())
    assert [w.path.name for w in written] == ["job-a.pdf", "job-b.pdf"]


def test_a_circle_is_drawn_all_round(tmp_path):
    disc = panel((bow("side", (0.0, 0.0), (40.0, 40.0), 0.0, 2.0 * np.pi),), np.pi * 1600.0)
    (points,) = paths(layers(form(file_of(tmp_path, disc)))["CUT_OUTER"])
    np.testing.assert_allclose(np.hypot(*points.T), 40.0, atol=5.1e-5)
    np.testing.assert_allclose([points.min(), points.max()], [-40.0, 40.0], atol=1e-3)
