"""STEP files in four programs: every one must see valid shapes of the reported areas and volumes.

The part, its flat blanks and its mid-surface, which a sheet without thickness is already.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from exported import Exported, Look
from kernels import in_gmsh, in_kernel

pytestmark = pytest.mark.clients

ANALYTIC = 1e-12  # planes, cylinders and cones: rounding
SLANTED = 1e-10  # ... with slanted edges, whose pcurves are fitted to 1e-8 mm
FITTED = 2e-6  # the chord-like bias of a fit within the default tolerance
PLAIN = 1e-5  # ... and the kernels' plain quadrature of a plane face between splines
COLOUR = 1e-6  # single precision


def test_freecad_finds_the_shape_valid_for_boolean_operations(
    exported: Exported, in_freecad: Look
) -> None:
    for format in exported.step_formats:
        for path in exported.files(format):
            seen = in_freecad(path)
            assert seen["valid"], path.name
            assert seen["boolean_check"] == "ok", path.name


def test_freecad_measures_the_reported_area_or_volume(exported: Exported, in_freecad: Look) -> None:
    for format in exported.step_formats:
        (path,) = exported.files(format)
        _assert_measures(exported, format, in_freecad(path))


def test_freecad_labels_the_parts_by_name(exported: Exported, in_freecad: Look) -> None:
    for format in exported.step_formats:
        (path,) = exported.files(format)
        labels = " ".join(in_freecad(path)["labels"])
        named = all(panel["name"] in labels for panel in exported.panels)
        assert named or exported.name in labels


def test_the_kernel_reads_one_valid_root_without_kinked_faces(exported: Exported) -> None:
    for format in exported.step_formats:
        (path,) = exported.files(format)
        seen = in_kernel(path)
        assert seen["roots"] == 1
        assert seen["valid"]
        assert seen["kinked_faces"] == 0, "a face with a kink passes the validity check"
        assert seen["solids"] == (_bodies(exported, format) if _solid(exported, format) else 0)
        assert seen["largest_tolerance"] <= 1e-3  # mm; sewing that gapes raises it


def test_the_kernel_measures_the_reported_area_or_volume(exported: Exported) -> None:
    for format in exported.step_formats:
        (path,) = exported.files(format)
        _assert_measures(exported, format, in_kernel(path), adaptive=True)


def test_gmsh_measures_and_meshes_every_face(exported: Exported) -> None:
    for format in exported.step_formats:
        (path,) = exported.files(format)
        seen = in_gmsh(path)
        _assert_measures(exported, format, seen)
        assert seen["fewest_triangles"] > 0
        assert seen["complaint"] == ""


def test_a_browser_viewer_triangulates_it_and_shows_its_name_and_colour(
    exported: Exported, in_node: Look
) -> None:
    for format in exported.step_formats:
        (path,) = exported.files(format)
        seen = in_node(path)
        assert seen["success"]
        assert seen["triangles"] > 0
        assert exported.name in seen["names"]
        assert len(seen["colours"]) == _bodies(exported, format)
        for colour in seen["colours"]:
            np.testing.assert_allclose(colour, _linear(exported.colour), atol=COLOUR)


def _linear(colour: tuple[float, ...]) -> list[float]:
    """What three.js and its kin calculate with (IEC 61966-2-1)."""
    return [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colour]


def test_the_part_in_ap242_is_read_alike(
    exports: dict[str, Exported | Exception], in_freecad: Look, in_node: Look
) -> None:
    """Names, colours, measures: what the clients see of AP214, they see of AP242."""
    usual, modern = exports["pair"], exports["pair-ap242"]
    assert isinstance(usual, Exported) and isinstance(modern, Exported)
    for format in usual.step_formats:
        (old,), (new,) = usual.files(format), modern.files(format)
        assert "AUTOMOTIVE_DESIGN" in old.read_text()[:600]
        assert "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING" in new.read_text()[:600]
        for look in (in_freecad, in_node, in_kernel, in_gmsh):
            assert look(old) == look(new)


def _solid(exported: Exported, format: str) -> bool:
    return exported.solid and format != "step-sheet"


def _bodies(exported: Exported, format: str) -> int:
    """One a panel, but for thick folded sheets, which stand as their flanks."""
    return len(exported.solids) if exported.solid and format == "step" else len(exported.panels)


def _assert_measures(
    exported: Exported, format: str, measured: dict[str, Any], *, adaptive: bool = False
) -> None:
    """The middle's area, or its area times the thickness: the odd term of the offset cancels."""
    area = exported.total("flat_area" if format == "step-flat" else "area")
    if exported.solid and format == "step":
        area = sum(exported.solids)
    (path,) = exported.files(format)
    slanted = "ELLIPSE(" in path.read_text().replace(" ", "")
    exact = SLANTED if slanted else ANALYTIC
    fitted = FITTED if adaptive or format != "step-flat" else PLAIN
    allowed = exact if exported.deviation(format) == 0.0 else fitted
    if _solid(exported, format):
        assert measured["volume"] == pytest.approx(area * exported.thickness, rel=allowed)
    else:
        assert measured["area"] == pytest.approx(area, rel=allowed)
