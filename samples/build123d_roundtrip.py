"""devcad and build123d: parts of a job cut with build123d, and build123d faces as cut patterns.

usage: python samples/build123d_roundtrip.py [OUT]   writes to the folder OUT, default out/build123d
"""

from __future__ import annotations

import sys
from math import hypot, pi
from pathlib import Path

from build123d import Box, Cone, Cylinder, GeomType, Pos, Rot, export_step

import devcad
from devcad.interop import export_pattern, to_build123d, unroll

SAMPLES = Path(__file__).parent


def window(out: Path) -> None:
    """A job's lampshade with a window that build123d cuts out: STEP."""
    shade = to_build123d(devcad.build(SAMPLES / "lampshade.toml"))
    (sheet,) = shade.children
    cut = sheet - Pos(80, 0, 50) * Box(60, 40, 30)
    export_step(cut, out / "lampshade-window.step")
    print(f"{cut.label}: {sheet.volume - cut.volume:.3f} mm3 of {sheet.volume:.3f} cut out")


def pipe_through(out: Path) -> None:
    """A transition without thickness that a pipe passes through: its pattern with the holes."""
    (sheet,) = to_build123d(devcad.build(SAMPLES / "square-to-round.toml")).children
    pattern = unroll(sheet - Pos(0, 0, 60) * Rot(0, 90, 20) * Cylinder(20, 400))
    export_pattern(pattern, out / "transition.dxf")
    print(f"{sheet.label}: {pattern.area:.3f} mm2 and {len(pattern.holes)} holes on one pattern")


def cone_of_ones_own(out: Path) -> None:
    """A build123d cone with a slot: the pattern of its side, a sector, opened at the seam."""
    body = Cone(50, 20, 80) - Pos(-40, 0, 0) * Box(40, 12, 30)
    side = max(body.faces().filter_by(GeomType.CONE), key=lambda face: face.area)
    pattern = unroll(side)
    export_pattern(pattern, out / "cone.dxf")
    export_pattern(pattern, out / "cone.svg")
    whole = pi * (50 + 20) * hypot(80, 50 - 20)
    print(
        f"cone: {pattern.area:.3f} mm2, {whole - pattern.area:.3f} mm2 less than without the slot"
    )


def main(out: Path) -> None:
    """All of it."""
    out.mkdir(parents=True, exist_ok=True)
    window(out)
    pipe_through(out)
    cone_of_ones_own(out)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out/build123d"))
