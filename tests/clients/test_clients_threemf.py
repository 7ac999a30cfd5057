"""3MF files in slicers' readers: strictly valid, one manifold solid a panel, in order."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from zipfile import ZipFile

import clients
import lib3mf
import numpy as np
import pytest
import trimesh
from exported import Exported

pytestmark = pytest.mark.clients

FLOAT32 = 2e-7  # relative; both files store single precision
SINGLE_SUMS = 1e-3  # PrusaSlicer sums in single precision, which costs thin parts four digits


def test_lib3mf_reads_it_strictly_without_a_warning(exported: Exported) -> None:
    for path in exported.files("3mf"):
        model = _model(path)
        assert model.GetUnit() == lib3mf.ModelUnit.MilliMeter
        items = _all(model.GetBuildItems())
        found = [item.GetObjectResource() for item in items]
        assert [thing.GetName() for thing in found] == [p["name"] for p in exported.panels]
        assert all(thing.IsManifoldAndOriented() for thing in found)
        (group,) = _all(model.GetBaseMaterialGroups())
        (member,) = group.GetAllPropertyIDs()
        shown = group.GetDisplayColor(member)
        expected = [round(255.0 * c) for c in exported.colour]
        assert [shown.Red, shown.Green, shown.Blue] == expected


def test_prusaslicer_calls_every_panel_manifold(exported: Exported) -> None:
    for path in exported.files("3mf"):
        seen = clients.prusa_slicer(path)
        assert [thing["manifold"] for thing in seen] == ["yes"] * len(exported.panels)
        assert not any({"open_edges", "facets_reversed"} & thing.keys() for thing in seen)
        volume = sum(float(thing["volume"]) for thing in seen)
        (stl,) = exported.files("stl")
        assert volume == pytest.approx(_load(stl).volume, rel=SINGLE_SUMS)


def test_it_holds_the_solids_of_the_stl(exported: Exported) -> None:
    """The same facets: as many, of the same volume, in the same box."""
    for path in exported.files("3mf"):
        (stl,) = exported.files("stl")
        true = _load(stl)
        model = _model(path)  # which has to outlive its items
        corners = np.concatenate([_corners(item) for item in _all(model.GetBuildItems())])
        assert len(corners) == len(true.faces)
        six_volumes = np.linalg.det(corners - corners.reshape(-1, 3).mean(axis=0)).sum()
        assert six_volumes / 6.0 == pytest.approx(true.volume, rel=1e-9)
        box = [corners.min(axis=(0, 1)), corners.max(axis=(0, 1))]
        np.testing.assert_allclose(box, true.bounds, rtol=FLOAT32)


def test_the_clients_notice_a_missing_triangle(exported: Exported, tmp_path: Path) -> None:
    """So that their consent above means something."""
    if exported.name != "lampshade" or not exported.solid:
        return
    (path,) = exported.files("3mf")
    broken = tmp_path / path.name
    with ZipFile(path) as whole, ZipFile(broken, "w") as package:
        for name in whole.namelist():
            lines = whole.read(name).decode().splitlines(keepends=True)
            first = next((k for k, line in enumerate(lines) if line.startswith("<triangle ")), None)
            package.writestr(name, "".join(line for k, line in enumerate(lines) if k != first))
    assert [thing["manifold"] for thing in clients.prusa_slicer(broken)] == ["no"]
    model = _model(broken)
    (item,) = _all(model.GetBuildItems())
    assert not item.GetObjectResource().IsManifoldAndOriented()


def _model(path: Path) -> Any:
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    warnings = [reader.GetWarning(k) for k in range(reader.GetWarningCount())]
    assert warnings == []
    return model


def _all(iterator: Any) -> list[Any]:
    found = []
    while iterator.MoveNext():
        found.append(iterator.GetCurrent())
    return found


def _corners(item: Any) -> np.ndarray:
    """The corners of an object's facets, (m, 3, 3)."""
    thing = item.GetObjectResource()
    points = np.array([list(row.Coordinates) for row in thing.GetVertices()])
    return points[np.array([list(row.Indices) for row in thing.GetTriangleIndices()])]


def _load(path: Path) -> trimesh.Trimesh:
    mesh = trimesh.load_mesh(str(path), process=False)
    mesh.merge_vertices()
    return mesh
