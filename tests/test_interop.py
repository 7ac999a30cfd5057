"""build123d: parts that its users can go on with, and their faces as patterns."""

from __future__ import annotations

import importlib.util
import math
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import ezdxf
import numpy as np
import pytest

import devcad
from devcad.errors import JobError
from devcad.flatten.green import perimeter
from devcad.flatten.pattern import Pattern
from devcad.interop import export_pattern, flat_to_build123d, from_build123d, to_build123d, unroll
from devcad.part import Part

pytestmark = pytest.mark.slow  # build123d takes seconds to load

SAMPLES = Path(__file__).parents[1] / "samples"


@pytest.fixture(scope="module")
def bd() -> ModuleType:
    import build123d

    return build123d


def built(name: str) -> Part:
    return devcad.build(SAMPLES / f"{name}.toml")


def sheet(tmp_path: Path, name: str) -> Part:
    """The sample without its thickness."""
    text = (SAMPLES / f"{name}.toml").read_text()
    kept = [line for line in text.splitlines() if not line.startswith(("thickness", "reference"))]
    for table in (*SAMPLES.glob("*.csv"), *SAMPLES.glob("*.dxf")):
        (tmp_path / table.name).write_bytes(table.read_bytes())
    job = tmp_path / f"{name}.toml"
    job.write_text("\n".join(kept))
    return devcad.build(job)


def sides(pattern: Pattern) -> tuple[float, float]:
    """Both lengths of the box of a pattern, whichever way it lies."""
    x0, y0, x1, y1 = pattern.bbox
    return x1 - x0, y1 - y0


@pytest.mark.parametrize(
    "name", ["lampshade", "nameplate", "strake", "dinghy-plates", "square-duct"]
)
def test_a_part_has_its_names_its_colour_and_its_volume(bd: ModuleType, name: str) -> None:
    part = built(name)
    found = to_build123d(part)
    assert isinstance(found, bd.Compound)
    assert found.label == name and found.is_valid
    assert [child.label for child in found.children] == [panel.name for panel in part.panels]
    for child, panel in zip(found.children, part.panels, strict=True):
        assert isinstance(child, bd.Solid if panel.thickness else bd.Shell)
        assert tuple(child.color)[:3] == pytest.approx(part.colour, abs=1e-6)  # single precision
        if panel.thickness:
            # the kernel's default quadrature on fitted faces
            assert child.volume == pytest.approx(panel.pattern.area * panel.thickness, rel=1e-5)


def test_a_sheet_of_one_face_is_a_face_and_of_several_a_shell(
    bd: ModuleType, tmp_path: Path
) -> None:
    (one,) = to_build123d(sheet(tmp_path, "strake")).children
    (several,) = to_build123d(built("square-to-round")).children
    assert type(one) is bd.Face and type(several) is bd.Shell
    assert one.label == "strake" and one.color is not None


def test_a_finer_tolerance_gives_a_nearer_body(tmp_path: Path) -> None:
    part = sheet(tmp_path, "wave-bowl")
    areas = [to_build123d(part, tolerance=x).children[0].faces() for x in (1e-2, 1e-5)]
    off = [abs(unroll(faces).area / part.panels[0].pattern.area - 1.0) for faces in areas]
    assert off[1] < 1e-9 < off[0]


def test_users_can_go_on_cutting_joining_and_writing(bd: ModuleType, tmp_path: Path) -> None:
    """The window in the cone is a sheet of 1 mm between two planes 40 mm and 30 mm apart."""
    (shade,) = to_build123d(built("lampshade")).children
    cut = shade - bd.Pos(80, 0, 50) * bd.Box(60, 40, 30)
    assert cut.is_valid and cut.label == "lampshade"
    # its height along the slope; the arc of 40 mm is longer than its chord
    slope = math.hypot(120.0, 50.0) / 120.0
    radius = 100.0 - 50.0 * 50.0 / 120.0  # half way up
    arc = 2.0 * radius * math.asin(20.0 / radius)
    assert shade.volume - cut.volume == pytest.approx(30.0 * slope * arc, rel=5e-3)
    joined = cut + bd.Pos(100, 0, 5) * bd.Box(10, 10, 10)
    assert joined.is_valid and len(joined.solids()) == 1
    edges = shade.edges().filter_by(bd.GeomType.CIRCLE)[:1]
    assert shade.fillet(0.2, edges).is_valid
    path = tmp_path / "cut.step"
    bd.export_step(cut, path)
    assert bd.import_step(path).volume == pytest.approx(cut.volume, rel=1e-9)


def test_an_assembly_keeps_its_names_in_step(bd: ModuleType, tmp_path: Path) -> None:
    path = tmp_path / "plates.step"
    bd.export_step(to_build123d(built("dinghy-plates")), path)
    again = bd.import_step(path)
    assert [child.label for child in again.children] == ["bottom", "side"]


@pytest.mark.parametrize("name", ["nameplate", "lampshade", "square-to-round", "dinghy-plates"])
def test_the_flat_part_is_the_pattern(bd: ModuleType, name: str) -> None:
    part = built(name)
    found = flat_to_build123d(part)
    assert [child.label for child in found.children] == [panel.name for panel in part.panels]
    for child, panel in zip(found.children, part.panels, strict=True):
        assert child.is_valid
        box = child.bounding_box().size
        # the kernel's boxes are loose on splines
        assert np.array([box.X, box.Y]) == pytest.approx(sides(panel.pattern), rel=1e-3)
        if panel.thickness:
            assert child.volume == pytest.approx(panel.pattern.area * panel.thickness, rel=1e-5)
        else:
            assert type(child) is bd.Face
            assert child.area == pytest.approx(panel.pattern.area, rel=1e-5)
            assert tuple(child.normal_at()) == pytest.approx((0.0, 0.0, 1.0))


SHEETS = [
    ("nameplate", 1e-12),
    ("bow-fairing", 1e-12),
    ("strake", 1e-8),
    ("skew-funnel", 1e-7),
    ("geodesic-ribbon", 1e-6),
    ("paper-globe", 1e-9),
    ("saddle-lamp", 1e-6),
    ("lampshade", 1e-12),
    ("square-to-round", 1e-12),
    ("hopper", 1e-12),
    ("rolling-oloid", 1e-7),
    ("mitred-pipe", 1e-12),
    ("sphericon-box", 1e-12),
]
"""Samples with how closely their STEP faces are they: 1e-4 mm where those are fitted."""


@pytest.mark.parametrize(("name", "close"), SHEETS, ids=[name for name, _ in SHEETS])
def test_there_and_back_is_the_same_pattern(tmp_path: Path, name: str, close: float) -> None:
    """One face or nine: area, perimeter and box of the panel's own pattern, which opens alike."""
    part = sheet(tmp_path, name)
    for child, panel in zip(to_build123d(part).children, part.panels, strict=True):
        pattern = unroll(child)
        known = panel.pattern
        assert pattern.area == pytest.approx(known.area, rel=close)
        assert perimeter(pattern.outline) == pytest.approx(perimeter(known.outline), rel=close)
        assert _spread(pattern) == pytest.approx(_spread(known), rel=max(10.0 * close, 1e-9))


def _spread(pattern: Pattern) -> list[float]:
    """The principal second moments of the outline's line: they tell a shape, however it lies."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    points, lengths = [], []
    for edge in pattern.outline:
        knots = np.sort(edge.u)
        ends = np.unique(np.concatenate([np.linspace(*pair, 9) for pair in pairwise(knots)]))
        half = 0.5 * np.diff(ends)[:, None]
        place, slope = edge.curve((ends[:-1, None] + half * (1.0 + nodes)).ravel())
        points.append(place)
        lengths.append((half * weights).ravel() * np.hypot(*slope.T))
    place, length = np.concatenate(points), np.concatenate(lengths)
    away = place - np.average(place, axis=0, weights=length)
    return sorted(np.linalg.eigvalsh((length[:, None] * away).T @ away))


def test_holes_cut_in_space_come_back_on_the_pattern(bd: ModuleType) -> None:
    """A pipe of radius 4 passes through two flat sides of the transition, which lean by 40 in 120:
    its holes are ellipses with half axes 4 and 4 / cos."""
    (shell,) = to_build123d(built("square-to-round")).children
    drill = bd.Pos(0, 0, 30) * bd.Rot(0, 90, 0) * bd.Cylinder(4, 400)
    cut = shell - drill
    pattern = unroll(cut)
    ellipse = math.pi * 16.0 * math.hypot(120.0, 40.0) / 120.0
    assert unroll(shell).area - pattern.area == pytest.approx(2.0 * ellipse, rel=1e-9)
    assert len(pattern.holes) == 2


def test_a_slot_over_the_seam_of_a_cone_is_cut_on_both_sides(bd: ModuleType) -> None:
    body = bd.Cone(50, 20, 80)
    # the seam of a build123d cone lies in the half plane x > 0
    cut = body - bd.Pos(40, 0, 0) * bd.Box(40, 12, 30)
    side = max(cut.faces().filter_by(bd.GeomType.CONE), key=lambda face: face.area)
    pattern = unroll(side)
    assert not pattern.holes and len(pattern.outline) > 4
    # the slot on the cone in closed form: dA = r dphi dz / cos, |sin phi| < 6 / r
    slope = math.hypot(80.0, 30.0) / 80.0
    nodes, weights = np.polynomial.legendre.leggauss(40)
    radius = 35.0 - 30.0 / 80.0 * 15.0 * nodes
    slot = 15.0 * float(weights @ (2.0 * radius * np.arcsin(6.0 / radius))) * slope
    whole = math.pi * 70.0 * math.hypot(80.0, 30.0)
    # the kernel's curves of intersection are within 1e-7 mm
    assert pattern.area == pytest.approx(whole - slot, rel=1e-8)


def test_a_patch_of_a_face_has_its_front_outside(bd: ModuleType) -> None:
    side = bd.Cylinder(10, 20).faces().filter_by(bd.GeomType.CYLINDER)[0]
    frame = from_build123d(side).frame([1.0, 2.0])
    assert np.einsum("ij,ij->i", frame.n, frame.c0 * [1.0, 1.0, 0.0]) == pytest.approx(10.0)
    assert frame.c == pytest.approx(-1.0)  # it curls away from the outside
    assert frame.v_to == pytest.approx(20.0)


@pytest.mark.parametrize("form", ["shell", "list", "faces", "wrapped"])
def test_faces_come_in_many_forms(form: str) -> None:
    part = built("square-to-round")
    (shell,) = to_build123d(part).children
    forms = {
        "shell": shell,
        "list": list(shell.faces()),
        "faces": shell.faces(),
        "wrapped": shell.wrapped,
    }
    area = part.panels[0].pattern.area
    assert devcad.unroll(forms[form]).area == pytest.approx(area, rel=1e-12)


@pytest.mark.parametrize("suffix", [".dxf", ".svg"])
def test_a_pattern_can_be_written(bd: ModuleType, tmp_path: Path, suffix: str) -> None:
    plate = bd.Box(60, 40, 3) - bd.Pos(10, 5, 0) * bd.Cylinder(6, 10)
    pattern = unroll(plate.faces().sort_by(bd.Axis.Z)[-1])
    written = export_pattern(pattern, tmp_path / f"plate{suffix}")
    assert written.path == tmp_path / f"plate{suffix}" and written.path.exists()
    assert written.max_deviation == 0.0
    if suffix == ".dxf":
        entities = list(ezdxf.readfile(written.path).modelspace())
        assert sorted(e.dxftype() for e in entities) == ["CIRCLE", "LWPOLYLINE"]
        (circle,) = (e for e in entities if e.dxftype() == "CIRCLE")
        assert circle.dxf.radius == pytest.approx(6.0, rel=1e-12)
        # the plate's own x and y, from its lower left corner
        assert tuple(circle.dxf.center)[:2] == pytest.approx((40.0, 25.0), abs=1e-9)


def test_a_pattern_is_written_as_dxf_or_svg_only(bd: ModuleType, tmp_path: Path) -> None:
    pattern = unroll(bd.Face.make_rect(3, 4))
    with pytest.raises(JobError, match=r"end its name in \.dxf or \.svg"):
        export_pattern(pattern, tmp_path / "plate.stl")


def test_the_sample_script_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = SAMPLES / "build123d_roundtrip.py"
    spec = importlib.util.spec_from_file_location("build123d_roundtrip", path)
    assert spec is not None and spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    script.main(tmp_path)
    names = ["cone.dxf", "cone.svg", "lampshade-window.step", "transition.dxf"]
    assert sorted(path.name for path in tmp_path.iterdir()) == names
    assert "2 holes on one pattern" in capsys.readouterr().out
