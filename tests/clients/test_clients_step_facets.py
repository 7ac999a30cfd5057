"""Thick facets with curved edges in STEP: FreeCAD finds them fit for boolean operations."""

from __future__ import annotations

from pathlib import Path

import clients
import numpy as np
import pytest

import devcad

pytestmark = pytest.mark.clients

DUCT = (
    '[surface]\nkind = "cylinder"\ndirection = [0, 0, 1]\n'
    'extent = ["-5 - 4*cos(2*pi*t)", "120 + 20*sin(2*pi*t)**2"]\n[surface.directrix]\n'
    'kind = "polyline"\nclosed = true\n'
    "points = [[0, -60, 0], [60, -60, 0], [60, 60, 0], [-60, 60, 0], [-60, -60, 0]]\n"
)
CUTS = (
    '[[cutout]]\nshape = "circle"\ndiameter = 24\nat = [60, 60]\n'
    '[[cutout]]\nshape = "circle"\ndiameter = 20\nat = [85, 180]\n'
    '[[cutout]]\nshape = "rectangle"\nwidth = 20\nheight = 6\nat = [-2, 186]\nnotch = true\n'
)
CORNERS = [
    [round(float(90 * np.cos(x)), 6), round(float(90 * np.sin(x)), 6), 0]
    for x in np.pi * np.arange(24) / 12
]
CONE = (
    '[surface]\nkind = "cone"\napex = [0, 0, 200]\nextent = [0.5, "1 + 0.05*cos(2*pi*t)"]\n'
    f'[surface.directrix]\nkind = "polyline"\nclosed = true\npoints = {CORNERS}\n'
)
JOBS = {"duct": DUCT, "duct with cuts": DUCT + CUTS, "cone": CONE}


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Path, float]]:
    """The STEP file of every job, and the volume that it must have."""
    home, out = tmp_path_factory.mktemp("facets"), {}
    for k, (name, surface) in enumerate(JOBS.items()):
        job = home / f"job{k}.toml"
        job.write_text(f'name = "job{k}"\nthickness = 2\n{surface}')
        part = devcad.build(job)
        devcad.export(part, home, formats=["step"])
        out[name] = home / part.name / f"{part.name}.step", 2.0 * part.panels[0].area
    return out


def test_freecad_accepts_and_measures_them(
    exported: dict[str, tuple[Path, float]], tmp_path: Path
) -> None:
    seen = clients.freecad([path for path, _ in exported.values()], tmp_path / "facets")
    for path, volume in exported.values():
        facts = seen[str(path)]
        assert facts["valid"] and facts["boolean_check"] == "ok"
        assert facts["solids"] == 1 and facts["closed_shells"] == [True]
        assert facts["volume"] == pytest.approx(volume, rel=1e-7)
