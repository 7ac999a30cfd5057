"""Sheets that meet, in STEP: read as text, and sewn by the kernel."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import devcad

GLOBE = '[surface]\nkind = "gore"\nradius = 100\ncount = 4\npanels = "all"\n'
ROUND = """
[[panel]]
name = "{name}"
[panel.surface]
kind = "{kind}"
{rest}
[panel.surface.directrix]
kind = "circle"
radius = 50
center = [0, 0, {z}]
start = {start}
sweep = {sweep}
"""
CAN = (
    ROUND.format(
        name="tube", kind="cylinder", rest="direction = [0, 0, 1]\nlength = 80\ncut = 1.0",
        z=0, start=0, sweep=360,
    )
    + ROUND.format(name="roof", kind="cone", rest="apex = [0, 0, 140]", z=80, start=77, sweep=-360)
    + ROUND.format(name="floor", kind="cone", rest="apex = [0, 0, -30]", z=0, start=0, sweep=360)
)  # fmt: skip
WAVE = '"50*cos(t) + 4*cos(3*t)"', '"40*sin(t)"', '"5*sin(2*t)"'
WAVY = """
[[panel]]
name = "{name}"
[panel.surface]
kind = "{kind}"
{rest}
[panel.surface.directrix]
kind = "expression"
x = {x}
y = {y}
z = {z}
t = [{start}, "{start} + 2*pi"]
"""
VASE = "".join(
    WAVY.format(name=name, kind=kind, rest=rest, x=WAVE[0], y=WAVE[1], z=WAVE[2], start=start)
    for name, kind, rest, start in (
        ("tube", "cylinder", "direction = [0, 0, 1]\nlength = 80", 0),
        ("foot", "cone", "apex = [0, 0, -140]\nextent = [0.3, 1]", 1),
    )
)
JOBS = {
    "globe": (GLOBE, [(f"{k + 1}.top", f"{(k + 1) % 4 + 1}.base") for k in range(4)]),
    "can": (CAN, [("tube.top", "roof.top"), ("floor.top", "tube.base")]),
    "vase": (VASE, [("tube.base", "foot.top")]),
}


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """The path of a job's STEP file and its report."""
    made = {}

    def get(name: str):
        if name not in made:
            panels, seams = JOBS[name]
            tables = "".join(f'[[seam]]\nedges = ["{a}", "{b}"]\n' for a, b in seams)
            folder = tmp_path_factory.mktemp(name)
            (folder / "job.toml").write_text(f'name = "{name}"\n{panels}{tables}')
            part = devcad.build(folder / "job.toml")
            report = devcad.export(part, folder / "out", formats=["step"])
            made[name] = folder / "out" / name / f"{name}.step", report
        return made[name]

    return get


def sewn(path: Path, tolerance: float):
    """The sewing of all that a file holds."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    sewing = BRepBuilderAPI_Sewing(tolerance)
    sewing.Add(reader.OneShape())
    sewing.Perform()
    return sewing


def entities(path: Path) -> dict[str, str]:
    """The instances of a file by number, blanks left out."""
    text = re.sub(r"\s+", "", path.read_text())
    return dict(re.findall(r"#(\d+)=([^;]*);", text))


def spelled(table: dict[str, str], number: str) -> str:
    """An instance with all that it refers to in place of the references."""
    return re.sub(r"#(\d+)", lambda found: spelled(table, found.group(1)), table[number])


def curves(path: Path, kind: str) -> Counter[str]:
    """The curves in space of that kind that edges lie on, spelled out: how often each."""
    table = entities(path)
    edges = [text for text in table.values() if text.startswith("EDGE_CURVE")]
    found = []
    for edge in edges:
        number = re.findall(r"#(\d+)", edge)[2]
        while not table[number].startswith(kind):
            inner = re.findall(r"#(\d+)", table[number])
            if not table[number].startswith(("SURFACE_CURVE", "SEAM_CURVE")):
                break
            number = inner[0]
        else:
            found.append(spelled(table, number))
    return Counter(found)


def volume(sewing) -> float:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(sewing.SewedShape(), found, 1e-9, True, True)
    return abs(float(found.Mass()))


def values(report, name: str) -> list[float]:
    return [check["value"] for check in report["checks"] if check["name"] == name]


def test_the_gores_of_a_globe_are_sewn_to_a_closed_shell(exported) -> None:
    """The volume of four tangent cylinders is 4 tan(pi / 4) 4 R^3 / 3."""
    path, report = exported("globe")
    sewing = sewn(path, 1e-9)
    assert sewing.NbFreeEdges() == 0 and sewing.NbContigousEdges() == 4
    assert volume(sewing) == pytest.approx(4.0 * 4.0 / 3.0 * 1e6, rel=1e-7)
    points = {
        spelled(entities(path), re.findall(r"#(\d+)", text)[0])
        for text in entities(path).values()
        if text.startswith("VERTEX_POINT")
    }
    assert len(points) == 2  # the poles, to the bit
    halves = curves(path, "ELLIPSE")
    assert len(halves) == 4 and set(halves.values()) == {2}
    assert max(values(report, "step-seam")) < 1e-11


def test_circles_that_start_elsewhere_become_the_same_arcs(exported) -> None:
    path, report = exported("can")
    sewing = sewn(path, 1e-9)
    assert sewing.NbFreeEdges() == 0
    cone = np.pi * 50.0**2 / 3.0
    assert volume(sewing) == pytest.approx(cone * (3.0 * 80.0 + 60.0 + 30.0), rel=1e-12)
    arcs = curves(path, "CIRCLE")
    assert all(times % 2 == 0 for times in arcs.values())
    assert max(values(report, "step-seam")) < 1e-12
    assert values(report, "step-deviation") == [0.0, 0.0, 0.0]  # still exact


def test_edges_that_are_fitted_apart_are_near_enough_to_be_sewn(exported) -> None:
    path, report = exported("vase")
    (gap,) = values(report, "step-seam")
    assert 1e-9 < gap < 4e-7  # twice what they were fitted to
    sewing = sewn(path, 1e-6)  # the kernel's own default
    assert sewing.NbFreeEdges() == 8  # the two other rims, in four pieces each
    assert path.stat().st_size < 2 * 130_000


def test_a_notch_takes_away_one_sheets_edge_alone(tmp_path: Path) -> None:
    notch = '[[panel.cutout]]\nshape = "circle"\ndiameter = 20\nat = [80, 100]\nnotch = true\n'
    panels = CAN.replace('[[panel]]\nname = "roof"', notch + '[[panel]]\nname = "roof"')
    job = tmp_path / "job.toml"
    job.write_text(f'name = "job"\n{panels}[[seam]]\nedges = ["tube.top", "roof.top"]\n')
    part = devcad.build(job)
    assert part.seams[0].joined
    report = devcad.export(part, tmp_path / "out", formats=["step"])
    assert max(values(report, "step-seam")) < 1e-11
    rims = sewn(tmp_path / "out" / "job" / "job.step", 1e-7)
    assert rims.NbContigousEdges() >= 4
