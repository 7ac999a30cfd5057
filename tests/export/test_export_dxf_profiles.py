"""DXF profiles: what each receiver finds on which layer, and what the self-check says of files
that a stranger damaged. Everything is read by ezdxf alone."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from drawings import (
    ROLES,
    WORKPIECE_AREA,
    edge,
    job,
    lampshade,
    lens,
    panel,
    straight,
    workpiece,
)

from devcad.errors import JobError
from devcad.export import Options, dxf, svg
from devcad.export.dxfcheck import check_profile
from devcad.export.profile import CURVES, PROFILES, VERSIONS, profile
from devcad.export.profile import ROLES as EVERY_ROLE
from devcad.flatten.pattern import Edge, Line
from devcad.part import Panel

LAYERS = {
    "generic": {
        "CUT_OUTER": 7,
        "CUT_INNER": 1,
        "BEND_UP": 3,
        "BEND_DOWN": 5,
        "RULING": 9,
        "ENGRAVE": 6,
        "MARK": 2,
        "SCORE": 4,
    },
    "inventor": {
        "IV_OUTER_PROFILE": 7,
        "IV_INTERIOR_PROFILES": 1,
        "IV_BEND": 3,
        "IV_BEND_DOWN": 5,
        "IV_ROLL": 9,
        "IV_FEATURE_PROFILES": 6,
        "IV_UNCONSUMED_SKETCHES": 2,
    },
    "sendcutsend": {"CUT": 7, "BEND": 3, "ENGRAVE": 6},
    "lightburn": {"CUT": 7, "SCORE": 3, "ENGRAVE": 1},
    "astm": {"1": 7, "11": 1, "13": 1, "4": 2, "7": 3, "14": 5, "8": 6, "2": 7, "3": 7, "15": 7},
}
"""Layers and their colours as the shops' conventions have them."""

MADE = [
    (name, version, curves)
    for name in PROFILES
    for version in VERSIONS
    for curves in profile(name).allowed_curves
    if (version, curves) != ("R12", "spline")
]


def written(folder: Path, name: str, flat: Any = None, **options: Any) -> Any:
    part = job(workpiece() if flat is None else flat, name="bag")
    (done,) = dxf.write(part, folder, Options(dxf_profile=name, **options))
    return done


def read(path: Path) -> Any:
    document = ezdxf.readfile(path)
    assert not document.audit().has_errors
    return document


def entities(document: Any) -> list[Any]:
    """What is drawn: the model space, and what is in the blocks placed there."""
    space = list(document.modelspace())
    blocks = [document.blocks.get(e.dxf.name) for e in space if e.dxftype() == "INSERT"]
    return [*space, *(entity for block in blocks for entity in block)]


def on(document: Any, layer: str, kinds: str = "") -> list[Any]:
    found = [e for e in entities(document) if e.dxf.layer == layer]
    return [e for e in found if not kinds or e.dxftype() in kinds.split()]


@pytest.mark.parametrize("name", PROFILES)
def test_every_profile_knows_every_role_and_lets_nothing_else_stand_among_cuts(name):
    chosen = profile(name)
    assert set(EVERY_ROLE) <= set(chosen.roles)
    assert set(ROLES) <= set(EVERY_ROLE)
    cuts = {"CUT_OUTER", "CUT_INNER", "STITCH"}
    assert all(chosen.roles[role].drawn for role in cuts)
    other = {row.layer for role, row in chosen.roles.items() if role not in cuts and row.drawn}
    assert not other & set(chosen.cut_layers)
    alone = [role.layer for role in chosen.roles.values() if role.shape]
    assert all(len(chosen.layers[layer]) == 1 for layer in alone)


def test_each_profile_is_one_file_of_data_in_the_package():
    folder = Path(dxf.__file__).parent / "profiles"
    assert sorted(path.stem for path in folder.iterdir()) == sorted(PROFILES)
    for path in folder.iterdir():
        assert path.read_text().startswith("# ")
        tomllib.loads(path.read_text())


@pytest.mark.parametrize(("name", "version", "curves"), MADE)
def test_what_is_written_is_accepted_in_every_version_and_with_all_curves(
    tmp_path, name, version, curves
):
    done = written(tmp_path, name, dxf_version=version, dxf_curves=curves)
    assert done.path.name == f"bag{'-mm' if version == 'R12' else ''}.dxf"
    assert [(c.name, c.value, c.passed) for c in done.checks][1:] == [("dxf-profile", 0.0, True)]
    assert done.note.startswith(f"accepted by profile {name}")
    assert check_profile(done.path, name) == []
    assert done.max_deviation <= 0.005
    document = read(done.path)
    table = {x.dxf.name: x.dxf.color for x in document.layers}
    minimal = name == "astm" and version == "R12"
    assert minimal or LAYERS[name].items() <= table.items()
    assert {e.dxf.layer for e in entities(document)} <= set(LAYERS[name])
    if version != "R12":
        assert (document.header["$INSUNITS"], document.header["$MEASUREMENT"]) == (4, 1)


@pytest.mark.parametrize(
    ("name", "outer", "holes", "stitches"),
    [
        ("generic", "CUT_OUTER", "CUT_INNER", "CUT_INNER"),
        ("inventor", "IV_OUTER_PROFILE", "IV_INTERIOR_PROFILES", "IV_INTERIOR_PROFILES"),
        ("sendcutsend", "CUT", "CUT", "CUT"),
        ("lightburn", "CUT", "CUT", "CUT"),
    ],
)
def test_cut_layers_hold_closed_cuts_and_stitch_holes_are_circles(
    tmp_path, name, outer, holes, stitches
):
    document = read(written(tmp_path, name).path)
    cuts = [e for e in entities(document) if e.dxf.layer in {outer, holes, stitches}]
    assert [e.dxftype() for e in cuts] == ["CIRCLE"] * 5 + ["LWPOLYLINE"]
    assert cuts[-1].closed
    assert [e.dxf.radius for e in cuts[:-1]] == pytest.approx([8.0, 0.5, 0.5, 0.5, 0.5])
    assert {e.dxf.color for e in cuts if e.dxf.layer == outer == holes} <= {7}


@pytest.mark.parametrize(
    ("name", "up", "down"),
    [
        ("generic", ("BEND_UP", 3, "DASHED"), ("BEND_DOWN", 5, "DASHED")),
        ("inventor", ("IV_BEND", 3, "DASHED"), ("IV_BEND_DOWN", 5, "DASHED")),
        ("sendcutsend", ("BEND", 3, "BYLAYER"), ("BEND", 5, "BYLAYER")),
        ("lightburn", ("SCORE", 3, "BYLAYER"), ("SCORE", 4, "BYLAYER")),
    ],
)
def test_bends_are_told_apart_by_layer_or_colour(tmp_path, name, up, down):
    document = read(written(tmp_path, name).path)
    lines = {round(e.dxf.start.x): e for e in entities(document) if e.dxftype() == "LINE"}
    for x, wanted in ((60, up), (80, down)):
        found = lines[x].dxf
        assert (found.layer, found.color, found.linetype.upper()) == wanted
        assert (found.start.y, found.end.y) == (0.0, 100.0)


def test_what_a_service_must_not_cut_is_left_out_and_told(tmp_path):
    done = written(tmp_path, "sendcutsend")
    assert done.note == "accepted by profile sendcutsend, left out: RULING, SEW, GRAIN, GLUE"
    lines = [e for e in entities(read(done.path)) if e.dxftype() == "LINE"]
    assert {round(e.dxf.start.x) for e in lines} == {60, 80, 10, 5}  # bends, texts, notch mark


def test_strokes_of_one_label_or_seam_are_one_polyline(tmp_path):
    document = read(written(tmp_path, "generic").path)
    (label,) = on(document, "ENGRAVE", "LWPOLYLINE")
    assert [tuple(p[:2]) for p in label.get_points()] == [(10, 40), (10, 35), (13, 35)]
    seam, _grain = on(document, "MARK", "LWPOLYLINE")
    assert [tuple(p[:2]) for p in seam.get_points()] == [(2, 8), (2, 92), (60, 92)]


@pytest.mark.parametrize("name", ["generic", "inventor", "sendcutsend"])
def test_ticks_stand_for_bend_lines_where_they_are_asked_for(tmp_path, name):
    document = read(written(tmp_path, name, dxf_bend_ticks=10.0).path)
    lines = [e.dxf for e in entities(document) if e.dxftype() == "LINE" and e.dxf.start.x >= 60]
    bends = [e for e in lines if e.start.x in (60, 80)]
    spans = [(e.start.x, e.start.y, e.end.y) for e in bends]
    assert spans == [(60, 0, 10), (60, 90, 100), (80, 0, 10), (80, 90, 100)]


def test_a_bend_too_short_for_two_ticks_stays_whole(tmp_path):
    document = read(written(tmp_path, "generic", dxf_bend_ticks=50.0).path)
    assert [(e.dxf.start.y, e.dxf.end.y) for e in on(document, "BEND_UP")] == [(0, 100)]


def told(line: Any) -> dict[str, float]:
    tags = line.get_xdata("DEVCAD")
    return {name.value: tag.value for name, tag in zip(tags[::2], tags[1::2], strict=True)}


def test_bend_lines_carry_their_angle_as_extended_data(tmp_path):
    document = read(written(tmp_path, "inventor").path)
    assert "DEVCAD" in document.appids
    (up,), (down,) = on(document, "IV_BEND"), on(document, "IV_BEND_DOWN")
    assert told(up) == pytest.approx({"angle_deg": 30.0})
    assert told(down) == pytest.approx({"angle_deg": -45.0})
    assert not on(document, "IV_ROLL")[0].has_xdata("DEVCAD")


@pytest.mark.parametrize("version", VERSIONS)
def test_numbered_bend_lines_tell_their_radii_and_order_in_the_generic_profile_too(
    tmp_path, version
):
    flat = workpiece()
    ends = np.array([70.0, 0.0]), np.array([70.0, 100.0])
    bend = Line("BEND_UP", *ends, np.radians(5.0), radius=(50.0, 60.0), order=7)
    pattern = replace(flat.pattern, lines=(*flat.pattern.lines, bend))
    done = written(tmp_path, "generic", replace(flat, pattern=pattern), dxf_version=version)
    crease, numbered = on(read(done.path), "BEND_UP")
    assert told(numbered) == pytest.approx(
        {"angle_deg": 5.0, "radius_0": 50.0, "radius_1": 60.0, "order": 7}
    )
    assert told(crease) == pytest.approx({"angle_deg": 30.0})


# --- ASTM D6673 ------------------------------------------------------------------------------


def texts(space: Any) -> list[str]:
    return [e.dxf.text for e in space if e.dxftype() == "TEXT"]


@pytest.mark.parametrize("version", [None, "R2000", "R2010"])
def test_a_sewn_piece_is_a_block_with_numbered_layers(tmp_path, version):
    done = written(tmp_path, "astm", dxf_version=version)
    document = read(done.path)
    assert document.dxfversion == {None: "AC1009", "R2000": "AC1015", "R2010": "AC1024"}[version]
    space = list(document.modelspace())
    assert [e.dxftype() for e in space if e.dxftype() != "TEXT"] == ["INSERT"]
    assert "STYLE NAME: bag" in texts(space)
    assert "UNITS: METRIC" in texts(space)
    block = document.blocks.get("bag")
    assert texts(block) == [
        "PIECE NAME: body",
        "SIZE: ONE",
        "QUANTITY: 1",
        "MATERIAL: NONE",
        "bag body",
    ]
    (boundary,) = [e for e in block if e.dxf.layer == "1" and e.dxftype() == "POLYLINE"]
    assert boundary.is_closed
    corners = np.array([tuple(v.dxf.location)[:2] for v in boundary.vertices])
    x, y = corners.T
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    true = WORKPIECE_AREA + np.pi * 64.0 + 4.0 * np.pi * 0.25
    assert 0.0 < true - area < 0.05 * np.pi * 50.0  # inscribed, chords of at most 0.05 mm
    assert done.path.read_bytes().isascii()


def test_points_of_a_sewn_piece_stand_on_their_layers(tmp_path):
    block = read(written(tmp_path, "astm").path).blocks.get("bag")
    at = {
        layer: [tuple(e.dxf.location)[:2] for e in block if e.dxf.layer == layer]
        for layer in ("13", "4", "2", "3")
        for e in block
        if e.dxftype() == "POINT"
    }
    np.testing.assert_allclose(at["13"], [(20, 5), (30, 5), (40, 5), (50, 5)], atol=1e-9)
    assert at["4"] == [(0.0, 50.0)]  # the end of the mark on the boundary
    turns = {(round(x, 6), round(y, 6)) for x, y in at["2"]}
    outline = {(0, 0), (200, 0), (100, 100), (0, 100)}  # at (200, 100) the side is tangential
    assert turns == outline | {(2, 8), (2, 92), (60, 92)}
    curved = np.array(at["3"])
    ellipse = curved[curved[:, 1] > 99.0]
    off = ((ellipse[:, 0] - 150.0) / 50.0) ** 2 + ((ellipse[:, 1] - 100.0) / 20.0) ** 2
    np.testing.assert_allclose(off, 1.0, atol=1e-9)
    hole = curved[curved[:, 1] < 99.0]
    np.testing.assert_allclose(np.hypot(*(hole - [150.0, 50.0]).T), 8.0, atol=1e-9)
    (grain,) = [e for e in block if e.dxf.layer == "7"]
    assert (tuple(grain.dxf.start)[:2], tuple(grain.dxf.end)[:2]) == ((110, 10), (110, 60))


def test_a_file_for_old_readers_of_sewn_pieces_has_neither_tables_nor_layouts(tmp_path):
    text = written(tmp_path, "astm").path.read_text("ascii")
    assert "TABLES" not in text
    assert "$" not in text
    assert text.count("\nBLOCK\n") == 1


def test_words_of_a_sewn_piece_are_folded_to_ascii(tmp_path):
    part = replace(job(workpiece("Rückwand №1")), material="Büffel")
    (done,) = dxf.write(part, tmp_path, Options(dxf_profile="astm"))
    block = next(e for e in read(done.path).modelspace() if e.dxftype() == "INSERT").dxf.name
    assert block == "job"
    words = texts(read(done.path).blocks.get(block))
    assert words[0] == "PIECE NAME: Ruckwand No1"
    assert "MATERIAL: Buffel" in words


def test_a_slit_for_a_thread_stays_a_cutout(tmp_path):
    """A point would lose its direction."""
    flat = workpiece()
    corners = [(20.0, 15.0), (20.0, 15.5), (23.0, 15.5), (23.0, 15.0)]
    pairs = zip(corners, corners[1:] + corners[:1], strict=True)
    slit = tuple(straight("stitch", a, b) for a, b in pairs)
    pattern = replace(flat.pattern, holes=(*flat.pattern.holes, slit), area=flat.pattern.area - 1.5)
    block = read(written(tmp_path, "astm", replace(flat, pattern=pattern)).path).blocks.get("bag")
    cutouts = [e for e in block if e.dxf.layer == "11"]
    assert [len(e.vertices) for e in cutouts if len(e.vertices) == 4] == [4]


# --- options ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PROFILES)
def test_what_is_not_said_is_the_profiles_own(tmp_path, name):
    document = read(written(tmp_path, name).path)
    assert document.dxfversion == ("AC1009" if name == "astm" else "AC1015")
    kinds = {e.dxftype() for e in entities(document)}
    assert ("POLYLINE" if name == "astm" else "LWPOLYLINE") in kinds


@pytest.mark.parametrize(
    ("name", "curves"), [("sendcutsend", "spline"), ("lightburn", "spline"), ("astm", "arcs")]
)
def test_curves_that_a_receiver_does_not_read_are_refused(tmp_path, name, curves):
    with pytest.raises(JobError, match=f"the DXF profile {name} has no curves '{curves}'"):
        written(tmp_path, name, dxf_curves=curves)
    assert list(tmp_path.iterdir()) == []


def test_every_kind_of_curves_is_of_some_profile():
    assert set(CURVES) == {kind for name in PROFILES for kind in profile(name).allowed_curves}


# --- files that a stranger damaged -----------------------------------------------------------

Damage = Callable[[Any, Any], None]


def outer(space: Any) -> Any:
    return next(e for e in space if e.dxftype() == "LWPOLYLINE" and len(e) > 3 and e.closed)


def opened(document: Any, space: Any) -> None:
    outer(space).closed = False


def unmarked(document: Any, space: Any) -> None:
    contour = outer(space)
    contour.append(contour[0])
    contour.closed = False


def interrupted(document: Any, space: Any) -> None:
    contour = outer(space)
    rows = [tuple(p) for p in contour.get_points("xyb")]
    style = {"layer": contour.dxf.layer, "color": contour.dxf.color}
    space.delete_entity(contour)
    for (x, y, _), (x1, y1, _) in pairwise(rows[:4]):
        space.add_line((x, y), (x1, y1), dxfattribs=style)


def doubled(document: Any, space: Any) -> None:
    """The other way round and from another corner."""
    copy = outer(space).copy()
    rows = np.array(copy.get_points("xyb"))
    points, bulges = np.roll(rows[::-1, :2], 3, axis=0), np.roll(-rows[::-1, 2], 2)
    copy.set_points(np.column_stack([points, bulges]).tolist(), format="xyb")
    space.add_entity(copy)


def doubled_in_part(document: Any, space: Any) -> None:
    style = {"layer": outer(space).dxf.layer, "color": outer(space).dxf.color}
    corners = [(20, 0), (60, 0), (60, -20), (20, -20)]
    space.add_lwpolyline(corners, close=True, dxfattribs=style)


def worded(document: Any, space: Any) -> None:
    contour = outer(space)
    space.add_text("BAG", height=5, dxfattribs={"layer": contour.dxf.layer, "color": 7})


def minute(document: Any, space: Any) -> None:
    contour = outer(space)
    rows = [tuple(p) for p in contour.get_points("xyb")]
    contour.set_points([rows[0], (0.001, 0.0, 0.0), *rows[1:]], format="xyb")


def knotted(document: Any, space: Any) -> None:
    contour = outer(space)
    rows = [tuple(p) for p in contour.get_points("xyb")]
    rows[0], rows[1] = rows[1], rows[0]
    contour.set_points(rows, format="xyb")


def crossed(document: Any, space: Any) -> None:
    hole = next(e for e in space if e.dxftype() == "CIRCLE")
    hole.dxf.center = (200.0, 50.0)


def strayed(document: Any, space: Any) -> None:
    hole = next(e for e in space if e.dxftype() == "CIRCLE")
    hole.dxf.center = (300.0, 50.0)


def in_a_hole(document: Any, space: Any) -> None:
    hole = next(e for e in space if e.dxftype() == "CIRCLE")
    space.add_circle(
        hole.dxf.center, 2.0, dxfattribs={"layer": hole.dxf.layer, "color": hole.dxf.color}
    )


def in_inches(document: Any, space: Any) -> None:
    document.header["$INSUNITS"] = 1


def without_unit(document: Any, space: Any) -> None:
    document.header["$INSUNITS"] = 0


def dashed(document: Any, space: Any) -> None:
    if "DASHED" not in document.linetypes:
        document.linetypes.add("DASHED", [15.0, 10.0, -5.0])
    outer(space).dxf.linetype = "DASHED"


def coloured(document: Any, space: Any) -> None:
    outer(space).dxf.color = 3


def on_another_layer(document: Any, space: Any) -> None:
    space.add_line((0, 0), (10, 10), dxfattribs={"layer": "0", "color": 7})


def hatched(document: Any, space: Any) -> None:
    hatch = space.add_hatch(dxfattribs={"layer": outer(space).dxf.layer, "color": 7})
    hatch.paths.add_polyline_path([(1, 1), (9, 1), (9, 9)])


def mirrored(document: Any, space: Any) -> None:
    outer(space).dxf.extrusion = (0, 0, -1)


def emptied(document: Any, space: Any) -> None:
    for entity in list(space):
        space.delete_entity(entity)


def twice(document: Any, space: Any) -> None:
    copy = outer(space).copy()
    copy.set_points([(x + 300.0, y, b) for x, y, b in copy.get_points("xyb")], format="xyb")
    space.add_entity(copy)


DAMAGES: list[tuple[Damage, str]] = [
    (opened, r"an open contour ends at \(0, 0\)|an open contour ends at \(0, 100\)"),
    (unmarked, "is not marked as closed"),
    (interrupted, "an open contour ends at"),
    (doubled, "is drawn twice"),
    (doubled_in_part, "run on each other"),
    (worded, "text on layer"),
    (minute, r"a segment of 0\.001 mm at \(0, 0\)"),
    (knotted, "crosses itself"),
    (crossed, "cross near"),
    (strayed, "outside the outer contour|2 parts in one drawing"),
    (in_a_hole, "lies where nothing is left"),
    (in_inches, r"the unit is 1, not 4 \(mm\)"),
    (without_unit, r"the unit is 0, not 4 \(mm\)"),
    (dashed, "has linetype DASHED"),
    (coloured, "has colour 3"),
    (on_another_layer, "on layer 0, which the profile does not have"),
    (hatched, "a HATCH on layer"),
    (mirrored, "is not drawn from above"),
    (emptied, "nothing is cut"),
    (twice, "2 parts in one drawing"),
]


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> dict[str, Path]:
    """A file that each of two profiles accepts."""
    folder = tmp_path_factory.mktemp("sound")
    names = ("generic", "sendcutsend")
    paths = {}
    for name in names:
        (folder / name).mkdir()
        paths[name] = written(folder / name, name).path
        assert check_profile(paths[name], name) == []
    return paths


@pytest.mark.parametrize("name", ["generic", "sendcutsend"])
@pytest.mark.parametrize(("damage", "words"), DAMAGES, ids=lambda x: getattr(x, "__name__", ""))
def test_a_damaged_file_is_found_faulty(tmp_path, sound, name, damage, words):
    path = tmp_path / "damaged.dxf"
    document = ezdxf.readfile(sound[name])
    damage(document, document.modelspace())
    document.saveas(path)
    faults = check_profile(path, name)
    assert faults
    assert re.search(words, "; ".join(faults)), faults


@pytest.mark.parametrize("cut", [3000, 9000])
def test_a_torn_file_is_a_fault_and_no_exception(tmp_path, cut):
    path = written(tmp_path, "generic").path
    path.write_bytes(path.read_bytes()[:cut])
    (fault,) = check_profile(path)
    assert fault.startswith("not readable: ")


def test_what_is_no_drawing_is_a_fault(tmp_path):
    path = tmp_path / "x.dxf"
    path.write_bytes(b"\x00\x01 not a drawing")
    (fault,) = check_profile(path)
    assert fault.startswith("not readable: ")
    (fault,) = check_profile(tmp_path / "missing.dxf")
    assert fault.startswith("not readable: ")


def test_r12_without_the_unit_in_its_name_is_a_fault(tmp_path):
    path = written(tmp_path, "generic", dxf_version="R12").path
    other = path.rename(tmp_path / "hammer.dxf")
    assert check_profile(other) == ["R12 has no unit, and the file's name does not tell mm"]


def test_another_profiles_file_is_not_accepted(tmp_path):
    path = written(tmp_path, "inventor").path
    faults = check_profile(path, "sendcutsend")
    assert any("IV_OUTER_PROFILE, which the profile does not have" in fault for fault in faults)
    with pytest.raises(JobError):
        check_profile(path, "gerber")


def test_a_foreign_drawing_of_lines_and_arcs_end_to_end_is_accepted(tmp_path):
    """A stadium drawn by somebody else, its pieces in no order and in either direction."""
    document = ezdxf.new("R2000", units=4)
    document.header["$MEASUREMENT"] = 1
    document.layers.add("CUT", color=7)
    space, style = document.modelspace(), {"layer": "CUT"}
    space.add_line((100, 40), (0, 40), dxfattribs=style)
    space.add_arc((100, 20), 20, -90, 90, dxfattribs=style)
    space.add_line((100, 0), (0, 0), dxfattribs=style)
    space.add_arc((0, 20), 20, 90, 270, dxfattribs=style)
    space.add_circle((50, 20), 5, dxfattribs=style)
    document.saveas(tmp_path / "stadium.dxf")
    assert check_profile(tmp_path / "stadium.dxf", "sendcutsend") == []
    space.add_line((100, 40), (120, 40), dxfattribs=style)
    document.saveas(tmp_path / "stadium.dxf")
    assert any("open contour" in f for f in check_profile(tmp_path / "stadium.dxf", "sendcutsend"))


def test_a_sheet_of_several_parts_is_accepted_where_that_is_asked(tmp_path):
    path = written(tmp_path, "generic").path
    document = ezdxf.readfile(path)
    twice(document, document.modelspace())
    document.saveas(path)
    assert check_profile(path, several=True) == []


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        ("PIECE NAME: body", "block bag: the words PIECE NAME: are there 0 times"),
        ("UNITS: METRIC", "the words UNITS: METRIC are missing"),
        ("STYLE NAME: bag", "the words STYLE NAME: are missing"),
    ],
)
def test_a_sewn_piece_needs_its_words(tmp_path, words, fault):
    path = written(tmp_path, "astm").path
    path.write_text(path.read_text().replace(words, "OTHER"))
    assert check_profile(path, "astm") == [fault]


def test_letters_beyond_ascii_are_a_fault_of_a_sewn_piece(tmp_path):
    path = written(tmp_path, "astm").path
    path.write_text(path.read_text().replace("SIZE: ONE", "SIZE: GRÖSSE"))
    assert check_profile(path, "astm") == ["there is other text than 7-bit ASCII"]


def test_a_scaled_block_is_a_fault(tmp_path):
    path = written(tmp_path, "astm", dxf_version="R2000").path
    document = ezdxf.readfile(path)
    next(e for e in document.modelspace() if e.dxftype() == "INSERT").dxf.xscale = 2.0
    document.saveas(path)
    assert check_profile(path, "astm") == ["block bag is scaled or turned"]


def test_a_fault_fails_the_check_with_its_words(tmp_path):
    """A pattern whose hole touches the border is written as it is, and not accepted."""
    flat = workpiece(curved=False)
    corners = [(190.0, 40.0), (190.0, 60.0), (200.0, 60.0), (200.0, 40.0)]
    pairs = zip(corners, corners[1:] + corners[:1], strict=True)
    hole = tuple(straight("cutout", a, b) for a, b in pairs)
    pattern = replace(flat.pattern, holes=(hole,), area=20000.0 - 200.0)
    done = written(tmp_path, "generic", replace(flat, pattern=pattern))
    check = done.checks[-1]
    assert (check.name, check.value, check.limit, check.passed) == ("dxf-profile", 1.0, 0.0, False)
    assert check.says == done.note
    assert done.note.startswith("not accepted by profile generic: two lines on layer CUT_")


@pytest.mark.parametrize("scale", [0.01, 50.0])
@pytest.mark.parametrize("name", PROFILES)
def test_tiny_and_huge_parts_are_accepted(tmp_path, name, scale):
    assert written(tmp_path, name, lens(scale)).checks[-1].passed
    assert written(tmp_path, name, lampshade()).checks[-1].passed


def leaf() -> Panel:
    """Between y = -x^2 (100 - x) / 6000 and its mirror image: a tip without an angle at x = 0."""

    def side(name: str, sign: float, *u: float) -> Edge:
        return edge(
            name,
            lambda x: (
                x,
                sign * x**2 * (100.0 - x) / 6000.0,
                np.ones_like(x),
                sign * (200.0 * x - 3.0 * x**2) / 6000.0,
            ),
            *u,
        )

    area = 2.0 * 100.0**4 / 12.0 / 6000.0
    return panel((side("base", -1.0, 0.0, 100.0), side("top", 1.0, 100.0, 0.0)), area)


@pytest.mark.parametrize("curves", CURVES)
@pytest.mark.parametrize("tolerance", [0.05, 5.0])
def test_the_sides_of_a_tip_without_an_angle_do_not_cross(tmp_path, curves, tolerance):
    """Where fitted within half a millimetre they would: they are fitted more closely then."""
    (done,) = dxf.write(job(leaf(), tolerance=tolerance), tmp_path, Options(dxf_curves=curves))
    assert done.note == "accepted by profile generic"
    assert done.max_deviation <= 0.1 * tolerance


# --- the same roles in SVG -------------------------------------------------------------------


def test_svg_has_a_group_with_its_style_for_every_role(tmp_path):
    from xml.etree import ElementTree

    (done,) = svg.write(job(workpiece()), tmp_path, Options())
    root = ElementTree.parse(done.path).getroot()
    groups = {g.get("id"): g for g in root.iter("{http://www.w3.org/2000/svg}g")}
    drawn = [*ROLES, "RULING", "BEND_UP", "BEND_DOWN", "STITCH", "CUT_INNER", "CUT_OUTER"]
    assert set(groups) == set(drawn)
    assert list(groups)[-3:] == ["STITCH", "CUT_INNER", "CUT_OUTER"]
    assert len(groups["STITCH"]) == 4
    assert len(groups["CUT_INNER"]) == 1
    assert {name: len(groups[name]) for name in ("SEW", "LABEL", "GRAIN")} == {
        "SEW": 1,
        "LABEL": 1,
        "GRAIN": 1,
    }
    strokes = {name: group.get("stroke") for name, group in groups.items()}
    cut = {strokes["CUT_OUTER"], strokes["CUT_INNER"]}
    assert all(strokes[name] not in cut for name in (*ROLES, "RULING", "BEND_UP"))
    assert math.isclose(done.max_deviation, 0.0, abs_tol=0.005)
