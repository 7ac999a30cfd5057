"""What a job and its recipe say about the shop: units, choices, precedence, refusals."""

from __future__ import annotations

import json
import math
import pickle
from pathlib import Path
from typing import Any

import pytest

from devcad import pipeline
from devcad.errors import JobError
from devcad.job.load import Job, load
from devcad.job.recipe import Recipe, RecipeTable, recipe_names, resolve
from devcad.job.schema import job_schema
from devcad.job.shopsettings import settings
from devcad.job.shoptables import SHOP
from devcad.shop.materials import load as materials
from devcad.shop.materials import material
from devcad.shop.settings import (
    DEFAULT_CHORD,
    EDGES,
    Bends,
    EdgeFinish,
    Labels,
    Limits,
    Neutral,
    Notches,
    Pdf,
    Sheet,
    ShopSettings,
    Stitch,
    neutral_fibre,
)

LAMP = """\
name = "lamp"
units = "{units}"
{top}
[surface]
kind = "frustum"
radius = 100
top_radius = 50
height = 120
{more}
"""


def lamp(folder: Path, more: str = "", *, units: str = "mm", top: str = "") -> Job:
    path = folder / "job.toml"
    path.write_text(LAMP.format(units=units, top=top, more=more), encoding="utf-8")
    return load(path)


def recipe(name: str | None = None, **tables: dict[str, Any]) -> Recipe:
    return resolve(name, RecipeTable.model_validate(tables))


def shop(**tables: dict[str, Any]) -> ShopSettings:
    return recipe(**tables).shop


def told(*sources: dict[str, Any]) -> ShopSettings:
    """The settings of several recipes over one another."""
    models = [RecipeTable.model_validate(source) for source in sources]
    return settings([model.model_dump(exclude_none=True, include=set(SHOP)) for model in models])


def refusal(**tables: dict[str, Any]) -> str:
    with pytest.raises(ValueError) as failure:
        recipe(**tables)
    return str(failure.value)


# --- nothing said, nothing done ------------------------------------------------------------


def test_who_says_nothing_gets_the_plain_pattern(tmp_path: Path) -> None:
    made = pipeline.plan(lamp(tmp_path))
    assert made.shop == ShopSettings()
    assert made.shop.neutral is None
    assert made.shop.bends.mode == "rolled"
    assert made.shop.stitch is made.shop.notches is made.shop.labels is None
    assert made.shop.sheet.kerf == 0.0


@pytest.mark.parametrize("name", sorted(recipe_names()))
def test_a_job_has_the_last_word_over_every_recipe(name: str) -> None:
    made = recipe(name, neutral={"k_din": 0.6}, bends={"count": 3}, labels={"on": False}).shop
    assert made.neutral == Neutral("k_din", k=0.3, words="k_din")
    assert (made.bends.mode, made.bends.count, made.bends.chord) == ("press-brake", 3, None)
    assert made.labels is None


# --- the neutral fibre ---------------------------------------------------------------------


def test_the_two_ks_are_one_fibre() -> None:
    """ANSI counts thicknesses, DIN half thicknesses: K = k_din / 2."""
    assert shop(neutral={"k": 0.42}).neutral == Neutral("k", k=0.42, words="k")
    assert shop(neutral={"k_din": 0.84}).neutral == Neutral("k_din", k=0.42, words="k_din")
    assert shop(neutral={"k_din": 1}).neutral == Neutral("k_din", k=0.5, words="k_din")
    assert shop(neutral={"k": 0}).neutral == Neutral("k", k=0.0, words="k")


def test_table_and_standard_are_kept_as_given() -> None:
    rows = [[0.5, 0.33], [1, 0.38], [99, 0.5]]
    assert shop(neutral={"table": rows}).neutral == Neutral(
        "table", table=((0.5, 0.33), (1, 0.38), (99, 0.5)), words="table"
    )
    standard = shop(neutral={"standard": "din6935"}).neutral
    assert standard == Neutral("standard", standard="din6935", words="din6935")


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        ({"k": 0.51}, "write k_din"),
        ({"k": -0.1}, "0 is the inside of the bend"),
        ({"k_din": 1.1}, "from 0 to 1"),
        ({"table": [[1, 0.0]]}, "K above 0"),
        ({"table": [[-1, 0.3]]}, "at least 0"),
        ({"table": [[1, 0.3, 2]]}, "must have 2"),
        ({"table": [[2, 0.3], [1, 0.4]]}, "does not exceed"),
        ({"table": []}, "at least 1"),
        ({"k": math.nan}, "finite"),
        ({"k": "0.4"}, "number"),
        ({"k": 0.4, "k_din": 0.8}, "k and k_din"),
        ({"k": 0.4, "table": [[1, 0.3]], "standard": "din6935"}, "k, table and standard"),
    ],
)
def test_what_is_no_neutral_fibre_is_refused(keys: dict[str, Any], says: str) -> None:
    assert says in refusal(neutral=keys)


def test_the_later_source_replaces_the_whole_choice() -> None:
    base = {"neutral": {"standard": "din6935"}}
    assert told(base, {"neutral": {"k": 0.3}}).neutral == Neutral("k", k=0.3, words="k")
    assert told({"neutral": {"k": 0.3}}, base).neutral == told(base).neutral
    assert told(base, {"neutral": {}}).neutral == told(base).neutral
    assert told(base, {}).neutral == told(base).neutral


def test_the_material_speaks_last() -> None:
    """Command line, job, recipe, material, default."""
    steel = material("dc01")
    asked = neutral_fibre(told({"neutral": {}}).neutral, steel)
    assert (asked.source, asked.k) == ("material", 0.42)
    assert neutral_fibre(told({"neutral": {"k": 0.3}}).neutral, steel).k == 0.3
    assert neutral_fibre(None, steel).k == 0.5
    assert neutral_fibre(None, None).source == "default"
    unknown = neutral_fibre(told({"neutral": {}}).neutral, None)
    assert (unknown.source, unknown.k) == ("default", 0.5)


@pytest.mark.parametrize("name", materials())
def test_a_k_without_a_source_says_so(name: str) -> None:
    words = neutral_fibre(Neutral("material"), material(name)).words
    assert words.startswith(f"material {name}")
    assert words.endswith("not verified") != material(name).verified


# --- bends ---------------------------------------------------------------------------------


def test_spacing_means_the_press_brake() -> None:
    assert shop(bends={"chord": 0.2}).bends == Bends("press-brake", chord=0.2)
    assert shop(bends={"count": 7}).bends == Bends("press-brake", count=7)
    assert shop(bends={"length": 5}).bends == Bends("press-brake", length=5.0)
    assert shop(bends={"angle": 2}).bends.angle == pytest.approx(math.pi / 90, rel=1e-15)


def test_a_press_brake_told_nothing_keeps_the_chord_of_the_house() -> None:
    assert shop(bends={"mode": "press-brake"}).bends == Bends("press-brake", chord=DEFAULT_CHORD)


def test_spacings_replace_each_other_and_the_mode_with_them() -> None:
    brake = {"bends": {"mode": "press-brake", "chord": 0.2, "inside_radius": 2}}
    assert told(brake, {"bends": {"count": 9}}).bends == Bends(
        "press-brake", count=9, inside_radius=2
    )
    assert told(brake, {"bends": {"mode": "rolled"}}).bends == Bends("rolled", inside_radius=2)
    rolled = {"bends": {"mode": "rolled"}}
    assert told(rolled, {"bends": {"chord": 0.2}}).bends == Bends("press-brake", chord=0.2)
    assert told(brake, {"bends": {"inside_radius": 0}}).bends == Bends("press-brake", chord=0.2)
    assert told(brake, {"bends": {"springback": True}}).bends.springback


@pytest.mark.parametrize(
    "keys",
    [
        {"chord": 0},
        {"angle": 180},
        {"angle": 0},
        {"length": -1},
        {"count": 0},
        {"count": 2.0},
        {"inside_radius": -1},
        {"mode": "bump"},
        {"mode": "rolled", "angle": 2},
        {"chord": 0.1, "angle": 2},
        {"springback": 1},
    ],
)
def test_what_no_brake_can_do_is_refused(keys: dict[str, Any]) -> None:
    refusal(bends=keys)


# --- stitches, notches, sheets, pages, limits, labels --------------------------------------


@pytest.mark.parametrize(("spi", "pitch"), [(5, 5.08), (7, 3.63), (8, 3.18)])
def test_stitches_per_inch_are_a_pitch(spi: int, pitch: float) -> None:
    """The table of a leather worker's handbook, two digits."""
    stitch = shop(stitch={"spi": spi}).stitch
    assert stitch is not None
    assert stitch.pitch == pytest.approx(pitch, abs=6e-3)


def test_pitch_and_spi_replace_each_other() -> None:
    base = {"stitch": {"spi": 8, "inset": 3, "hole": "slit", "diameter": 2}}
    assert told(base, {"stitch": {"pitch": 4}}).stitch == Stitch(4.0, 3.0, "slit", 2.0)
    again = told({"stitch": {"pitch": 4}}, {"stitch": {"spi": 8}}).stitch
    assert again is not None
    assert again.pitch == 3.175  # 25.4 / 8, exact in binary too
    assert "pitch and spi" in refusal(stitch={"pitch": 4, "spi": 8})


def test_a_table_without_keys_asks_for_the_usual() -> None:
    made = told({"stitch": {}, "notches": {}, "labels": {}})
    assert (made.stitch, made.notches, made.labels) == (Stitch(), Notches(), Labels())
    assert told({"labels": {"height": 8}}, {"labels": {"on": False}}).labels is None
    off_and_on = told({"labels": {"on": False, "height": 8}}, {"labels": {"on": True}})
    assert off_and_on.labels == Labels(8.0)


def test_every_key_arrives() -> None:
    made = told(
        {
            "notches": {"every": 5, "shape": "T", "depth": 2.5},
            "sheet": {"size": [1250, 2500], "gap": 3, "kerf": -0.2},
            "limits": {
                "min_flange": 4,
                "hole_to_bend": 2,
                "hole_to_thickness": 1,
                "bend_ratio": 1.5,
                "strain": 0.15,
            },
        }
    )
    assert made.notches == Notches(5, "T", 2.5)
    assert made.sheet == Sheet((1250.0, 2500.0), 3.0, -0.2)
    assert made.limits == Limits(4.0, 2.0, 1.0, 1.5, 0.15)


@pytest.mark.parametrize(
    ("paper", "size"),
    [
        ("A4", (210.0, 297.0)),
        ("a3", (297.0, 420.0)),
        ("letter", (215.9, 279.4)),
        ("one", None),
        ([914, 1200], (914.0, 1200.0)),
    ],
)
def test_papers_have_their_standard_sizes(
    paper: str | list[float], size: tuple[float, float] | None
) -> None:
    """ISO 216 and ANSI Y14.1."""
    made = recipe(pdf={"paper": paper, "overlap": 15})
    assert made.options.pdf == made.shop.pdf
    assert made.shop.pdf.overlap == 15.0
    assert made.shop.pdf.size == (None if size is None else pytest.approx(size, abs=1e-12))


def test_a_paper_of_ones_own_replaces_the_named_one() -> None:
    both = told({"pdf": {"paper": "A3"}}, {"pdf": {"paper": [300, 400]}})
    assert both.pdf == Pdf("", (300.0, 400.0), 10.0)
    assert told({"pdf": {"paper": [300, 400]}}, {"pdf": {"paper": "one"}}).pdf == Pdf("one", None)


@pytest.mark.parametrize(
    "tables",
    [
        {"pdf": {"paper": "A9"}},
        {"pdf": {"paper": [50, 300]}},
        {"pdf": {"paper": [300]}},
        {"pdf": {"overlap": 50}},
        {"sheet": {"size": [100]}},
        {"sheet": {"size": [100, 0]}},
        {"sheet": {"gap": -1}},
        {"sheet": {"kerf": math.inf}},
        {"stitch": {"hole": "square"}},
        {"stitch": {"pitch": 0}},
        {"notches": {"shape": "v"}},
        {"notches": {"every": 0}},
        {"limits": {"strain": 15}},
        {"limits": {"min_flange": -1}},
        {"labels": {"height": 0}},
        {"dxf": {"profile": "autocad"}},
        {"glb": {"animate": 1}},
    ],
)
def test_what_no_shop_has_is_refused(tables: dict[str, Any]) -> None:
    refusal(**tables)


# --- the job -------------------------------------------------------------------------------


def test_recipe_lengths_are_mm_whatever_the_job_speaks(tmp_path: Path) -> None:
    job = lamp(tmp_path, "[recipe.bends]\nchord = 0.3\n[recipe.neutral]\nk = 0.4", units="in")
    made = pipeline.plan(job, pipeline="sheet-metal")
    assert made.shop.bends.chord == 0.3
    assert made.shop.neutral == Neutral("k", k=0.4, words="k")


def test_edges_are_in_the_units_of_the_job(tmp_path: Path) -> None:
    more = """
[edges.top]
allowance = 0.5
finish = "turned"
corner = "round"
[edges.start]
finish = "tab"
[edges.end]
"""
    (panel,) = lamp(tmp_path, more, units="in").panels
    assert panel.edges == {
        "top": EdgeFinish(12.7, "turned", "round"),
        "start": EdgeFinish(8.0, "tab", "mitre"),
        "end": EdgeFinish(0.0, "raw", "mitre"),
    }
    assert set(panel.edges) <= set(EDGES)


def test_a_job_of_panels_has_edges_for_each(tmp_path: Path) -> None:
    path = tmp_path / "job.toml"
    sheet = '[panel.surface]\nkind = "plane"\nwidth = 30\nheight = 20\n'
    path.write_text(
        f'name = "bag"\n[[panel]]\nname = "front"\n{sheet}[panel.edges.base]\nallowance = 10\n'
        f'[[panel]]\nname = "back"\n{sheet}'
    )
    front, back = load(path).panels
    assert front.edges == {"base": EdgeFinish(10.0, "raw", "mitre")}
    assert back.edges == {}


def test_a_job_travels_to_other_processes(tmp_path: Path) -> None:
    """Batches send recipes and finishes to their workers."""
    (panel,) = lamp(tmp_path, "[edges.top]\nallowance = 3").panels
    assert pickle.loads(pickle.dumps(dict(panel.edges))) == panel.edges
    made = recipe(bends={"chord": 0.1}, labels={})
    assert pickle.loads(pickle.dumps(made)) == made


@pytest.mark.parametrize("edge", ["Top", "left", "topp"])
def test_there_are_four_edges(edge: str, tmp_path: Path) -> None:
    with pytest.raises(JobError) as failure:
        lamp(tmp_path, f"[edges.{edge}]\nallowance = 3")
    assert failure.value.code == 2
    assert "base" in f"{failure.value.limit}"


# --- the schema ----------------------------------------------------------------------------


def tables_of(schema: dict[str, Any], name: str) -> dict[str, Any]:
    found: dict[str, Any] = schema["$defs"][name]
    return found


def test_the_schema_tells_the_shop() -> None:
    schema = job_schema()
    assert json.dumps(schema)
    words = tables_of(schema, "RecipeTable")["properties"]
    assert set(SHOP) <= set(words)
    assert set(tables_of(schema, "EdgesTable")["properties"]) == set(EDGES)
    for where in ("JobTable", "PanelTable"):
        keys = schema["properties"] if where == "JobTable" else tables_of(schema, where)
        assert "edges" in (keys if where == "JobTable" else keys["properties"])
    for model in SHOP.values():
        table = tables_of(schema, model.__name__)
        assert table["description"]
        assert table["additionalProperties"] is False
    profiles = tables_of(schema, "DxfTable")["properties"]["profile"]["anyOf"][0]["enum"]
    assert profiles == ["generic", "inventor", "sendcutsend", "lightburn", "astm"]
