"""Writing STEP, timed after OpenCASCADE is loaded."""

import time

import pytest
from OCP.BRepGProp import BRepGProp
from OCP.GProp import GProp_GProps

import devcad
from devcad.export._step_file import read_step, write_step
from devcad.export._step_plan import body
from devcad.export._step_shape import shape_of

pytestmark = pytest.mark.bench


def test_writing_one_fitted_face_takes_less_than_five_milliseconds(tmp_path):
    job = tmp_path / "job.toml"
    job.write_text(
        'name = "job"\n[surface]\nkind = "tangent"\nextent = [25, 80]\n'
        'curve = { kind = "helix", radius = 30, pitch = 90, turns = 0.5 }\n'
    )
    panel = devcad.build(job).panels[0]
    plan = body(panel, 1e-4, 5)
    assert len(plan.faces) == 1
    path = tmp_path / "face.step"
    shapes = [("job", shape_of(plan))]
    shortest = float("inf")
    for _ in range(40):
        start = time.process_time()  # an absolute figure: what a busy machine does not lengthen
        write_step(path, "job", shapes, (0.6, 0.6, 0.6), "AP214")
        shortest = min(shortest, time.process_time() - start)
    area = GProp_GProps()
    BRepGProp.SurfaceProperties_s(read_step(path), area, 1e-10)
    assert area.Mass() == pytest.approx(panel.pattern.area, rel=2e-6)  # the fit's own bias
    assert shortest < 5e-3, f"{1e3 * shortest:.1f} ms"
