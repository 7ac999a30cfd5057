"""The curves of a file that ``devcad analyze`` reads: a job, or one with [curve]."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel

from devcad.errors import DevcadError, GeometryError, JobError
from devcad.geometry.curve import COINCIDENT, Curve, ends_meet, samples, size
from devcad.geometry.curves import CurveModel, CurveSpec, Model
from devcad.geometry.patch import Patch
from devcad.geometry.taylor import Array
from devcad.job.invalid import raise_all
from devcad.job.load import Job, JobPanel, job_of, read_tree, validated
from devcad.job.tables import NAME, Name
from devcad.units import MM_PER_UNIT

BASE = "base curve"


class CurveTable(Model):
    """A file of one curve."""

    name: Name | None = None
    units: Literal["mm", "cm", "m", "in"] = "mm"
    curve: CurveSpec


@dataclass(frozen=True, slots=True)
class NamedCurve:
    """A curve in mm, the key it stands at, and its table; None where it is a base curve c0."""

    name: str
    curve: Curve
    spec: CurveModel | None


@dataclass(frozen=True, slots=True)
class CurveFile:
    """The curves of a file, at least one; ``name`` is the job's, or made of the file's."""

    name: str
    path: str
    curves: tuple[NamedCurve, ...]


def load_curves(path: str | Path) -> CurveFile:
    """The curve of a file with [curve], or those of a job: every key of its surfaces that holds
    curves, in order; the base curve of the first surface where there is none.

    Curves stand where their own coordinates say: ``place`` moves the finished surface only.

    Raises:
        JobError, LimitError, FileError: as ``devcad.job.load.load``; GeometryError: the curve or
        the surface does not exist, or its base curve is a point.
    """
    place = str(path)
    tree, digest = read_tree(path)
    if "surface" in tree or "panel" in tree:
        job = job_of(tree, place, digest)
        return CurveFile(job.name, place, tuple(_of_job(job)))
    if "curve" not in tree:
        raise JobError(
            "there is neither [curve] nor a job's [surface] or [[panel]]",
            place=place,
            value="",
            limit="one of them",
            remedy='write [curve] with kind = "..."; devcad list curves names the kinds',
        )
    table, found = validated(CurveTable, tree, place, {"mm_per_unit": _scale(tree)})
    raise_all(found)
    assert table is not None  # raise_all spoke otherwise
    named = _named("curve", table.curve, MM_PER_UNIT[table.units], f"{place} > curve")
    return CurveFile(table.name or _from_file(Path(path)), place, (named,))


def _scale(tree: dict[str, Any]) -> float:
    """mm in the unit of a file that was not checked."""
    return MM_PER_UNIT.get(str(tree.get("units", "mm")), 1.0)


def _from_file(path: Path) -> str:
    """The file's own name as one that every file system takes."""
    name = re.sub(r"[^A-Za-z0-9._-]+", "-", path.stem).strip(".-_")[:64].rstrip(".")
    return name if NAME.fullmatch(name) else "curve"


def _of_job(job: Job) -> list[NamedCurve]:
    """The curves of a job's surfaces, or the base curve of the first."""
    found = []
    for panel in job.panels:
        where = "surface" if job.single else f"panel {panel.name} > surface"
        for key, spec in _specs(panel.surface):
            name = f"{where}{key}"
            found.append(_named(name, spec, job.mm_per_unit, f"{job.path} > {name}"))
    return found or [_base_curve(job, job.panels[0])]


def _specs(model: BaseModel, path: str = "") -> Iterator[tuple[str, CurveModel]]:
    """The curves among a table's keys, in its order, those of inner tables too."""
    for name, field in type(model).model_fields.items():
        yield from _in_value(getattr(model, name), f"{path}.{field.alias or name}")


def _in_value(value: Any, path: str) -> Iterator[tuple[str, CurveModel]]:
    if isinstance(value, CurveModel):
        yield path, value
    elif isinstance(value, BaseModel):
        yield from _specs(value, path)
    elif isinstance(value, tuple):
        for k, each in enumerate(value):
            yield from _in_value(each, f"{path}[{k}]")


def _named(name: str, spec: CurveModel, scale: float, place: str) -> NamedCurve:
    try:
        return NamedCurve(name, _scaled(spec.curve(), scale), spec)
    except DevcadError as error:
        raise error.at(place=place) from None


def _base_curve(job: Job, panel: JobPanel) -> NamedCurve:
    """c0 of the first patch of a surface, which must not be a point."""
    where = "surface" if job.single else f"panel {panel.name} > surface"
    try:
        patch = panel.surface.build().panels[0].patches[0]
    except DevcadError as error:
        raise error.at(place=f"{job.path} > {where}") from None
    curve = _base(patch)
    if size(curve.point(samples(curve))) <= COINCIDENT * _extent(patch):
        raise GeometryError(
            f"a {panel.kind} of these keys has no curve: all its rulings start at one point",
            place=f"{job.path} > {where}",
            remedy="give the curve in a file of its own, as [curve]",
        )
    return NamedCurve(f"{where}: {BASE}", _scaled(curve, job.mm_per_unit), None)


def _base(patch: Patch) -> Curve:
    """c0 as a curve."""

    def jet(t: Array, order: int) -> Array:
        return patch.field(t, order).c0

    curve = Curve(jet, patch.domain, patch.breaks)
    return replace(curve, closed=ends_meet(curve))


def _extent(patch: Patch) -> float:
    """How far the patch's rulings reach, from samples."""
    jet = patch.jet(samples(_base(patch)), 0)
    return float(abs(jet.v_to[0] - jet.v_from[0]).max())


def _scaled(curve: Curve, factor: float) -> Curve:
    """The curve in mm."""
    if factor == 1.0:
        return curve

    def jet(t: Array, order: int) -> Array:
        return factor * curve.jet(t, order)

    return replace(curve, jet=jet)
