"""devcad analyze: what it prints, the figure it writes, and how it refuses."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from test_job import as_pattern, expectation

from devcad.cli import run
from devcad.geometry.analysis.analysis import analyze
from devcad.job.analysis import load_curves
from devcad.report.analysis import figure_subtitle
from devcad.report.figure import figure

REPOSITORY = Path(__file__).parents[1]
BROKEN = sorted((Path(__file__).parent / "broken_curves").glob("*.toml"))
SAMPLES = sorted((REPOSITORY / "samples").glob("*.toml"))

HELIX = """\
[curve]
kind = "expression"
x = "3*cos(t)"
y = "3*sin(t)"
z = "4*t"
t = [0, 10]
"""
SLANT = """\
name = "slant"
[curve]
kind = "natural"
curvature = "cos(t)"
torsion = "sin(t)"
t = [0, 1.5]
"""
CONTRACT = ["length", "closed", "causal", "samples", "helix", "developables", "degrees"]

Captured = pytest.CaptureFixture[str]


def written(folder: Path, text: str, name: str = "helix.toml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def told(path: Path, capsys: Captured, out: Path) -> dict[str, Any]:
    """The JSON of an analysis that succeeds."""
    assert run(["analyze", str(path), "--json", "-o", str(out)]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    found: dict[str, Any] = json.loads(said.out)
    return found


# --- what it says --------------------------------------------------------------------------


def test_json_is_one_object_with_the_keys_of_the_contract(tmp_path: Path, capsys: Captured) -> None:
    found = told(written(tmp_path, HELIX), capsys, tmp_path / "out")
    assert list(found)[: len(CONTRACT)] == CONTRACT
    assert found["length"] == pytest.approx(50.0, rel=1e-14)
    assert found["closed"] is False and found["causal"] == "timelike" and found["degrees"] is None
    samples = found["samples"]
    assert list(samples) == ["t", "curvature", "torsion", "sigma", "psi", "chi"]
    assert len({len(column) for column in samples.values()}) == 1
    assert (samples["t"][0], samples["t"][-1]) == (0.0, 10.0)
    # radius 3 and 4 per radian: k = 3/25, tau = 4/25
    np.testing.assert_allclose(samples["curvature"], 0.12, rtol=1e-14)
    np.testing.assert_allclose(samples["torsion"], 0.16, rtol=1e-14)
    assert found["helix"] == dict.fromkeys(["cylindrical", "slant", "clad", "g_clad"], True)
    assert [each["kind"] for each in found["developables"]] == [
        "tangent",
        "rectifying",
        "darboux",
        "principal-normal-darboux",
        "focal",
    ]
    for each in found["developables"]:
        assert each["type"] in ("plane", "cylinder", "cone", "tangent")
        for point in each["singularities"]:
            assert list(point) == ["t", "v", "point", "type"]


def test_a_slant_helix_is_one_in_the_json_too(tmp_path: Path, capsys: Captured) -> None:
    """O13."""
    found = told(written(tmp_path, SLANT), capsys, tmp_path)
    assert found["helix"] == {"cylindrical": False, "slant": True, "clad": True, "g_clad": True}
    np.testing.assert_allclose(found["samples"]["sigma"], 1.0, rtol=1e-12)
    np.testing.assert_allclose(found["samples"]["psi"], 0.0, atol=1e-12)
    numbers = found["helix_numbers"]
    assert [numbers[name]["constant"] for name in ("f", "sigma", "psi", "chi")] == [
        False,
        True,
        True,
        True,
    ]


def test_what_does_not_exist_is_null(tmp_path: Path, capsys: Captured) -> None:
    line = '[curve]\nkind = "line"\nfrom = [0, 0, 0]\nto = [1, 2, 2]\n'
    found = told(written(tmp_path, line), capsys, tmp_path)
    assert found["length"] == pytest.approx(3.0, rel=1e-15)
    assert set(found["samples"]["curvature"]) == {0.0}
    for name in ("torsion", "sigma", "psi", "chi"):
        assert set(found["samples"][name]) == {None}
    assert {each["type"] for each in found["developables"]} == {None}
    assert {each["why"] for each in found["developables"]} == {"the curve is straight"}
    assert found["helix_numbers"]["f"]["mean"] is None
    assert not any(found["helix"].values())
    degrees = {key: found["degrees"][key] for key in ("tangent_developable", "edge_surface")}
    assert found["degrees"]["curve"] == 1
    assert set(degrees.values()) == {None}


def test_lengths_are_mm_whatever_the_unit(tmp_path: Path, capsys: Captured) -> None:
    mm = told(written(tmp_path, HELIX), capsys, tmp_path)
    inches = told(written(tmp_path, f'units = "in"\n{HELIX}'), capsys, tmp_path)
    assert inches["length"] == pytest.approx(25.4 * mm["length"], rel=1e-14)
    assert inches["samples"]["torsion"][0] == pytest.approx(0.16 / 25.4, rel=1e-14)
    for one, other in zip(mm["developables"], inches["developables"], strict=True):
        factor = 1.0 if "darboux" in one["kind"] else 25.4  # made of directions alone
        assert other["type"] == one["type"]
        for mine, theirs in zip(one["singularities"], other["singularities"], strict=True):
            np.testing.assert_allclose(
                theirs["point"], factor * np.array(mine["point"]), rtol=1e-12, atol=1e-12
            )


def test_the_table_ends_with_the_path_of_the_figure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    monkeypatch.chdir(tmp_path)
    written(tmp_path, HELIX)
    assert run(["analyze", "helix.toml"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    lines = said.out.splitlines()
    assert lines[-1] == str(Path("out", "helix-analysis.svg")) and Path(lines[-1]).is_file()
    rows = [line.split(maxsplit=1) for line in lines[1:-1]]
    assert ["length", "50 mm"] in rows
    assert ["curvature", "0.12 /mm"] in rows
    assert ["helix", "cylindrical, slant, clad, g-clad helix"] in rows
    assert "  rectifying developable: cylinder" in lines
    assert [path.name for path in tmp_path.iterdir() if path.name != "helix.toml"] == ["out"]
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["helix-analysis.svg"]


# --- whose curves --------------------------------------------------------------------------


def test_a_job_has_its_first_curve_at_the_top_and_others_below(
    tmp_path: Path, capsys: Captured
) -> None:
    found = told(REPOSITORY / "samples" / "oblique-reducer.toml", capsys, tmp_path)
    (other,) = found["others"]
    assert (found["curve"], other["curve"]) == ("surface.rails[0]", "surface.rails[1]")
    assert set(CONTRACT) <= set(other)
    assert Path(found["figure"]) == tmp_path / "oblique-reducer-analysis.svg"


def test_a_job_without_a_curve_key_gives_its_base_curve(tmp_path: Path, capsys: Captured) -> None:
    """The lampshade's lower circle has radius 100."""
    found = told(REPOSITORY / "samples" / "lampshade.toml", capsys, tmp_path)
    assert found["curve"] == "surface: base curve" and found["closed"] is True
    assert found["length"] == pytest.approx(200.0 * np.pi, rel=1e-14)


def test_panels_are_named(tmp_path: Path) -> None:
    text = """\
name = "two"
units = "cm"
[[panel]]
name = "left"
[panel.surface]
kind = "cylinder"
direction = [0, 0, 1]
height = 3
directrix = { kind = "circle", radius = 2 }
[[panel]]
name = "right"
[panel.surface]
kind = "tangent"
curve = { kind = "helix", radius = 2, pitch = 1, turns = 1 }
extent = [1, 2]
"""
    text = text.replace("height = 3\n", "extent = [0, 3]\n")
    found = load_curves(written(tmp_path, text))
    assert [each.name for each in found.curves] == [
        "panel left > surface.directrix",
        "panel right > surface.curve",
    ]
    assert np.linalg.norm(found.curves[0].curve.point(0.3)) == pytest.approx(20.0, rel=1e-14)


@pytest.mark.parametrize(
    ("stem", "name"),
    [("my curve", "my-curve"), ("Kurve Ä2", "Kurve-2"), ("...", "curve"), ("con", "con")],
)
def test_a_file_without_a_name_is_called_like_itself(tmp_path: Path, stem: str, name: str) -> None:
    assert load_curves(written(tmp_path, HELIX, f"{stem}.toml")).name == name


def test_points_of_a_file_are_read(tmp_path: Path, capsys: Captured) -> None:
    (tmp_path / "rail.csv").write_text("x,y,z\n0,0,0\n1,0,0\n1,1,0\n1,1,1\n")
    path = written(tmp_path, '[curve]\nkind = "points"\nfile = "rail.csv"\n')
    assert told(path, capsys, tmp_path)["degrees"]["curve"] == 3


@pytest.mark.slow
@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.stem)
def test_every_sample_is_analysed_or_refused_in_one_line(
    path: Path, tmp_path: Path, capsys: Captured
) -> None:
    code = run(["analyze", str(path), "-o", str(tmp_path)])
    said = capsys.readouterr()
    assert code in (0, 3)
    if code:
        assert said.out == "" and len(said.err.splitlines()) == 1
        assert "all its rulings start at one point" in said.err
    else:
        assert said.err == "" and (tmp_path / f"{path.stem}-analysis.svg").is_file()


# --- the figure ----------------------------------------------------------------------------


def drawn(path: Path) -> str:
    (named, *_) = load_curves(path).curves
    analysis = analyze(named.curve, named.spec)
    return figure(analysis, path.stem, figure_subtitle(named.name, analysis))


@pytest.mark.parametrize("name", ["auger-flight", "hopper", "oblique-reducer", "nameplate"])
def test_the_figure_is_plain_svg_of_finite_numbers(name: str) -> None:
    text = drawn(REPOSITORY / "samples" / f"{name}.toml")
    assert text.isascii()
    root = ElementTree.fromstring(text)
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    names = {element.tag.split("}")[1] for element in root.iter()}
    assert names <= {"svg", "title", "rect", "path", "circle", "text"}
    width, height = float(root.attrib["width"]), float(root.attrib["height"])
    for element in root.iter():
        numbers = [float(x) for x in re.findall(r"-?[\d.]+", element.attrib.get("d", ""))]
        assert all(
            -1.0 <= x <= max(width, height) for x in numbers if "h10" not in element.attrib["d"]
        )
        assert not re.search("nan|inf", element.attrib.get("d", ""))


def test_equal_files_give_equal_figures(tmp_path: Path) -> None:
    path = written(tmp_path, SLANT, "slant.toml")
    for out in ("one", "two"):
        assert run(["analyze", str(path), "-o", str(tmp_path / out)]) == 0
    one, two = (tmp_path / out / "slant-analysis.svg" for out in ("one", "two"))
    assert one.read_bytes() == two.read_bytes() == drawn(path).encode()


def test_the_curvature_stands_where_its_axis_says(tmp_path: Path) -> None:
    """Of a circle of radius 20 mm: a level line at 0.05 of what the axis shows."""
    path = written(tmp_path, '[curve]\nkind = "circle"\nradius = 20\n', "circle.toml")
    root = ElementTree.fromstring(drawn(path))
    texts = {
        element.text: float(element.attrib["y"]) - 4.5
        for element in root.iter()
        if element.tag.endswith("text") and element.attrib.get("text-anchor") == "end"
    }
    (line,) = [
        element.attrib["d"]
        for element in root.iter()
        if element.attrib.get("stroke-width") == "1.8" and element.attrib["stroke"] == "#1f5fa8"
    ]
    levels = {y for _, y in re.findall(r"([\d.]+) ([\d.]+)", line)}
    per_unit = (texts["0.02"] - texts["0.04"]) / 0.02
    assert len(levels) == 1
    # labels are rounded to a tenth of a pixel
    assert float(levels.pop()) == pytest.approx(texts["0.04"] - 0.01 * per_unit, abs=0.2)


# --- refusals ------------------------------------------------------------------------------


@pytest.mark.parametrize("path", BROKEN, ids=lambda path: path.stem)
def test_a_broken_file_says_exactly_what_is_wrong_and_leaves_no_figure(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    code, lines = expectation(path)
    monkeypatch.chdir(path.parent)
    assert run(["analyze", path.name, "--json", "-o", str(tmp_path / "out")]) == code
    said = capsys.readouterr()
    got = said.err.splitlines()
    assert len(got) == len(lines)
    for line, expected in zip(got, lines, strict=True):
        assert re.fullmatch(as_pattern(expected, path.name), line), line
    entry = json.loads(said.out)
    assert entry["job"] == path.name
    assert entry["error"]["code"] == code and entry["error"]["message"] == got[0]
    assert list(tmp_path.iterdir()) == []


def test_a_job_with_a_curve_beside_its_surface_is_a_wrong_job(
    tmp_path: Path, capsys: Captured
) -> None:
    job = (REPOSITORY / "samples" / "lampshade.toml").read_text()
    path = written(tmp_path, f'{job}\n[curve]\nkind = "circle"\nradius = 1\n')
    assert run(["analyze", str(path)]) == 2
    assert 'this version knows no key "curve" here' in capsys.readouterr().err


def test_an_out_that_cannot_be_written_is_told_as_that(tmp_path: Path, capsys: Captured) -> None:
    path = written(tmp_path, HELIX)
    (tmp_path / "taken" / "helix-analysis.svg").mkdir(parents=True)
    assert run(["analyze", str(path), "-o", str(tmp_path / "taken")]) == 5
    assert "cannot write helix-analysis.svg" in capsys.readouterr().err
    assert [entry.name for entry in (tmp_path / "taken").iterdir()] == ["helix-analysis.svg"]
    assert run(["analyze", str(path), "-o", str(path)]) == 5
    assert capsys.readouterr().err == (
        f"{path}: {path} is a file, not a folder (choose another folder with -o)\n"
    )


def test_an_earlier_figure_is_replaced(tmp_path: Path) -> None:
    path = written(tmp_path, HELIX)
    (tmp_path / "helix-analysis.svg").write_text("old")
    assert run(["analyze", str(path), "-o", str(tmp_path)]) == 0
    assert (tmp_path / "helix-analysis.svg").read_text().startswith("<?xml")


@pytest.mark.parametrize("library", ["scipy", "OCP", "ezdxf", "shapely", "manifold3d"])
def test_analysing_a_formula_does_without(library: str, tmp_path: Path) -> None:
    words = ["analyze", str(written(tmp_path, HELIX)), "-o", str(tmp_path)]
    code = (
        "import sys; from devcad.cli import run\n"
        f"assert run({words!r}) == 0\n"
        f"sys.exit({library!r} in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True)
    assert done.returncode == 0, done.stderr
