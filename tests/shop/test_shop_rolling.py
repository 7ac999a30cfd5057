"""The rolling table: lengths along the blank's edges and radii, against circles and cones."""

from __future__ import annotations

import csv

import numpy as np
import pytest

import devcad
from devcad.shop.rolling import stations
from devcad.shop.springback import kept_share

CONE = """
[surface]
kind = "frustum"
radius = 100
top_radius = 50
height = 120
sweep = 200
"""


def built(folder, text):
    job = folder / "job.toml"
    job.write_text(f'name = "job"\n{text}')
    return devcad.build(job)


def test_stations_of_a_cone_are_even_and_as_long_as_its_arcs(tmp_path):
    (panel,) = built(tmp_path, "thickness = 2\n" + CONE).panels
    found = stations(panel, 25.0, None)
    length = 100 * np.radians(200)  # the base is an arc of the cone's own circle
    assert len(found) == int(np.ceil(length / 25.0)) + 1
    base = np.array([s.base for s in found])
    np.testing.assert_allclose(np.diff(base), length / (len(found) - 1), rtol=1e-11)
    np.testing.assert_allclose([s.top for s in found], 0.5 * base, rtol=1e-11, atol=1e-11)
    # rho = r / cos of the slope, 130 / 120; inside is 1 mm less
    assert found[3].radii == pytest.approx((100 * 130 / 120 - 1, 50 * 130 / 120 - 1), rel=1e-12)
    assert found[3].template == pytest.approx(75 * 130 / 120 - 1, rel=1e-12)
    assert found[3].loaded == (None, None)
    assert {s.turn for s in found} == {1}


def test_the_blank_s_lengths_are_the_neutral_fibre_s(tmp_path):
    text = (
        "thickness = 2\n[recipe.neutral]\nk = 0.4\n"
        '[surface]\nkind = "cylinder"\nradius = 10\nlength = 30\nsweep = 180\n'
    )
    (panel,) = built(tmp_path, text).panels
    found = stations(panel, 25.0, None)
    assert found[-1].base == pytest.approx(np.pi * 9.8, rel=1e-12)
    assert found[-1].top == pytest.approx(np.pi * 9.8, rel=1e-12)
    assert panel.facts["flat_area"] == pytest.approx(np.pi * 9.8 * 30, rel=1e-12)
    assert panel.facts["area"] == pytest.approx(np.pi * 10 * 30, rel=1e-12)


def test_loaded_radii_spring_back_to_the_part_s(tmp_path):
    (panel,) = built(tmp_path, "thickness = 2\n" + CONE).panels
    a = 200 / (210e3 * 2)
    for station in stations(panel, 50.0, a):
        for radius, loaded in zip(station.radii, station.loaded, strict=True):
            under = loaded + 1.0  # of the middle
            assert kept_share(np.array([a * under]))[0] / under == pytest.approx(1 / (radius + 1))


def test_where_a_flat_goes_over_into_a_bend_there_is_a_station_for_either(tmp_path):
    text = (
        "thickness = 1\n"
        '[surface]\nkind = "cylinder"\ndirection = [0, 0, 1]\nextent = [0, 50]\n'
        '[surface.directrix]\nkind = "polyline"\ncorner_radius = 20\n'
        "points = [[0, 0, 0], [60, 0, 0], [60, 60, 0]]\n"
    )
    (panel,) = built(tmp_path, text).panels
    found = stations(panel, 30.0, None)
    seen = [(round(s.base, 9), s.turn) for s in found]
    bend = 20 * np.pi / 2
    turn = next(s.turn for s in found if s.turn)
    assert (40.0, 0) in seen
    assert (40.0, turn) in seen
    assert (round(40 + bend, 9), turn) in seen
    assert (round(40 + bend, 9), 0) in seen
    assert {s.radii for s in found if not s.turn} == {(None, None)}
    assert all(s.radii == pytest.approx((19.5, 19.5)) for s in found if s.turn)


def test_the_file_has_a_row_a_station_and_none_for_a_plane(tmp_path):
    part = built(tmp_path, 'thickness = 2\nmaterial = "dc01"\n' + CONE)
    devcad.export(part, tmp_path, formats=["rolling"])
    with (tmp_path / "job" / "job-rolling.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    found = stations(part.panels[0], 25.0, 200 / (210e3 * 2))
    assert len(rows) == len(found)
    assert [float(row["loaded_1"]) for row in rows] == pytest.approx([s.loaded[1] for s in found])
    assert [row["bend"] for row in rows] == ["up"] * len(rows)
    plane = built(tmp_path, '[surface]\nkind = "plane"\nwidth = 50\nheight = 30\n')
    devcad.export(plane, tmp_path, formats=["rolling"])
    assert len((tmp_path / "job" / "job-rolling.csv").read_text().splitlines()) == 1
