"""Patterns as poppler prints them: measured in the pixels of every page."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import clients
import numpy as np
import pytest
from numpy.typing import NDArray

import devcad
from devcad.export import Options
from devcad.export import pdf as exporter
from devcad.export.pdflayout import Plan, Tile, plan
from devcad.shop.settings import PAPERS, Pdf

pytestmark = pytest.mark.clients

Image = NDArray[np.float64]

SHEET = (520.0, 430.0)
PLATE = """
name = "plate"
thickness = 1.5
material = "dc01"
[meta]
part_number = "Zwölf"
revision = "C"
[surface]
kind = "plane"
width = {width}
height = {height}
"""
HOLE = """
[[cutout]]
shape = "rectangle"
width = 100
height = 100
at = [{x}, {y}]
"""
A4 = Pdf("A4", PAPERS["A4"], 10.0)


def _plan(pdf: Pdf) -> Plan:
    width, height = SHEET
    corners = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    return plan([corners], (0.0, 0.0, width, height), pdf)


def _middle(tile: Tile) -> tuple[float, float]:
    """Where a square of 100 mm lies wholly on the sheet and on this tile and no other one's."""
    x0, y0, x1, y1 = tile.box
    low = (max(x0 + 12.0, 4.0), max(y0 + 12.0, 4.0))
    high = (min(x1 - 12.0, SHEET[0] - 4.0), min(y1 - 12.0, SHEET[1] - 4.0))
    return 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plate with a square hole of 100 mm on every tile, on A4."""
    home = tmp_path_factory.mktemp("plate")
    holes = "".join(HOLE.format(x=x, y=y) for x, y in (_middle(tile) for tile in _plan(A4).printed))
    job = home / "plate.toml"
    job.write_text(PLATE.format(width=SHEET[0], height=SHEET[1]) + holes)
    (written,) = exporter.write(devcad.build(job), home, Options(pdf=A4))
    return written.path


def _image(pdf: Path, page: int, dpi: float) -> Image:
    """A page as poppler prints it, 0 black to 1 white, row 0 at the top."""
    target = pdf.parent / f"{pdf.stem}-{page}-{dpi:g}"
    words = ["-r", f"{dpi}", "-f", f"{page}", "-l", f"{page}", "-gray", "-singlefile"]
    clients.run([clients.program("pdftoppm"), *words, pdf, target])
    data = Path(f"{target}.pgm").read_bytes()
    head = re.match(rb"P5\s+(\d+)\s+(\d+)\s+255\s", data)
    assert head, "poppler printed nothing"
    shape = (int(head[2]), int(head[1]))
    return np.frombuffer(data, np.uint8, offset=head.end()).reshape(shape) / 255.0


def _lines(dark: NDArray[np.float64], around: float, mm: float) -> float:
    """The middle of the line nearest a place along a profile of darkness, in mm."""
    k = np.arange(len(dark)) + 0.5
    near = np.abs(k * mm - around) < 1.5
    return float((k[near] * dark[near]).sum() / dark[near].sum() * mm)


def _square(image: Image, x: float, y: float, side: float, dpi: float) -> tuple[float, float]:
    """Width and height of the square drawn with its lower left corner near (x, y) mm, from the
    middles of its lines."""
    mm = 25.4 / dpi
    top = len(image) * mm - y - side
    row, column = (
        slice(int((start + 10.0) / mm), int((start + side - 10.0) / mm)) for start in (top, x)
    )
    across, down = (1.0 - image[row]).mean(axis=0), (1.0 - image[:, column]).mean(axis=1)
    width = _lines(across, x + side, mm) - _lines(across, x, mm)
    height = _lines(down, top + side, mm) - _lines(down, top, mm)
    return width, height


def test_a_square_of_100_mm_prints_as_100_mm_on_every_tile(plate: Path) -> None:
    laid = _plan(A4)
    assert len(laid.printed) >= 6
    for number, tile in enumerate(laid.printed, start=2):
        image = _image(plate, number, 300.0)
        x, y = _middle(tile)
        x0, y0 = laid.sheet.window[0] - tile.box[0], laid.sheet.window[1] - tile.box[1]
        found = _square(image, x + x0 - 50.0, y + y0 - 50.0, 100.0, 300.0)
        assert found == pytest.approx((100.0, 100.0), abs=0.1)


def test_both_control_squares_print_true_on_every_page_and_the_map(plate: Path) -> None:
    sheet = _plan(A4).sheet
    for number in range(1, len(_plan(A4).printed) + 2):
        image = _image(plate, number, 300.0)
        for (x, y), side in zip(sheet.squares, (50.0, 50.8), strict=True):
            found = _square(image, x, y, side, 300.0)
            assert found == pytest.approx((side, side), abs=0.1)


def test_neighbouring_tiles_agree_where_they_overlap(plate: Path) -> None:
    """At 254 dots an inch a pixel is 0.1 mm: steps of whole millimetres are whole pixels, and the
    strip that two tiles share must be the same picture; only what is black counts, the marks
    that help to join are grey."""
    laid = _plan(A4)
    rows = {tile: k for k, tile in enumerate(laid.printed, start=2)}
    pairs = [
        (one, other)
        for one, other in pairwise(laid.printed)
        if one.row == other.row and other.column == one.column + 1
    ]
    assert pairs
    x0, y0, x1, y1 = laid.sheet.window
    for one, other in pairs:
        left, right = (_image(plate, rows[tile], 254.0) for tile in (one, other))
        height = left.shape[0]
        inside = slice(height - round(10 * (y1 - 1)), height - round(10 * (y0 + 1)))
        width = round(10 * laid.overlap) - 10  # half a mm less on either side: the frame's lines
        start, begin = round(10 * (x1 - laid.overlap)) + 5, round(10 * x0) + 5
        seen = [
            image[inside, at : at + width] < 0.25 for image, at in ((left, start), (right, begin))
        ]
        assert seen[0].any()
        assert np.mean(seen[0] != seen[1]) < 1e-4  # a line on the border of two pixels


def test_words_are_read_as_they_were_meant(plate: Path) -> None:
    text = clients.run([clients.program("pdftotext"), "-layout", plate, "-"])
    pages = text.split("\f")[:-1]
    tiles = _plan(A4).printed
    assert len(pages) == len(tiles) + 1
    assert "assembly map" in pages[0]
    for number, (page, tile) in enumerate(zip(pages[1:], tiles, strict=True), start=2):
        assert f"tile {tile.label}" in page
        assert f"page {number} of {len(pages)}" in page
        assert "part Zwölf" in page
        assert "revision C" in page
    for tile in tiles:
        assert tile.label in pages[0]


def test_the_file_is_sound_and_holds_no_picture(plate: Path) -> None:
    facts = clients.run([clients.program("pdfinfo"), plate])
    assert re.search(r"Pages:\s+7\b", facts)
    assert re.search(r"Page size: +595\.276 x 841\.89 pts \(A4\)", facts)
    assert "Error" not in facts
    listed = clients.run([clients.program("pdfimages"), "-list", plate])
    assert len(listed.strip().splitlines()) == 2  # the heading alone


@pytest.mark.parametrize("paper", ["A4", "one"])
@pytest.mark.parametrize("sample", ["lampshade", "hopper", "paper-globe", "auger-flight"])
def test_every_page_of_a_sample_prints(sample: str, paper: str, tmp_path: Path) -> None:
    part = devcad.build(clients.REPOSITORY / "samples" / f"{sample}.toml")
    pdf = Pdf(paper, PAPERS.get(paper), 10.0)
    for written in exporter.write(part, tmp_path, Options(pdf=pdf)):
        printed = clients.run(
            [clients.program("pdftoppm"), "-r", "20", "-gray", written.path, tmp_path / "page"]
        )
        assert printed == ""  # poppler complains on stderr
    assert list(tmp_path.glob("page-*.pgm"))


def test_a_traveller_prints_a_page_a_panel(tmp_path: Path) -> None:
    part = devcad.build(clients.REPOSITORY / "samples" / "canopy.toml")
    devcad.export(part, tmp_path, formats=["svg", "traveller"])
    path = tmp_path / "canopy" / "canopy-traveller.pdf"
    text = clients.run([clients.program("pdftotext"), "-layout", path, "-"])
    pages = text.split("\f")[:-1]
    assert len(pages) == len(part.panels)
    for panel, page in zip(part.panels, pages, strict=True):
        assert f"canopy {panel.name}" in page
        assert "TRAVELLER" in page
        x0, y0, x1, y1 = panel.pattern.bbox
        assert f"{x1 - x0:.2f} x {y1 - y0:.2f} mm" in page
