"""The thicknesses that dealers keep: data in stock.toml, read when they are asked for."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from devcad.shop.materials import material
from devcad.units import MM_PER_INCH

AS_STOCK = 0.01
"""mm; a sheet of a job is one of the stock when their thicknesses differ by no more."""


@dataclass(frozen=True, slots=True)
class Stock:
    """A thickness in mm that dealers keep, and its name in the trade, such as "18 ga".

    ``verified`` is False where the number is trade practice without a source.
    """

    thickness: float
    name: str
    series: str
    source: str
    verified: bool

    @property
    def words(self) -> str:
        """The thickness as a report names it."""
        length = f"{self.thickness:.4g} mm"
        name = length if self.name == length else f"{self.name}, {length}"
        return f"{name} ({self.source}{'' if self.verified else '; not verified'})"


def stock(name: str) -> tuple[Stock, ...]:
    """The thicknesses in which a material is kept, increasing; () where none is known.

    Raises:
        JobError: the library has no such material.
    """
    return _load().get(material(name).id, ())


def nearest(name: str, thickness: float) -> Stock | None:
    """The stock whose thickness is nearest to one in mm, the thinner of two; None without any.

    Raises:
        JobError: the library has no such material.
    """
    return min(stock(name), key=lambda one: abs(one.thickness - thickness), default=None)


def stock_words(name: str, thickness: float) -> str:
    """What a report says of a sheet's thickness in mm; "" where nothing is known.

    Raises:
        JobError: the library has no such material.
    """
    one = nearest(name, thickness)
    if one is None:
        return ""
    if abs(one.thickness - thickness) <= AS_STOCK:
        return one.words
    return f"{thickness:.4g} mm is not kept; the nearest is {one.words}"


@cache
def _load() -> dict[str, tuple[Stock, ...]]:
    """The stock of each material that has any."""
    text = resources.files("devcad.shop").joinpath("stock.toml").read_text("utf-8")
    kept: dict[str, list[Stock]] = {}
    for row in tomllib.loads(text).values():
        for name in row["materials"]:
            kept.setdefault(name, []).extend(_series(row))
    return {
        name: tuple(sorted(rows, key=lambda one: (one.thickness, one.name)))
        for name, rows in kept.items()
    }


def _series(row: dict[str, Any]) -> Iterator[Stock]:
    """The thicknesses of one series."""
    lengths = {f"{mm:.4g} mm": float(mm) for mm in row.get("mm", ())}
    lengths |= {name: inch * MM_PER_INCH for name, inch in row.get("inch", {}).items()}
    lengths |= {
        f"{count} {row['unit']}": count * row["per_unit"] * MM_PER_INCH
        for count in row.get("units", ())
    }
    for name, length in lengths.items():
        yield Stock(length, name, row["title"], row["source"], name in row["verified"])
