"""Every sample is a developable with its front on one side; every kind has a sample."""

from __future__ import annotations

import csv
import tomllib
from pathlib import Path

import numpy as np
import pytest
from constructing import build, inside
from pydantic import TypeAdapter

from devcad.geometry.constructions import SURFACES, Closable, surface_spec

SAMPLES = Path(__file__).parents[2] / "samples"
JOBS = {path.stem: tomllib.loads(path.read_text()) for path in sorted(SAMPLES.glob("*.toml"))}
NAMES = [name for name, job in JOBS.items() if job.get("surface", {}).get("kind") in SURFACES]


def surface(name):
    """The [surface] table, the points of a file in place of its name."""
    table = JOBS[name]["surface"]
    curve = table.get("curve", {})
    if "file" not in curve:
        return table
    with (SAMPLES / curve["file"]).open() as file:
        rows = list(csv.reader(file))[1:]
    points = [[float(x) for x in row] for row in rows]
    return table | {"curve": {"kind": "points", "points": points}}


@pytest.mark.parametrize("name", NAMES)
def test_a_sample_is_developable_and_regular_in_all_its_layers(name):
    half = JOBS[name].get("thickness", 0) / 2
    panels = build(**surface(name)).panels
    chains = [chain for panel in panels for chain in (panel, *panel.flanks)]
    for patch in (patch for chain in chains for patch in chain.patches):
        frame = patch.frame(inside(patch, 501))
        speed = np.linalg.norm(patch.jet(inside(patch, 501), 1).c0[1], axis=1).max()
        scale = np.abs(frame.a).max() + np.abs(frame.c).max() + 1e-300
        assert np.abs(frame.residual_e).max() <= 1e-13 * scale
        assert np.abs(frame.residual_c0).max() <= 1e-13 * speed
        np.testing.assert_allclose(np.linalg.norm(frame.e, axis=1), 1.0, atol=1e-15)
        middle = frame.q + 0.5 * (frame.v_from + frame.v_to) * frame.a
        inner = slice(1, -1)
        assert (middle[inner] > 0.0).all()
        for v in (frame.v_from, frame.v_to):
            width = frame.q + v * frame.a
            if half and np.abs(frame.c).max() > 1e-9 * scale:  # not the corner of a plane fan
                assert (width > half * np.abs(frame.c)).all()
            else:  # without thickness the regression curve may be touched at an end
                assert (width >= -1e-14 * middle.max()).all()


@pytest.mark.parametrize("kind", SURFACES)
def test_every_kind_has_a_sample(kind):
    assert any(JOBS[name]["surface"]["kind"] == kind for name in NAMES)


def test_the_kind_tells_the_model():
    adapter = TypeAdapter(surface_spec())
    for name in NAMES:
        table = surface(name)
        assert type(adapter.validate_python(table)) is SURFACES[table["kind"]]
    assert adapter.json_schema()["discriminator"]["propertyName"] == "kind"


def test_what_may_close_takes_the_keys_of_the_seam():
    tube = {"kind": "cylinder", "radius": 1, "length": 1, "cut": "pi/2", "gap": 0.5}
    model = TypeAdapter(surface_spec()).validate_python(tube)
    assert isinstance(model, Closable)
    assert (model.cut, model.gap) == (np.pi / 2, 0.5)
    with pytest.raises(ValueError, match="cut"):
        TypeAdapter(surface_spec()).validate_python(
            {"kind": "plane", "width": 1, "height": 1, "cut": 0}
        )
