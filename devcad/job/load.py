"""A job file to a frozen Job: every length in mm, every angle in radians, all paths checked."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from pydantic import BaseModel, ValidationError

from devcad.errors import DevcadError, JobError
from devcad.features import Features, Seam
from devcad.geometry.constructions import SURFACES
from devcad.geometry.constructions.base import Surface
from devcad.geometry.taylor import Array
from devcad.importers.files import decode, inside, read_bytes
from devcad.importers.table import parse_points
from devcad.importers.toml import parse_toml
from devcad.job.changes import Change, put, told
from devcad.job.invalid import below, problems, raise_all, shown, unknown_kind
from devcad.job.recipe import RecipeTable
from devcad.job.tables import EdgesTable, JobTable, MetaTable, PanelTable, PlaceTable
from devcad.shop.settings import ALLOWANCES, EDGES, EdgeFinish, EdgeName
from devcad.units import MM_PER_UNIT

if TYPE_CHECKING:  # few jobs are simulated
    from devcad.simulate.settings import Simulation

MAX_JOB_BYTES = 256_000
MAX_POINTS_BYTES = 4_000_000  # 100 000 points with 12 digits each
DEFAULT_TOLERANCE = 0.05  # mm
SMALLEST_TOLERANCE = 1e-6  # mm; finer than any workshop or CAD system
PARALLEL = 1e-9  # sine of the angle below which two directions are one
LARGEST = 1e12  # in any unit; cubes of it times 1e9 still are finite and exact enough

M = TypeVar("M", bound=BaseModel)


@dataclass(frozen=True, slots=True)
class Meta:
    """What the drawing and the cut list say; ``grain`` in radians from +x in the pattern."""

    part_number: str = ""
    revision: str = ""
    description: str = ""
    quantity: int = 1
    grain: float | None = None
    finish: str | None = None


@dataclass(frozen=True, slots=True)
class JobPanel:
    """A surface of the job, still in the job's units, with its name and its place (4, 4) in mm.

    ``edges`` holds the finishes of the edges that the job names.
    """

    name: str
    kind: str
    surface: Surface
    place: Array | None
    features: Features
    edges: Mapping[EdgeName, EdgeFinish] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Job:
    """A job file, checked. Lengths are mm; only the surfaces wait for ``mm_per_unit``.

    ``single`` says that it has [surface] and not [[panel]]. ``path`` is as the user gave it.
    ``sha256`` is that of the job file's bytes, of what a list changes in it, and of the files it
    names, in their order, drawings last and each once. ``pipeline`` None leaves the choice to
    the caller.
    """

    name: str
    path: str
    sha256: str
    mm_per_unit: float
    tolerance: float
    thickness: float
    reference: str
    material: str | None
    pipeline: str | None
    bend: float
    meta: Meta
    recipe: RecipeTable
    single: bool
    panels: tuple[JobPanel, ...]
    seams: tuple[Seam, ...] = ()
    simulate: Simulation | None = None


def load(
    path: str | Path, changes: Sequence[Change] = (), *, folder: str | Path | None = None
) -> Job:
    """Read and check a job file, with other values for some of its keys.

    The files that it names lie in ``folder``, the job file's own where there is none given.

    Raises:
        JobError: syntax, an unknown or missing key, a value outside its domain, a file outside
        the job's folder; LimitError: too large or too deep; FileError: missing, unreadable, not
        UTF-8. Several problems come as one InvalidJob.
    """
    tree, digest = read_tree(path, changes, folder=folder)
    return job_of(tree, str(path), digest)


def read_tree(
    path: str | Path, changes: Sequence[Change] = (), *, folder: str | Path | None = None
) -> tuple[dict[str, Any], str]:
    """The tables of a job file, what the files that it names say in them; and its ``sha256``,
    to which ``changes`` count.

    Raises:
        JobError, LimitError, FileError: as ``load``, where the file is no job file at all.
    """
    place = str(path)
    data = read_bytes(Path(path), limit=MAX_JOB_BYTES, place=place)
    tree = parse_toml(decode(data, place=place), place=place)
    put(tree, changes, place)
    digest = hashlib.sha256(data + told(changes))
    home = Path(path).parent if folder is None else Path(folder)
    drawings: dict[str, bytes] = {}
    for table, where in _file_tables(tree, place):
        digest.update(_inline_points(table, home, where))
    for table, where in _drawing_tables(tree, place):
        digest.update(_drawing(table, home, where, drawings))
    _refuse_too_large(tree, place)
    return tree, digest.hexdigest()


def _file_tables(node: Any, place: str) -> Iterator[tuple[dict[str, Any], str]]:
    """The tables of kind points that name a file, with their places, in the file's order."""
    if isinstance(node, dict):
        if node.get("kind") == "points" and isinstance(node.get("file"), str):
            yield node, place
        for key, value in node.items():
            yield from _file_tables(value, below(place, key))
    elif isinstance(node, list):
        for k, value in enumerate(node):
            if isinstance(value, dict | list):
                yield from _file_tables(value, f"{place}[{k}]")


def _inline_points(table: dict[str, Any], folder: Path, place: str) -> bytes:
    """Replace the key ``file`` by the points in it; returns the file's bytes."""
    if "points" in table:
        raise JobError(
            "there are both points and file",
            place=place,
            value="file",
            limit="one of the two",
            remedy="remove one of them",
        )
    name = table["file"]
    path = inside(folder, name, place=f"{place}.file")
    where = f"{place}.file > {name}"
    data = read_bytes(path, limit=MAX_POINTS_BYTES, place=where)
    table["points"] = parse_points(decode(data, place=where), place=where)
    del table["file"]
    return data


def _drawing_tables(tree: dict[str, Any], place: str) -> Iterator[tuple[dict[str, Any], str]]:
    """The cutouts that name a drawing, with their places, in the file's order."""
    panels = tree.get("panel")
    owners = [(tree, place)]
    for k, panel in enumerate(panels if isinstance(panels, list) else ()):
        if isinstance(panel, dict):
            owners.append((panel, f"{place} > panel {panel.get('name', k)}"))
    for owner, where in owners:
        rows = owner.get("cutout")
        for k, row in enumerate(rows if isinstance(rows, list) else (), start=1):
            drawn = isinstance(row, dict) and row.get("shape") == "dxf"
            if drawn and isinstance(row.get("file"), str):
                yield row, f"{where} > cutout {k}"


def _drawing(table: dict[str, Any], folder: Path, place: str, read: dict[str, bytes]) -> bytes:
    """Put the bytes of a drawing beside its name; returns them where they are not ``read`` yet."""
    from devcad.job.featuretables import DrawingFile

    name = table["file"]
    known = name in read
    if not known:
        from devcad.importers.dxf import MAX_BYTES

        path = inside(folder, name, place=below(place, "file"))
        where = f"{below(place, 'file')} > {name}"
        read[name] = read_bytes(path, limit=MAX_BYTES, place=where)
    table["file"] = DrawingFile(name, read[name])
    return b"" if known else read[name]


def job_of(tree: dict[str, Any], place: str, sha256: str) -> Job:
    """The Job of a tree that ``read_tree`` gave; all its problems at once."""
    table, found = validated(JobTable, tree, place, {})
    scale = MM_PER_UNIT.get(str(tree.get("units", "mm")), 1.0)
    surfaces: list[tuple[str, Surface]] = []
    for inner, where in _surface_tables(tree, place):
        surface, wrong = _surface(inner, where, scale)
        found += wrong
        surfaces += [(inner["kind"], surface)] if surface is not None else []
    simulate = None
    if isinstance(tree.get("simulate"), dict):
        from devcad.job.simulation import read_simulation

        simulate, wrong = read_simulation(tree["simulate"], place, scale)
        found += wrong
    raise_all(sorted(found, key=lambda error: -error.code))  # a limit tells more than a typo
    assert table is not None  # raise_all spoke otherwise
    names = [panel.name for panel in table.panel or ()] or [table.name]
    places = [panel.place for panel in table.panel or ()] or [table.place]
    features, seams = _features(table, scale, place)
    finishes = [_finishes(owner.edges, scale) for owner, _ in _owners(table, place)]
    return Job(
        name=table.name,
        path=place,
        sha256=sha256,
        mm_per_unit=scale,
        tolerance=_tolerance(table.tolerance, scale, place),
        thickness=table.thickness * scale,
        reference=table.reference,
        material=table.material,
        pipeline=table.pipeline,
        bend=table.bend,
        meta=_meta(table.meta),
        recipe=table.recipe,
        single=table.surface is not None,
        panels=tuple(
            JobPanel(name, kind, surface, _matrix(where, scale, place), own, edges)
            for name, (kind, surface), where, own, edges in zip(
                names, surfaces, places, features, finishes, strict=True
            )
        ),
        seams=seams,
        simulate=simulate,
    )


def _features(table: JobTable, scale: float, place: str) -> tuple[list[Features], tuple[Seam, ...]]:
    """The features of every panel, and the seams; all their problems at once."""
    owners = list(_owners(table, place))
    if not table.seam and not any(o.cutout or o.mark or o.trim for o, _ in owners):
        return [Features()] * len(owners), ()
    from devcad.job.features import Reading  # most jobs need none of its tables

    reading = Reading(scale)
    features = [reading.features(o.cutout, o.mark, o.trim, where) for o, where in owners]
    seams = reading.seams(table.seam, place)
    raise_all(sorted(reading.found, key=lambda error: -error.code))
    return features, seams


def _owners(table: JobTable, place: str) -> Iterator[tuple[JobTable | PanelTable, str]]:
    """The tables that features may stand in, one for each panel, with their places."""
    if table.panel is None:
        yield table, place
    for panel in table.panel or ():
        yield panel, f"{place} > panel {panel.name}"


def _finishes(table: EdgesTable | None, scale: float) -> dict[EdgeName, EdgeFinish]:
    """The finishes of the edges that a table names, in mm."""
    given = {name: getattr(table, name) for name in EDGES if table is not None}
    return {
        name: EdgeFinish(
            ALLOWANCES[edge.finish] if edge.allowance is None else edge.allowance * scale,
            edge.finish,
            edge.corner,
        )
        for name, edge in given.items()
        if edge is not None
    }


def _tolerance(value: float | None, scale: float, place: str) -> float:
    """The tolerance in mm."""
    if value is None:
        return DEFAULT_TOLERANCE
    if value * scale < SMALLEST_TOLERANCE:
        raise JobError(
            f"must be at least {SMALLEST_TOLERANCE:g} mm, is {value * scale:g} mm",
            place=f"{place} > tolerance",
            value=value * scale,
            limit=SMALLEST_TOLERANCE,
            remedy="no workshop and no CAD system is finer",
        )
    return value * scale


def _meta(table: MetaTable) -> Meta:
    """The same, in radians."""
    keys = table.model_dump()
    if table.grain is not None:
        keys["grain"] = math.radians(table.grain)
    return Meta(**keys)


def _refuse_too_large(tree: dict[str, Any], place: str) -> None:
    """JobError for each finite number that no part has."""
    remedy = "give a smaller number, in larger units"
    found = []
    for path, value in _too_large(tree):
        what = f"{shown(value)} is larger than any part: at most {LARGEST:g}"
        found.append(JobError(what, below(place, path), "", shown(value), LARGEST, remedy))
    raise_all(found)


def _too_large(node: Any) -> Iterator[tuple[str, int | float]]:
    """The finite numbers beyond ``LARGEST`` with their paths."""
    named = isinstance(node, dict)
    for key, value in node.items() if named else enumerate(node):
        if isinstance(value, dict | list):
            for path, number in _too_large(value):
                separator = "" if path.startswith("[") else "."
                yield f"{key if named else f'[{key}]'}{separator}{path}", number
        elif type(value) in (int, float) and LARGEST < abs(value) < math.inf:
            yield str(key) if named else f"[{key}]", value


def _surface_tables(tree: dict[str, Any], place: str) -> Iterator[tuple[Any, str]]:
    """Table and place of every surface that the tree has where one belongs."""
    if isinstance(tree.get("surface"), dict):
        yield tree["surface"], f"{place} > surface"
    panels = tree.get("panel")
    for k, panel in enumerate(panels if isinstance(panels, list) else ()):
        if isinstance(panel, dict) and isinstance(panel.get("surface"), dict):
            yield panel["surface"], f"{place} > panel {panel.get('name', k)} > surface"


def _surface(
    tree: dict[str, Any], place: str, scale: float
) -> tuple[Surface | None, list[DevcadError]]:
    """The model of a surface, chosen by its kind, or its problems."""
    kind = tree.get("kind")
    if kind is None:
        error = JobError(
            "the key is missing",
            place=f"{place}.kind",
            value="",
            limit=", ".join(sorted(SURFACES)),
            remedy='add kind = "..."; devcad list surfaces names them',
        )
        return None, [error]
    if not isinstance(kind, str) or kind not in SURFACES:
        return None, [unknown_kind(str(kind), SURFACES, place=f"{place}.kind")]
    return validated(SURFACES[kind], tree, place, {"mm_per_unit": scale})


def validated(
    model: type[M], tree: Mapping[str, Any], place: str, context: dict[str, Any]
) -> tuple[M | None, list[DevcadError]]:
    """The model of a table at a place of the file, or its problems."""
    try:
        return model.model_validate(tree, context=context), []
    except ValidationError as error:
        return None, problems(error, tree, model, place=place)


def _matrix(table: PlaceTable | None, scale: float, place: str) -> Array | None:
    """The rigid motion (4, 4) in mm of a place: columns are the images of x, y, z and 0."""
    if table is None:
        return None
    z = np.array(table.z_axis) / np.linalg.norm(table.z_axis)
    wanted = table.x_axis if table.x_axis is not None else (1.0, 0.0, 0.0)
    x = _across(np.array(wanted), z)
    if x is None and table.x_axis is None:
        x = _across(np.array([0.0, 1.0, 0.0]), z)
    if x is None:
        raise JobError(
            "x_axis runs along z_axis",
            place=f"{place} > place.x_axis",
            value=0.0,
            limit=PARALLEL,
            remedy="give a direction across z_axis",
        )
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    matrix[:3, 3] = scale * np.array(table.origin)
    return matrix


def _across(direction: Array, axis: Array) -> Array | None:
    """The unit part of a direction across a unit axis, None where there is none."""
    direction = direction / np.linalg.norm(direction)
    rest = direction - (direction @ axis) * axis
    length = float(np.linalg.norm(rest))
    return None if length <= PARALLEL else rest / length
