"""Holes in STEP files: FreeCAD finds them fit for boolean operations, gmsh meshes every face."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import clients
import pytest

import devcad

pytestmark = pytest.mark.clients

HOLE = '\n[[cutout]]\nshape = "circle"\ndiameter = {}\nat_surface = [{}, {}]\n'
SLOT = '\n[[cutout]]\nshape = "slot"\nlength = 60\nwidth = 12\nangle = 90\nat_surface = [{}, {}]\n'
DRILL = (
    '\n[[cutout]]\nshape = "drill"\naxis = [[0, 0, 75], [1, 0.2, 0.1]]\n'
    "diameter = 20\nthrough = true\n"
)
FRUSTUM = '[surface]\nkind = "frustum"\nradius = 80\ntop_radius = 40\nheight = 120\n'
OBLIQUE = (
    '[surface]\nkind = "ruled"\n[[surface.rails]]\nkind = "circle"\nradius = 100\n'
    '[[surface.rails]]\nkind = "circle"\nradius = 60\ncenter = [40, 0, 150]\n'
)
DUCT = (
    '[surface]\nkind = "cylinder"\ndirection = [0, 0, 1]\nlength = 300\n[surface.directrix]\n'
    'kind = "polyline"\nclosed = true\n'
    "points = [[0, -100, 0], [100, -100, 0], [100, 100, 0], [-100, 100, 0], [-100, -100, 0]]\n"
)
SQUARE_TO_ROUND = (
    '[surface]\nkind = "loft"\n[[surface.rails]]\nkind = "polyline"\nclosed = true\n'
    "corner_radius = 20\n"
    "points = [[100, 0, 0], [100, 100, 0], [-100, 100, 0], [-100, -100, 0], [100, -100, 0]]\n"
    '[[surface.rails]]\nkind = "circle"\nradius = 60\ncenter = [0, 0, 120]\n'
)
SURFACES = {
    "slots across the cut of a cone": FRUSTUM + SLOT.format(0.0, 0.5) + HOLE.format(20, 0.4, 0.5),
    "drilled oblique cone": OBLIQUE + DRILL,
    "oblique cone with holes": OBLIQUE + HOLE.format(20, 0.25, 0.5) + SLOT.format(0.0, 0.5),
    "duct with holes over its bends": DUCT
    + HOLE.format(40, 0.125, 0.5)
    + HOLE.format(40, 0.25, 0.5)
    + HOLE.format(40, 0.0, 0.5),
    "square-to-round with holes over its joints": SQUARE_TO_ROUND
    + HOLE.format(20, 0.125, 0.6)
    + HOLE.format(20, 0.3, 0.5),
}
JOBS = {
    f"{name}, {thickness}": (surface, thickness)
    for name, surface in SURFACES.items()
    for thickness in (0.0, 1.5)
}


@pytest.fixture(scope="session")
def perforated(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, float]]:
    """The STEP file of every job, and the area or volume that it must have."""
    home, out = tmp_path_factory.mktemp("perforated"), {}
    for k, (name, (surface, thickness)) in enumerate(JOBS.items()):
        job = home / f"job{k}.toml"
        job.write_text(f'name = "job{k}"\nthickness = {thickness}\n{surface}')
        part = devcad.build(job)
        devcad.export(part, home, formats=["step"])
        out[name] = home / part.name / f"{part.name}.step", part.panels[0].pattern.area
    return out


@pytest.fixture(scope="session")
def seen(
    perforated: dict[str, tuple[Path, float]], tmp_path_factory: pytest.TempPathFactory
) -> clients.Facts:
    answer = tmp_path_factory.mktemp("freecad") / "perforated"
    return clients.freecad([path for path, _ in perforated.values()], answer)


@pytest.mark.parametrize("name", JOBS)
def test_freecad_accepts_and_measures_it(
    name: str, perforated: dict[str, tuple[Path, float]], seen: clients.Facts
) -> None:
    path, area = perforated[name]
    facts: dict[str, Any] = seen[str(path)]
    assert facts["valid"]
    assert facts["boolean_check"] == "ok"
    thickness = JOBS[name][1]
    found = facts["volume"] / thickness if thickness else facts["area"]
    assert found == pytest.approx(area, rel=1e-5)


@pytest.mark.parametrize("name", JOBS)
def test_gmsh_meshes_every_face(name: str, perforated: dict[str, tuple[Path, float]]) -> None:
    try:
        import gmsh
    except OSError as problem:
        clients.missing(f"a library of gmsh ({problem})")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.importShapes(str(perforated[name][0]), highestDimOnly=False)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 10.0)
        gmsh.model.mesh.generate(2)
        for face in gmsh.model.getEntities(2):
            assert sum(map(len, gmsh.model.mesh.getElements(*face)[1])) > 0
        assert gmsh.logger.getLastError() == ""
    finally:
        gmsh.finalize()
