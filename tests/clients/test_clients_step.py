"""STEP files in four programs: every one must see a valid shape of the reported area and volume."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import clients
import pytest
from exported import Exported, Look

pytestmark = pytest.mark.clients

ANALYTIC = 1e-12  # planes, cylinders and cones: rounding
SLANTED = 1e-10  # ... with slanted edges, whose pcurves are fitted to 1e-8 mm
FITTED = 2e-6  # the chord-like bias of a fit within the default tolerance


def test_freecad_finds_the_shape_valid_for_boolean_operations(
    exported: Exported, in_freecad: Look
) -> None:
    for path in exported.files("step"):
        seen = in_freecad(path)
        assert seen["valid"]
        assert seen["boolean_check"] == "ok"


def test_freecad_measures_the_reported_area_or_volume(exported: Exported, in_freecad: Look) -> None:
    (path,) = exported.files("step")
    _assert_measures(exported, in_freecad(path))


def test_freecad_labels_the_parts_by_name(exported: Exported, in_freecad: Look) -> None:
    (path,) = exported.files("step")
    labels = " ".join(in_freecad(path)["labels"])
    assert all(panel["name"] in labels for panel in exported.panels) or exported.name in labels


def test_the_kernel_reads_one_valid_root_without_kinked_faces(exported: Exported) -> None:
    (path,) = exported.files("step")
    seen = _in_kernel(path)
    assert seen["roots"] == 1
    assert seen["valid"]
    assert seen["kinked_faces"] == 0, "a face with a kink passes the validity check"
    assert seen["solids"] == (len(exported.panels) if exported.solid else 0)
    assert seen["largest_tolerance"] <= 1e-3  # mm; sewing that gapes raises it


def test_the_kernel_measures_the_reported_area_or_volume(exported: Exported) -> None:
    (path,) = exported.files("step")
    _assert_measures(exported, _in_kernel(path))


def test_gmsh_measures_and_meshes_every_face(exported: Exported, tmp_path: Path) -> None:
    (path,) = exported.files("step")
    with _gmsh() as gmsh:
        gmsh.model.occ.importShapes(str(path), highestDimOnly=False)
        gmsh.model.occ.synchronize()
        faces, solids = gmsh.model.getEntities(2), gmsh.model.getEntities(3)
        measured = {
            "area": sum(gmsh.model.occ.getMass(*face) for face in faces),
            "volume": sum(gmsh.model.occ.getMass(*solid) for solid in solids),
        }
        _assert_measures(exported, measured)
        longest = max(_sides(gmsh.model.getBoundingBox(-1, -1)))
        gmsh.option.setNumber("Mesh.MeshSizeMax", longest / 20)
        gmsh.model.mesh.generate(2)
        for face in faces:
            _, elements, _ = gmsh.model.mesh.getElements(*face)
            assert sum(map(len, elements)) > 0
        assert gmsh.logger.getLastError() == ""


def test_a_browser_viewer_triangulates_it_and_shows_its_name(
    exported: Exported, in_node: Look
) -> None:
    (path,) = exported.files("step")
    seen = in_node(path)
    assert seen["success"]
    assert seen["triangles"] > 0
    assert exported.name in seen["names"]


def _assert_measures(exported: Exported, measured: dict[str, Any]) -> None:
    """The middle's area, or its area times the thickness: the odd term of the offset cancels."""
    area = exported.total("area")
    (path,) = exported.files("step")
    slanted = "ELLIPSE(" in path.read_text().replace(" ", "")
    exact = SLANTED if slanted else ANALYTIC
    allowed = exact if exported.deviation("step") == 0.0 else FITTED
    if exported.solid:
        assert measured["volume"] == pytest.approx(area * exported.thickness, rel=allowed)
    else:
        assert measured["area"] == pytest.approx(area, rel=allowed)


def _in_kernel(path: Path) -> dict[str, Any]:
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.ShapeAnalysis import ShapeAnalysis_ShapeContents, ShapeAnalysis_ShapeTolerance
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    roots = reader.TransferRoots()
    shape = reader.OneShape()
    contents = ShapeAnalysis_ShapeContents()
    contents.Perform(shape)
    area, volume = GProp_GProps(), GProp_GProps()
    BRepGProp.SurfaceProperties_s(shape, area, 1e-9)
    BRepGProp.VolumeProperties_s(shape, volume, 1e-9, True, True)
    return {
        "roots": roots,
        "valid": BRepCheck_Analyzer(shape, True).IsValid(),
        "kinked_faces": contents.NbC0Surfaces(),
        "solids": contents.NbSolids(),
        "largest_tolerance": ShapeAnalysis_ShapeTolerance().Tolerance(shape, 1),
        "area": area.Mass(),
        "volume": volume.Mass(),
    }


def _sides(box: tuple[float, ...]) -> list[float]:
    return [upper - lower for lower, upper in zip(box[:3], box[3:], strict=True)]


@contextmanager
def _gmsh() -> Iterator[Any]:
    try:
        import gmsh
    except OSError as problem:  # installed, but a system library that it needs is not
        clients.missing(f"a library of gmsh ({problem})")
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    try:
        yield gmsh
    finally:
        gmsh.finalize()
