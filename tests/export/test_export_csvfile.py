"""Tables for spreadsheets: what Python's own reader finds in them; no text is a formula."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devcad.export.csvfile import RISKY, Cell, Figure, cell_text, from_bytes, to_bytes, write_table

HEADER = ("name", "x", "count")


def read(data: bytes) -> list[list[str]]:
    """By the reader of the standard library, with its defaults."""
    return list(csv.reader(io.StringIO(data.decode("utf-8"), newline="")))


def test_the_bytes_are_these() -> None:
    rows: list[list[Cell]] = [
        ["bracket", 1.5, 2],
        ['a "b", c', -0.0, None],
        ["Blech, gr\u00fcn", 1 / 3, 1],
    ]
    assert (
        to_bytes(HEADER, rows)
        == (
            'name,x,count\nbracket,1.5,2\n"a ""b"", c",0,\n"Blech, gr\u00fcn",0.333333333,1\n'
        ).encode()
    )


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@sum", "'quoted", "\t=1+1", "\r\n=2"])
def test_no_text_is_a_formula(text: str) -> None:
    ((_, *_), (cell, *_)) = read(to_bytes(HEADER, [[text, 1.0, 1]]))
    assert cell.startswith("'")
    assert from_bytes(to_bytes(HEADER, [[text, 1.0, 1]]))[1][0] == text.strip()


def test_a_negative_number_is_no_text() -> None:
    assert cell_text(-1.5) == "-1.5"
    assert cell_text("-1.5") == "'-1.5"


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (-1e-12, "0"),
        (100.0, "100"),
        (1e20, "1" + 20 * "0"),
        (1e-9, "0.000000001"),
    ],
)
def test_numbers_have_no_exponent_and_no_idle_zeros(number: float, text: str) -> None:
    assert cell_text(number) == text


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_not_written(number: float) -> None:
    with pytest.raises(ValueError, match="no number"):
        to_bytes(HEADER, [["a", number, 1]])


@given(st.floats(1e-8, 1e12), st.sampled_from([-1.0, 1.0]))
def test_a_figure_keeps_its_digits_however_small_it_is(size: float, sign: float) -> None:
    text = cell_text(Figure(sign * size))
    assert "e" not in text
    assert float(text) == pytest.approx(sign * size, rel=1e-14)  # 15 digits
    assert cell_text(Figure(-0.0)) == cell_text(Figure(sign * 1e-30)) == "0"
    assert cell_text(Figure(sign * 100.0)) == cell_text(sign * 100.0)


def test_every_row_has_a_cell_for_every_name() -> None:
    with pytest.raises(ValueError, match="2 cells below 3 names"):
        to_bytes(HEADER, [["a", 1.0]])


def test_half_a_quote_is_no_table() -> None:
    with pytest.raises(ValueError, match="no table"):
        from_bytes(b'name,x\n"a,1\n')


cells = st.one_of(
    st.text(), st.integers(), st.booleans(), st.none(), st.floats(-1e9, 1e9, allow_nan=False)
)


@given(st.lists(st.tuples(cells, cells, cells), max_size=6))
def test_any_table_is_read_back_as_it_was(rows: list[tuple[Cell, Cell, Cell]]) -> None:
    data = to_bytes(HEADER, rows)
    assert data == to_bytes(HEADER, rows)
    assert data.count(b"\n") == len(rows) + 1  # one line a row, whatever the texts hold
    assert b"\r" not in data
    found = read(data)
    assert found[0] == list(HEADER)
    for row, line in zip(rows, found[1:], strict=True):
        for meant, cell in zip(row, line, strict=True):
            if isinstance(meant, float):
                assert float(cell) == pytest.approx(meant, abs=5.1e-10, rel=1e-15)
            elif isinstance(meant, str):
                assert not cell.startswith(RISKY[:-1])


def test_a_file_is_read_back(tmp_path: Path) -> None:
    path = tmp_path / "lamp-bends.csv"
    written = write_table(path, "bends", HEADER, [["=lamp", 1 / 3, 1], ["b", None, 2]])
    assert written.format == "bends"
    assert written.max_deviation == pytest.approx(1 / 3e9, rel=1e-6)
    assert [check.passed for check in written.checks] == [True]
    assert from_bytes(path.read_bytes()) == [
        list(HEADER),
        ["=lamp", "0.333333333", "1"],
        ["b", "", "2"],
    ]
