"""STEP files as two kernels in this process see them: OpenCASCADE by its bindings, and gmsh."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import clients


def in_kernel(path: Path) -> dict[str, Any]:
    """What a fresh reader finds, measured by adaptive quadrature."""
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


def in_gmsh(path: Path) -> dict[str, Any]:
    """Area and volume as gmsh measures them, the triangles of the face with the fewest when all
    are meshed, and its last complaint."""
    with _gmsh() as gmsh:
        gmsh.model.occ.importShapes(str(path), highestDimOnly=False)
        gmsh.model.occ.synchronize()
        faces, solids = gmsh.model.getEntities(2), gmsh.model.getEntities(3)
        facts = {
            "area": sum(gmsh.model.occ.getMass(*face) for face in faces),
            "volume": sum(gmsh.model.occ.getMass(*solid) for solid in solids),
        }
        longest = max(_sides(gmsh.model.getBoundingBox(-1, -1)))
        gmsh.option.setNumber("Mesh.MeshSizeMax", longest / 20)
        gmsh.model.mesh.generate(2)
        elements = [gmsh.model.mesh.getElements(*face)[1] for face in faces]
        facts["fewest_triangles"] = min(sum(len(e) for e in found) for found in elements)
        facts["complaint"] = gmsh.logger.getLastError()
    return facts


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
