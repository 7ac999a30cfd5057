"""Keys that a list gives in place of those of a job file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from devcad.errors import JobError
from devcad.job.changes import put
from devcad.job.load import load, read_tree

LAMP = 'name = "lamp"\n[surface]\nkind = "frustum"\nradius = 100\ntop_radius = 50\nheight = 120\n'


def changed(tree: dict[str, Any], *changes: tuple[str, str]) -> dict[str, Any]:
    put(tree, changes, "job.toml")
    return tree


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [
        ("thickness", "2", 2),
        ("thickness", "-1.5e-1", -0.15),
        ("meta.revision", "03", "03"),
        ("meta.part_number", "12", "12"),
        ("recipe.glb.animate", "TRUE", True),
        ("recipe.formats", '["dxf", "svg"]', ["dxf", "svg"]),
        ("material", "dc01", "dc01"),
        ("thickness", "9" * 400, "9" * 400),  # no number that a float holds
    ],
)
def test_a_text_is_what_toml_would_read(key: str, text: str, value: object) -> None:
    node: Any = changed({}, (key, text))
    for word in key.split("."):
        node = node[word]
    assert node == value and type(node) is type(value)


def test_a_text_stays_one_where_the_file_has_one() -> None:
    tree = {"surface": {"curve": {"x": "cos(t)"}}}
    assert changed(tree, ("surface.curve.x", "3"))["surface"]["curve"]["x"] == "3"


def test_panels_by_name_and_rows_by_number() -> None:
    tree = {"panel": [{"name": "left"}, {"name": "2"}], "cutout": [{"diameter": 3}, {}]}
    changed(
        tree,
        ("panel.left.surface.width", "7"),
        ("panel.2.bend", "1"),
        ("cutout.2.diameter", "4.5"),
    )
    assert tree == {
        "panel": [{"name": "left", "surface": {"width": 7}}, {"name": "2", "bend": 1}],
        "cutout": [{"diameter": 3}, {"diameter": 4.5}],
    }


@pytest.mark.parametrize(
    ("key", "text", "says"),
    [
        ("name.x", "1", 'the key leads to no "x"'),
        ("name.x.y", "1", 'the key leads to no "x"'),
        ("cutout.3.diameter", "1", 'the key leads to no "3"'),
        ("cutout.0.diameter", "1", 'the key leads to no "0"'),
        ("surface.extent", "[1, 2", "not a value"),
        ("surface.extent", "[" * 100, "not a value"),
    ],
)
def test_what_cannot_be_set_is_told_with_its_key(key: str, text: str, says: str) -> None:
    with pytest.raises(JobError, match=r"job\.toml") as caught:
        changed({"name": "a", "cutout": [{}]}, (key, text))
    assert says in str(caught.value) and key in str(caught.value)


def test_a_changed_job_has_another_hash_and_an_unchanged_one_that_of_its_file(
    tmp_path: Path,
) -> None:
    path = tmp_path / "lamp.toml"
    path.write_text(LAMP)
    plain, wide = load(path), load(path, [("surface.radius", "120"), ("name", "wide")])
    assert (wide.name, plain.name) == ("wide", "lamp")
    assert wide.sha256 != plain.sha256 == load(path, []).sha256
    other = load(path, [("name", "wide"), ("surface.radius", "120")])  # columns in another order
    assert other.sha256 == wide.sha256


def test_files_may_lie_in_another_folder(tmp_path: Path) -> None:
    (tmp_path / "work").mkdir()
    (tmp_path / "rail.csv").write_text("0,0,0\n1,0,0\n")
    path = tmp_path / "work" / "a.toml"
    path.write_text('name = "a"\n[surface]\nkind = "points"\nfile = "rail.csv"\n')
    tree, _ = read_tree(path, folder=tmp_path)
    assert tree["surface"]["points"] == [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
