"""Tables of points: which first line is a header, and what is told of which line."""

from __future__ import annotations

import pytest

from devcad.errors import JobError
from devcad.importers.table import parse_points

ROWS = "1,2,3\n4,5,6\n"
POINTS = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]


@pytest.mark.parametrize("header", ["", "x,y,z\n", "x1,y1,z1\n", "# rail\n", "-,-,-\n", "\n\nx\n"])
def test_a_first_line_without_a_beginning_of_a_number_is_a_header(header: str) -> None:
    assert parse_points(header + ROWS, place="rail.csv") == POINTS


WRONG = {
    "30.0 0 0": "the row has 1 column, must have 3",
    "30.0 0 0,1": "the row has 2 columns, must have 3",
    "1,2": "the row has 2 columns, must have 3",
    "1,5;2,5;3": '"1,5" is not a finite number',
    "0;1,5;3": '"1,5" is not a finite number',
    "1,5,2,5,3,5": "the row has 6 columns, must have 3",
    "0.1mm,0,0": '"0.1mm" is not a finite number',
    "x,-.5,z": '"x" is not a finite number',
    "1e999,0,0": '"1e999" is not a finite number',
}


@pytest.mark.parametrize("line", WRONG)
def test_a_first_line_with_a_number_in_it_is_data(line: str) -> None:
    rest = ROWS.replace(",", ";") if ";" in line else ROWS
    with pytest.raises(JobError) as caught:
        parse_points(f"{line}\n{rest}", place="rail.csv")
    assert str(caught.value).startswith(f"rail.csv > line 1: {WRONG[line]}")


@pytest.mark.parametrize(("text", "line"), [("x;y;z\n1,5;2;3\n", 2), ("\n1;2;3\n\n1,5;2;3\n", 4)])
def test_decimal_commas_are_told_on_their_line(text: str, line: int) -> None:
    with pytest.raises(JobError, match=rf"line {line}: .*write decimals with a point"):
        parse_points(text, place="rail.csv")
