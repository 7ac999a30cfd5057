"""[simulate]: lengths arrive in mm, forces and moduli as they are; editors know every key."""

from __future__ import annotations

from pathlib import Path

import pytest

from devcad.job.load import load
from devcad.job.schema import job_schema
from devcad.simulate.settings import Load, Simulation, Support, Where

JOB = """\
name = "plate"
units = "in"
[surface]
kind = "plane"
width = 4
height = 2
[simulate]
{keys}
"""


def read(folder: Path, keys: str) -> Simulation:
    path = folder / "job.toml"
    path.write_text(JOB.format(keys=keys))
    found = load(path).simulate
    assert found is not None
    return found


def test_lengths_are_mm_and_the_rest_is_n(tmp_path: Path) -> None:
    found = read(
        tmp_path,
        'length_scale = 2\nthickness = 0.02\nyoungs = 3000\nsupports = [{ edge = "end" }]\n'
        "loads = [{ at = [1, 0.5], force = [0, 0, 3] }]\nweight = [0, 0, -1]",
    )
    assert found.length_scale == pytest.approx(50.8)
    assert found.thickness == pytest.approx(0.508)
    assert found.youngs == 3000.0
    end = Where("end", None, "simulate.supports[0]")
    assert found.supports == (Support(end, ("x", "y", "z"), clamp=False),)
    assert found.loads == (Load(Where(None, (25.4, 12.7), "simulate.loads[0]"), (0, 0, 3)),)
    assert found.loaded


def test_a_table_without_keys_is_the_default_and_a_job_without_it_has_none(tmp_path: Path) -> None:
    assert read(tmp_path, "") == Simulation()
    path = tmp_path / "plain.toml"
    path.write_text(JOB.format(keys="").split("[simulate]")[0])
    assert load(path).simulate is None


def test_the_schema_explains_every_key() -> None:
    tables = job_schema()["$defs"]
    for name in ("SimulateTable", "SupportTable", "LoadTable"):
        table = tables[name]
        assert table["additionalProperties"] is False
        assert [key for key, x in table["properties"].items() if "description" not in x] == []
