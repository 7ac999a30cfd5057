"""The material library: data in materials.toml, read when a material is asked for."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Any

from devcad.errors import JobError

MPA_PER_GPA = 1e3
G_PER_MM3 = 1e-6  # of 1 kg/m3


@dataclass(frozen=True, slots=True)
class Material:
    """What a sheet is made of, in mm, N and g.

    ``youngs_modulus`` and ``yield_strength`` in MPa (the latter is the strength in bending or
    the ultimate one where there is no yield; ``note`` says so), ``poisson`` or None, ``density``
    in g/mm3, ``k_neutral`` the place of the neutral fibre over the thickness, 0 to 0.5,
    ``bend_ratio`` the smallest inside radius over the thickness. ``colour`` is sRGB, 0 to 1.
    ``names`` are other names of it, ``note`` tells which end of a range was taken. ``verified``
    is False where a number has no source: it is then no ground for a claim.
    """

    id: str
    title: str
    names: tuple[str, ...]
    temper: str
    youngs_modulus: float
    yield_strength: float
    poisson: float | None
    density: float
    k_neutral: float
    bend_ratio: float
    colour: tuple[float, float, float]
    source: str
    verified: bool
    note: str

    def smallest_bend(self, thickness: float) -> float:
        """The smallest inside radius in mm of a sheet."""
        return self.bend_ratio * thickness

    @property
    def doubt(self) -> str:
        """What a report adds where a number has no source: "" or words that say so."""
        return "" if self.verified else f"{self.id}: not verified ({self.source}; {self.note})"

    def mass(self, area: float, thickness: float) -> float:
        """The mass in g of a sheet of ``area`` mm2 and ``thickness`` mm."""
        return self.density * area * thickness


@cache
def load() -> Mapping[str, Material]:
    """The library: each material by its id, in the file's order, read only."""
    text = resources.files("devcad.shop").joinpath("materials.toml").read_text("utf-8")
    return MappingProxyType({key: _material(key, row) for key, row in tomllib.loads(text).items()})


def _material(key: str, row: dict[str, Any]) -> Material:
    """A row of the file in mm, N and g."""
    return Material(
        id=key,
        title=row["title"],
        names=tuple(row["names"]),
        temper=row["temper"],
        youngs_modulus=row["E_gpa"] * MPA_PER_GPA,
        yield_strength=float(row["yield_mpa"]),
        poisson=row.get("nu"),
        density=row["density"] * G_PER_MM3,
        k_neutral=row["k"],
        bend_ratio=row["bend_ratio"],
        colour=_colour(row["colour"]),
        source=row["source"],
        verified=row["verified"],
        note=row["note"],
    )


def _colour(text: str) -> tuple[float, float, float]:
    """A colour such as "#a5703f" as red, green and blue from 0 to 1."""
    red, green, blue = (byte / 255.0 for byte in bytes.fromhex(text.removeprefix("#")))
    return red, green, blue


def material(name: str) -> Material:
    """The material of an id, case ignored.

    Raises:
        JobError: the library has no such material; the limit lists those it has.
    """
    found = load().get(name.lower())
    if found is None:
        raise JobError(
            f'the library has no material "{name[:60]}"',
            value=name[:60],
            limit=", ".join(load()),
            remedy="devcad list materials names them; without the key none is assumed",
        )
    return found
