"""What this version knows: kinds, formats, recipes and materials, with a line on each."""

from __future__ import annotations

from collections.abc import Callable

from devcad.export import FORMATS
from devcad.geometry.constructions import SURFACES
from devcad.geometry.curves import CurveSpec
from devcad.job.invalid import kind_of, models_in
from devcad.job.recipe import recipe_names
from devcad.shop.materials import load

Rows = dict[str, str]


def _first_line(model: type[object]) -> str:
    """The first line of a model's docstring."""
    return (model.__doc__ or "").strip().split("\n")[0].replace("``", "")


def _surfaces() -> Rows:
    return {kind: _first_line(model) for kind, model in SURFACES.items()}


def _curves() -> Rows:
    return {kind_of(model) or "": _first_line(model) for model in models_in(CurveSpec)}


def _formats() -> Rows:
    return {name: text for name, (_, text) in FORMATS.items()}


def _materials() -> Rows:
    return {name: material.title for name, material in load().items()}


LISTS: dict[str, Callable[[], Rows]] = {
    "surfaces": _surfaces,
    "curves": _curves,
    "formats": _formats,
    "pipelines": recipe_names,
    "materials": _materials,
}
"""Each list of ``devcad list`` by its name."""
