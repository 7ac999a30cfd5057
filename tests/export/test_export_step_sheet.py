"""Mid-surfaces as STEP, and the two schemas: what a fresh kernel finds in the files."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import product
from pathlib import Path

import parts
import pytest
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_ChildIterator, TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_SHELL, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from devcad.export import Options, step, stepflat, stepsheet
from devcad.export._step_file import read_step
from devcad.part import Panel, Part

BRASS = (201 / 255, 168 / 255, 76 / 255)
SCHEMAS = {
    "AP214": ("AUTOMOTIVE_DESIGN { 1 0 10303 214", "'automotive_design',2000"),
    "AP242": (
        "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF {1 0 10303 442",
        "'ap242_managed_model_based_3d_engineering',2013",
    ),
}

PANELS = {
    "frustum": parts.frustum,
    "pipe": lambda thickness: parts.frustum(60.0, 60.0, thickness=thickness),
    "cone": lambda thickness: parts.frustum(top=0.0, thickness=thickness),
    "mitred pipe": parts.mitred_pipe,
    "elliptic cone": parts.elliptic_cone,
    "helix": parts.helix_strip,
    "pyramid": parts.hopper,
}


def panel(name: str, thickness: float) -> Panel:
    return PANELS[name](thickness=thickness)  # type: ignore[operator]


@pytest.mark.parametrize("name", PANELS)
def test_the_mid_surface_of_a_thick_part_is_the_step_of_the_thin_one(
    name: str, tmp_path: Path
) -> None:
    """To the byte: the middle is what the sheet without thickness is."""
    (sheet,) = stepsheet.write(parts.part(panel(name, 2.0)), tmp_path, Options())
    (thin,) = step.write(parts.part(panel(name, 0.0)), tmp_path, Options())
    assert sheet.path == tmp_path / "job-sheet.step"
    assert sheet.format == "step-sheet"
    assert sheet.path.read_bytes() == thin.path.read_bytes()
    assert sheet.max_deviation == thin.max_deviation
    assert [c.name for c in sheet.checks] == ["step-deviation", "step-twist", "area"]
    assert all(c.passed for c in sheet.checks)


def test_a_sheets_area_is_checked(tmp_path: Path) -> None:
    true = panel("elliptic cone", 2.0)
    wrong = replace(true, pattern=replace(true.pattern, area=1.001 * true.pattern.area))
    (made,) = stepsheet.write(parts.part(wrong), tmp_path, Options())
    (failed,) = (check for check in made.checks if not check.passed)
    assert (failed.name, failed.panel, failed.unit) == ("area", "body", "relative")
    assert failed.value == pytest.approx(1e-3, rel=2e-3)


def test_a_coarse_fit_that_was_asked_for_is_not_refused_for_its_area(tmp_path: Path) -> None:
    for tolerance in (1e-3, 1e-2, 0.1):
        options = Options(step_tolerance=tolerance)
        (made,) = step.write(parts.part(panel("helix", 0.0)), tmp_path, options)
        assert all(check.passed for check in made.checks)


def pair(thickness: float, **more: object) -> Part:
    both = parts.part(
        replace(panel("frustum", thickness), name="left"),
        replace(panel("pyramid", thickness), name="right"),
        name="pair",
    )
    return replace(both, colour=BRASS, **more)  # type: ignore[arg-type]


def label_name(label: TDF_Label) -> str:
    name = TDataStd_Name()
    assert label.FindAttribute(TDataStd_Name.GetID_s(), name)
    return str(name.Get().ToExtString())


def products(path: Path) -> tuple[dict[str, list[str]], dict[str, list[float]]]:
    """The free shapes with their components, and the sRGB colours of the bodies."""
    document = TDocStd_Document(TCollection_ExtendedString("test"))
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    assert reader.ReadFile(str(path)) and reader.Transfer(document)
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    free: dict[str, list[str]] = {}
    paints = {}
    top = TDF_ChildIterator(shapes.Label())
    while top.More():
        label = top.Value()
        if XCAFDoc_ShapeTool.IsFree_s(label):
            inner = TDF_ChildIterator(label)
            names = free.setdefault(label_name(label), [])
            while XCAFDoc_ShapeTool.IsAssembly_s(label) and inner.More():
                names.append(label_name(inner.Value()))
                inner.Next()
        paint = Quantity_Color()
        shape = XCAFDoc_ShapeTool.GetShape_s(label)
        if colours.GetColor(shape, XCAFDoc_ColorSurf, paint):
            paints[label_name(label)] = list(paint.Values(Quantity_TOC_sRGB))
        top.Next()
    return free, paints


@pytest.mark.parametrize(("schema", "thickness"), [*product(SCHEMAS, (0.0, 1.5))])
def test_every_step_file_says_one_schema_and_keeps_names_and_colours(
    schema: str, thickness: float, tmp_path: Path
) -> None:
    """Header and body agree; the kernel reads the structure back, in AP242 as in AP214."""
    options = Options(step_schema=schema)
    (solid,) = step.write(pair(thickness), tmp_path, options)
    (sheet,) = stepsheet.write(pair(thickness), tmp_path, options)
    for path, kind in ((solid.path, bool(thickness)), (sheet.path, False)):
        text = re.sub(r"\s+", " ", path.read_text("ascii"))
        for name, (header, body) in SCHEMAS.items():
            assert (header in text, body in text) == (name == schema, name == schema)
        free, paints = products(path)
        assert free == {"pair": ["left", "right"]}
        assert paints.keys() == {"left", "right"}
        for paint in paints.values():
            assert paint == pytest.approx(BRASS, abs=1e-6)  # the kernel holds single precision
        shape = read_step(path)
        assert BRepCheck_Analyzer(shape, True).IsValid()
        explorer = TopExp_Explorer(shape, TopAbs_SOLID if kind else TopAbs_SHELL)
        bodies = 0
        while explorer.More():
            bodies += 1
            explorer.Next()
        assert bodies == 2


def test_both_schemas_carry_the_same_data(tmp_path: Path) -> None:
    """But for the lines that name them: nothing that we write is an entity of one alone."""
    told = {}
    for schema in SCHEMAS:
        (made,) = step.write(pair(1.5), tmp_path, Options(step_schema=schema))
        text = made.path.read_text("ascii")
        told[schema] = text[text.index("#3 =") :]
        assert "APPLICATION_PROTOCOL_DEFINITION" not in told[schema]
    assert told["AP214"] == told["AP242"]


def test_bytes_do_not_depend_on_what_was_written_before(tmp_path: Path) -> None:
    """The kernel lists coloured bodies by their addresses and breaks lines where it likes: files
    of several lengths, so that its breaks fall between any two words."""
    first: dict[tuple[str, int], bytes] = {}
    for _ in range(3):
        for schema, count in product(SCHEMAS, (2, 3, 5)):
            bodies = [replace(panel("frustum", 0.0), name=f"body-{k}") for k in range(count)]
            made = stepsheet.write(parts.part(*bodies), tmp_path, Options(step_schema=schema))
            data = made[0].path.read_bytes()
            assert first.setdefault((schema, count), data) == data


def test_a_blank_needs_a_pattern_and_says_so_for_its_panel(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="panel left: the panel has no pattern"):
        stepflat.write(pair(1.5), tmp_path, Options())
