"""Recipes: how a part is written. Data in ``pipelines/*.toml``, overridden by jobs and by hand.

A recipe's lengths are millimetres. Precedence, key by key: command line, job, recipe, material,
default; keys of one choice replace each other as a whole.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationError

from devcad.checks import NAMES
from devcad.errors import JobError
from devcad.export import DEFAULT_FORMATS, FORMATS, Options
from devcad.importers.files import decode, read_bytes
from devcad.importers.toml import parse_toml
from devcad.job.invalid import did_you_mean, problems, raise_all
from devcad.job.shopsettings import settings
from devcad.job.shoptables import (
    SHOP,
    BendsTable,
    GlbTable,
    LabelsTable,
    LimitsTable,
    NeutralTable,
    NotchesTable,
    PdfTable,
    SheetTable,
    StitchTable,
    Table,
)
from devcad.shop.settings import Profile, ShopSettings

DEFAULT = "cad"
MAX_BYTES = 256_000


def known_formats(names: list[str]) -> list[str]:
    """The names, each once and in the order given; JobError where one is no format."""
    return _known(names, FORMATS, "format")


def known_checks(names: list[str]) -> list[str]:
    """The names, each once and in the order given; JobError where one is no check."""
    return _known(names, NAMES, "check")


def _known(names: list[str], known: Iterable[str], noun: str) -> list[str]:
    for name in names:
        if name not in known:
            raise JobError(
                f'this version knows no {noun} "{name[:60]}"',
                value=name[:60],
                limit=", ".join(dict.fromkeys(known)),
                remedy=did_you_mean(name, known),
            )
    return list(dict.fromkeys(names))


class StepTable(Table):
    """How STEP files are written; ``tolerance`` in mm."""

    tolerance: Annotated[float, Field(gt=0.0)] | None = None
    degree: Literal[3, 5] | None = None
    schema_: Literal["AP214", "AP242"] | None = Field(None, alias="schema")


class DxfTable(Table):
    """How cut patterns are written."""

    version: Literal["R12", "R2000", "R2010"] | None = None
    profile: Profile | None = Field(None, description="whose layer names and colours")
    curves: Literal["arcs", "polyline", "spline"] | None = None
    bend_ticks: Annotated[float, Field(ge=0.0)] | None = Field(
        None, description="mm at both ends of a bend line instead of the whole line; 0: whole"
    )
    together: bool | None = Field(None, description="whether one more has all panels of a part")


class RecipeTable(Table):
    """The keys of a recipe; a key that is absent leaves the next source its say."""

    formats: Annotated[list[str], Field(min_length=1), AfterValidator(known_formats)] | None = None
    step: StepTable = StepTable()
    dxf: DxfTable = DxfTable()
    glb: GlbTable = GlbTable()
    neutral: NeutralTable | None = None
    bends: BendsTable | None = None
    stitch: StitchTable | None = None
    notches: NotchesTable | None = None
    sheet: SheetTable | None = None
    pdf: PdfTable | None = None
    limits: LimitsTable | None = None
    labels: LabelsTable | None = None
    allow: Annotated[list[str], AfterValidator(known_checks)] | None = None


@dataclass(frozen=True, slots=True)
class Recipe:
    """What an export does: the formats in order, the exporters' options in mm, the checks that
    may fail, and what the shop does with the pattern."""

    formats: tuple[str, ...]
    options: Options
    allow: frozenset[str]
    shop: ShopSettings = field(default_factory=ShopSettings)


def resolve(
    name: str | None,
    override: RecipeTable,
    *,
    formats: Iterable[str] = (),
    allow: Iterable[str] = (),
) -> Recipe:
    """The recipe ``name`` (default cad) with the job's override and the caller's words on top.

    ``formats`` replace the recipe's, ``allow`` is added to it.

    Raises:
        JobError: no such recipe, format or check, or a recipe file that is wrong.
    """
    sources = [_read(name or DEFAULT), override]
    shop = settings([_told(source, set(SHOP)) for source in sources])
    keys = {key: value for source in sources for key, value in _flat(source).items()}
    chosen = known_formats(list(formats)) or _with_bends(keys.get("formats", DEFAULT_FORMATS), shop)
    keys.pop("formats", None)
    allowed = {*known_checks(list(allow)), *keys.pop("allow", ())}
    options = replace(Options(**keys), pdf=shop.pdf, kerf=shop.sheet.kerf)
    return Recipe(tuple(chosen), options, frozenset(allowed), shop)


def _with_bends(formats: Iterable[str], shop: ShopSettings) -> list[str]:
    """The formats of a recipe, with the bend table beside the DXF of a part for the press brake."""
    pressed = shop.bends.mode == "press-brake" and "dxf" in formats
    return list(dict.fromkeys([*formats, *(["bends"] if pressed else [])]))


def recipe_names() -> dict[str, str]:
    """The recipes there are, with the first sentence of each file."""
    files = sorted(path for path in _folder().iterdir() if path.suffix == ".toml")
    return {path.stem: _first_sentence(path) for path in files}


def _read(name: str) -> RecipeTable:
    """The keys of a recipe file."""
    folder = _folder()
    names = [path.stem for path in folder.iterdir() if path.suffix == ".toml"]
    if name not in names:
        raise JobError(
            f'there is no pipeline "{name[:60]}"',
            value=name[:60],
            limit=", ".join(sorted(names)),
            remedy=did_you_mean(name, names),
        )
    place = f"{name}.toml"
    data = read_bytes(folder / place, limit=MAX_BYTES, place=place)
    tree = parse_toml(decode(data, place=place), place=place)
    try:
        return RecipeTable.model_validate(tree)
    except ValidationError as error:
        raise_all(problems(error, tree, RecipeTable, place=place))
        raise


def _folder() -> Path:
    """Where the recipes lie: in the wheel inside the package, in a checkout beside it."""
    package = Path(str(resources.files("devcad")))
    inside = package / "_recipes"
    return inside if inside.is_dir() else package.parent / "pipelines"


def _told(table: RecipeTable, names: set[str]) -> dict[str, Any]:
    """The keys that are given, of these tables; a table without any is there and empty."""
    return table.model_dump(exclude_none=True, by_alias=True, include=names)


def _flat(table: RecipeTable) -> dict[str, Any]:
    """The keys that are given, as the exporters' options name them."""
    keys = _told(table, {"formats", "step", "dxf", "glb", "allow"})
    step, dxf, glb = keys.pop("step"), keys.pop("dxf"), keys.pop("glb")
    return {
        **keys,
        **{f"step_{key}": value for key, value in step.items()},
        **{f"dxf_{key}": value for key, value in dxf.items()},
        **{f"glb_{key}": value for key, value in glb.items()},
    }


def _first_sentence(path: Path) -> str:
    """The comment that opens a recipe file, to its first full stop."""
    lines = path.read_text(encoding="utf-8").splitlines()
    comment = " ".join(line.lstrip("# ") for line in lines[: _first_key(lines)])
    return comment.split(". ")[0].strip(" .")


def _first_key(lines: list[str]) -> int:
    """The number of comment lines at the top."""
    return next((k for k, line in enumerate(lines) if not line.startswith("#")), len(lines))
