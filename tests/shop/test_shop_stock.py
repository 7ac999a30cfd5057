"""The stock's thicknesses against the laws that gauges and ounces come from."""

from __future__ import annotations

import re

import pytest

from devcad.errors import JobError
from devcad.shop.materials import load, material
from devcad.shop.stock import nearest, stock, stock_words

SHEETS = [0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0]
METALS = [name for name in load() if load()[name].youngs_modulus > 5e4]
POUNDS = 41.82
"""Weight of a square foot of steel one inch thick, by which the gauge is defined."""
OUNCES = {24: 16, 22: 20, 20: 24, 18: 32, 16: 40, 14: 50, 12: 70, 11: 80, 10: 90}
"""Weight of a square foot of a gauge in ounces, sixteen to the pound."""


def gauge(number: int) -> float:
    return {one.name: one.thickness for one in stock("dc01")}[f"{number} ga"]


@pytest.mark.parametrize("name", METALS)
def test_metals_come_in_metric_sheets(name: str) -> None:
    kept = [one.thickness for one in stock(name)]
    assert set(SHEETS) <= set(kept)
    assert kept == sorted(kept)


@pytest.mark.parametrize("number", OUNCES)
def test_a_gauge_of_steel_is_a_weight(number: int) -> None:
    """Four digits of an inch are tabulated."""
    inches = OUNCES[number] / 16.0 / POUNDS
    assert gauge(number) == pytest.approx(25.4 * inches, abs=25.4 * 0.6e-4)


def test_gauges_are_names_of_steel_only() -> None:
    """The same number is another thickness for another metal."""
    assert not [one for one in stock("5052-h32") if one.name.endswith("ga")]


@pytest.mark.parametrize(("ounces", "mm"), [(8, 3.2), (9, 3.6), (1, 0.4)])
def test_an_ounce_of_leather_is_a_64th_of_an_inch(ounces: int, mm: float) -> None:
    """Dealers print one digit."""
    kept = {one.name: one.thickness for one in stock("veg-tan-leather")}
    assert kept.get(f"{ounces} oz", 25.4 * ounces / 64.0) == pytest.approx(mm, abs=0.05)


@pytest.mark.parametrize("name", load())
def test_what_has_no_source_says_so(name: str) -> None:
    for one in stock(name):
        assert one.source
        assert one.verified != ("not verified" in one.words)
    verified = {one.name for one in stock(name) if one.verified}
    assert verified == ({"20 ga", "18 ga", "10 ga"} if name in ("dc01", "s235jr") else set())
    assert bool(material(name).doubt) != material(name).verified


def test_a_report_names_the_sheet_or_the_nearest() -> None:
    assert stock_words("dc01", 1.5) == "1.5 mm (trade practice; not verified)"
    assert stock_words("dc01", 1.214).startswith("18 ga, 1.214 mm (gauge tables")
    assert "verified" not in stock_words("dc01", 1.214)
    words = stock_words("304", 1.35)
    assert re.match(r"1\.35 mm is not kept; the nearest is 1\.[25] mm", words)
    assert stock_words("paperboard", 0.4) == ""
    assert nearest("paperboard", 0.4) is None


def test_an_unknown_material_has_no_stock() -> None:
    with pytest.raises(JobError, match="no material"):
        stock("unobtainium")
