"""The material's colour, from the job file into every file that has one."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from zipfile import ZipFile

import pytest

import devcad
from devcad.export.glb import linear
from devcad.shop.materials import material

JOB = """
name = "plate"
thickness = 2.0
{material}
[surface]
kind = "plane"
width = 60
height = 40
"""

STEEL_GREY = (0.62, 0.66, 0.70)


@pytest.mark.parametrize("name", ["brass-cuzn37", "veg-tan-leather", None])
def test_a_jobs_material_colours_its_files(name: str | None, tmp_path: Path) -> None:
    job = tmp_path / "plate.toml"
    job.write_text(JOB.format(material=f'material = "{name}"' if name else ""))
    part = devcad.build(job)
    colour = material(name).colour if name else STEEL_GREY
    assert part.colour == colour
    devcad.export(part, tmp_path, formats=["step", "step-flat", "step-sheet", "glb", "3mf"])
    folder = tmp_path / "plate"
    for stem in ("plate", "plate-flat", "plate-sheet"):
        text = (folder / f"{stem}.step").read_text().replace("\n", "").replace(" ", "")
        told = text.split("COLOUR_RGB('',", 1)[1].split(")", 1)[0].split(",")
        assert [float(x) for x in told] == pytest.approx(colour, abs=1e-6)  # single precision
    glb = (folder / "plate.glb").read_bytes()
    (size,) = struct.unpack_from("<I", glb, 12)
    (paint,) = json.loads(glb[20 : 20 + size])["materials"]
    factor = paint["pbrMetallicRoughness"]["baseColorFactor"]
    assert factor == pytest.approx([*linear(colour), 1.0])
    with ZipFile(folder / "plate.3mf") as package:
        model = package.read("3D/3dmodel.model").decode()
    told = model.split('displaycolor="#', 1)[1][:6]
    assert list(bytes.fromhex(told)) == pytest.approx([255.0 * c for c in colour], abs=0.5)
