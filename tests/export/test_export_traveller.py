"""The papers that go with a part: the traveller and the cut list."""

from __future__ import annotations

import csv
import hashlib
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from drawings import job, lampshade, lens, panel, straight
from pages import pages, paths, streams

import devcad
from devcad.checks import Check
from devcad.errors import CheckFailed
from devcad.export import Options, cutlist, pdfcanvas, traveller
from devcad.flatten.pattern import Line
from devcad.part import Panel, Part

HOPPER = """
name = "hopper"
thickness = 2
material = "dc01"
[meta]
part_number = "H-17"
revision = "C"
quantity = 4
grain = 90
finish = "front"
description = "Trichter für Schüttgut"
[[panel]]
name = "shell"
[panel.surface]
kind = "frustum"
radius = 100
top_radius = 50
height = 120
[[panel]]
name = "lid"
[panel.surface]
kind = "plane"
width = 200
height = 120
"""


def words(data: bytes) -> list[list[str]]:
    """The lines of text on each page, in order."""
    texts = [text for _, text in streams(data)]
    found = [re.findall(r"\(((?:\\.|[^\\()])*)\) Tj", text) for text in texts]
    return [[_plain(line) for line in page] for page in found]


def table(path: Path) -> list[dict[str, str]]:
    """The rows of a table by the names in its first line."""
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


def _plain(line: str) -> str:
    octal = re.sub(r"\\(\d{3})", lambda m: bytes([int(m[1], 8)]).decode("cp1252"), line)
    return re.sub(r"\\(.)", r"\1", octal)


@pytest.fixture(scope="module")
def hopper(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Part]:
    home = tmp_path_factory.mktemp("hopper")
    (home / "hopper.toml").write_text(HOPPER)
    part = devcad.build(home / "hopper.toml")
    devcad.export(part, home, formats=["traveller", "cutlist", "dxf"])
    return home / "hopper", part


def test_the_papers_are_written_last_and_name_the_files_beside_them(hopper):
    folder, _ = hopper
    (shell, lid) = words((folder / "hopper-traveller.pdf").read_bytes())
    for name in ("hopper-shell.dxf", "hopper-lid.dxf", "hopper-cutlist.csv"):
        if name.endswith("dxf"):
            digest = hashlib.sha256((folder / name).read_bytes()).hexdigest()
            assert digest[:12] in shell
            assert digest[:12] in lid
    rows = table(folder / "hopper-cutlist.csv")
    assert [row["file"] for row in rows] == ["hopper-shell.dxf", "hopper-lid.dxf"]


def test_a_row_of_the_cut_list_tells_what_to_cut(hopper):
    """The lid by hand: 200 x 120 x 2 mm of steel of 7.85 g/cm3."""
    folder, _ = hopper
    shell, lid = table(folder / "hopper-cutlist.csv")
    assert {key: lid[key] for key in list(lid)[:6]} == {
        "part": "hopper",
        "panel": "lid",
        "part_number": "H-17",
        "revision": "C",
        "quantity": "4",
        "material": "dc01",
    }
    assert [float(lid[key]) for key in ("thickness", "blank_width", "blank_height")] == [
        2,
        200,
        120,
    ]
    assert float(lid["area"]) == pytest.approx(24000.0, rel=1e-12)
    assert float(lid["cut_length"]) == pytest.approx(640.0, rel=1e-12)
    assert float(lid["mass_g"]) == pytest.approx(24000.0 * 2.0 * 7.85e-3, rel=1e-9)
    assert (lid["pierces"], lid["grain_deg"], lid["finish"]) == ("1", "90", "front")
    # the shell: a sector between the radii 130 and 260 mm over the angle 2 pi 100 / 260
    sector = 0.5 * (2.0 * np.pi * 100.0 / 260.0) * (260.0**2 - 130.0**2)
    assert float(shell["area"]) == pytest.approx(sector, rel=1e-9)


def test_a_cut_list_without_a_drawing_names_none(tmp_path):
    (written,) = cutlist.write(job(lens()), tmp_path, Options())
    (row,) = table(written.path)
    assert row["file"] == ""
    assert row["grain_deg"] == ""
    assert row["mass_g"] == ""


def test_every_panel_has_a_page_of_a4(hopper):
    folder, _ = hopper
    found = pages((folder / "hopper-traveller.pdf").read_bytes())
    sizes = [(page.width, page.height) for page in found]
    np.testing.assert_allclose(sizes, [(210.0, 297.0)] * 2, atol=1e-6)


def test_the_page_says_what_the_shop_asks_for(hopper):
    folder, part = hopper
    shell, lid = words((folder / "hopper-traveller.pdf").read_bytes())
    assert "hopper lid" in lid
    (names,) = [line for line in lid if "part number" in line]
    assert names == "part number H-17   revision C   quantity 4   Trichter für Schüttgut"
    for line in ("200.00 x 120.00 mm", "24000.0 mm2", "376.8 g", "640.0 mm"):
        assert line in lid
    assert "90 deg from +x; may turn by 180" in lid  # as the nest turns it
    assert any("DC01" in line and "not verified" in line for line in lid)
    assert {"cut", "inspected"} <= set(lid)
    assert "bent" not in lid
    assert "bent" in shell
    assert any(part.job_sha256[:16] in line for line in lid)
    assert "page 2 of 2" in lid
    for check in part.checks:
        if check.panel in ("", "shell"):
            assert check.name in shell


@pytest.mark.parametrize("size", [(30.0, 40.0), (140.0, 60.0), (700.0, 2000.0), (1e5, 10.0)])
def test_the_picture_is_to_the_scale_that_it_names(tmp_path, size):
    """1:1 where it fits: then the drawn outline has the size of the pattern."""
    corners = [(0.0, 0.0), (size[0], 0.0), size, (0.0, size[1])]
    sides = zip(corners, [*corners[1:], corners[0]], strict=True)
    made = panel(tuple(straight("side", a, b) for a, b in sides), size[0] * size[1])
    (written,) = traveller.write(job(made), tmp_path, Options())
    data = written.path.read_bytes()
    (page,) = pages(data)
    place, text = re.findall(
        r"q ([\d.]+ 0 0 .*?) cm [\d.]+ w\n(.*?)\nQ\n", page.content, re.DOTALL
    )[0]
    a, _, _, d, e, f = (float(word) for word in place.split())
    (points,) = paths(re.findall(r"\d+ RG \[\] 0 d\n(.*?S)\n", text, re.DOTALL)[0])
    x, y = a * points[:, 0] + e, d * points[:, 1] + f
    (scale,) = [line for line in words(data)[0] if line.startswith("scale")]
    one_to = float(re.findall(r"1:([\d.]+)", scale)[0])
    assert np.ptp(x) == pytest.approx(size[0] / one_to, rel=1e-6)
    assert np.ptp(y) == pytest.approx(size[1] / one_to, rel=1e-6, abs=1e-7)
    assert x.min() > 12.0
    assert x.max() < 198.0
    assert y.min() > 40.0
    assert y.max() < 270.0
    assert (one_to == 1.0) == (max(size) < 150.0)


def bent(count: int) -> Panel:
    made = lampshade()
    lines = tuple(
        Line("BEND_DOWN" if k % 2 else "BEND_UP", np.array([k, 5.0]), np.array([k, 90.0]), 0.1 * k)
        for k in range(1, count + 1)
    )
    return replace(made, pattern=replace(made.pattern, lines=lines))


def test_the_bends_stand_in_a_table_and_are_numbered_in_the_picture(tmp_path):
    (written,) = traveller.write(job(bent(3)), tmp_path, Options())
    (lines,) = words(written.path.read_bytes())
    at = lines.index("2.00, 5.00")
    assert lines[at - 1 : at + 4] == ["2", "2.00, 5.00", "2.00, 90.00", "11.46", "up"]  # 0.2 rad
    assert lines.count("2") == 2  # in the table and in the picture


def test_a_long_table_says_where_the_rest_stands(tmp_path):
    (written,) = traveller.write(job(bent(200)), tmp_path, Options())
    (lines,) = words(written.path.read_bytes())
    assert "+177" in lines  # 24 rows: 23 bends and this one
    assert "in the drawing" in lines


def test_bends_of_a_press_brake_tell_their_radii_and_when_they_are_bent(tmp_path):
    made = bent(2)
    first, second = made.pattern.lines
    lines = (
        replace(first, radius=(40.0, 60.0), order=1),
        replace(second, radius=(5.0, 5.0), order=2),
    )
    made = replace(made, pattern=replace(made.pattern, lines=lines))
    (written,) = traveller.write(job(made), tmp_path, Options())
    (found,) = words(written.path.read_bytes())
    at = found.index("1.0, 5.0")
    assert {"radius", "order"} <= set(found)
    assert found[at : at + 6] == ["1.0, 5.0", "1.0, 90.0", "5.73", "down", "40.0 / 60.0", "1"]
    assert found[found.index("2.0, 5.0") + 1 :][:5] == ["2.0, 90.0", "11.46", "up", "5.0", "2"]


SEWN = {
    "stitches": [
        {
            "edge": "top",
            "mate": "right.top",
            "count": 41,
            "pitch": 3.8609,
            "hole": "slit 3",
            "inset": 3.5,
        }
    ],
    "edges": {"top": {"finish": "turned", "allowance": 12.0, "corner": "square"}},
    "notes": ["skive from the marked line to the edge before turning: top"],
}


def test_the_stitches_and_the_edges_stand_in_tables(tmp_path):
    made = lampshade()
    made = replace(made, facts={**made.facts, **SEWN})
    (written,) = traveller.write(job(made), tmp_path, Options())
    (lines,) = words(written.path.read_bytes())
    at = lines.index("stitches")
    assert lines[at + 1 :][:6] == ["edge", "mate", "holes", "pitch", "hole", "inset"]
    assert lines[at + 7 :][:6] == ["top", "right.top", "41", "3.861", "slit 3", "3.5"]
    at = lines.index("edges")
    assert lines[at + 5 :][:4] == ["top", "turned", "12", "square"]
    assert SEWN["notes"][0] in lines


def test_a_page_full_of_tables_leaves_the_boxes_to_sign_free(tmp_path):
    made = bent(100)
    facts = {
        **made.facts,
        "stitches": SEWN["stitches"] * 40,
        "edges": dict.fromkeys(("start", "end", "base", "top"), SEWN["edges"]["top"]),
        "notes": [f"note {k}" for k in range(30)],
    }
    checks = tuple(Check(f"check-{k}", "body", 1.0, 2.0, "mm", True) for k in range(100))
    for number in range(30):
        (tmp_path / f"{number}.dxf").write_bytes(b"")
    part = replace(job(replace(made, facts=facts)), checks=checks)
    (written,) = traveller.write(part, tmp_path, Options())
    (page,) = pages(written.path.read_bytes())
    text = re.findall(r"g 1 0 0 1 (\S+) (\S+) cm", page.content)
    heights = np.array(text, dtype=float)[:, 1]
    signed = 3 * 4 + 2  # cut, bent, inspected with three lines each, and the last line
    assert heights[-signed] == heights[-signed:].max()
    assert heights[-signed:].max() < heights[:-signed].min()


def test_an_allowed_check_is_told_and_no_number_is_invented(tmp_path):
    checks = (
        Check("bend-radius", "body", 0.5, 1.0, "mm", False),
        Check("regular", "body", float("inf"), 0.0, "mm", True),
    )
    (written,) = traveller.write(replace(job(lampshade()), checks=checks), tmp_path, Options())
    (lines,) = words(written.path.read_bytes())
    assert "ALLOWED" in lines
    assert lines[lines.index("regular") + 1] == "-"


def test_nothing_lies_outside_the_page_whatever_is_said(tmp_path):
    many = tuple(Check("x" * 60, "body", 1e-9, 1e300, "mm" * 20, True) for _ in range(100))
    part = replace(
        job(bent(100)),
        checks=many,
        description="lange Rede " * 90,
        part_number="7" * 1000,
        revision="漢" * 1000,
        name="n" * 64,
    )
    for number in range(30):
        (tmp_path / f"{number}{'f' * 60}.dxf").write_bytes(b"")
    (written,) = traveller.write(part, tmp_path, Options())
    (page,) = pages(written.path.read_bytes())
    moves = re.findall(r"g 1 0 0 1 (\S+) (\S+) cm", page.content)
    x, y = np.array(moves, dtype=float).T
    assert x.min() >= 12.0 - 1e-9
    assert y.min() >= 10.0
    assert max(x.max(), 198.0) == 198.0
    assert y.max() < 297.0 - 12.0


def test_a_damaged_traveller_is_not_delivered(tmp_path, monkeypatch):
    whole = pdfcanvas.written
    monkeypatch.setattr(traveller, "written", lambda *a: whole(*a)[:-40])
    with pytest.raises(CheckFailed, match="pdf-readback"):
        traveller.write(job(lens()), tmp_path, Options())
