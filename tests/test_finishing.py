"""What the shop adds changes what is cut, and not the surface that the CAD files show."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import devcad
from devcad.errors import GeometryError
from devcad.part import Part

PLATE = '[surface]\nkind = "plane"\nwidth = 100\nheight = 60\n'
RING = """
[surface]
kind = "cone"
apex = [0, 0, 0]
extent = [0.5, 1]
[surface.directrix]
kind = "circle"
radius = 40
"""


def built(folder: Path, text: str) -> Part:
    job = folder / "job.toml"
    job.write_text(f'name = "job"\n{text}')
    return devcad.build(job)


@pytest.mark.parametrize("thickness", [0, 2])
def test_a_plate_with_an_allowance_keeps_its_surface_in_step(
    tmp_path: Path, thickness: int
) -> None:
    """The writer proves the sheet's area, or the solid's volume, by those of the surface."""
    text = f"thickness = {thickness}\n{PLATE}[edges.top]\nallowance = 10\n"
    part = built(tmp_path, text)
    (panel,) = part.panels
    assert panel.area == pytest.approx(6000.0, rel=1e-12)
    assert panel.pattern.area == pytest.approx(6600.0, rel=1e-12)
    assert devcad.export(part, tmp_path, formats=["step"])


def test_a_flat_ring_is_cut_along_its_circles_alone(tmp_path: Path) -> None:
    (panel,) = built(tmp_path, RING).panels
    (hole,) = panel.pattern.holes
    for edges, radius in ((panel.pattern.outline, 40.0), (hole, 20.0)):
        points = np.concatenate([edge.curve(edge.u)[0] for edge in edges])
        assert np.hypot(*points.T) == pytest.approx(radius, rel=1e-12)
    assert panel.pattern.area == pytest.approx(1200.0 * np.pi, rel=1e-12)


def test_a_flat_ring_grows_outwards_and_not_inwards(tmp_path: Path) -> None:
    (panel,) = built(tmp_path, RING + "[edges.top]\nallowance = 5\n").panels
    assert panel.pattern.area == pytest.approx((45.0**2 - 20.0**2) * np.pi, rel=1e-12)
    with pytest.raises(GeometryError, match="holes have no allowance"):
        built(tmp_path, RING + "[edges.base]\nallowance = 5\n")
