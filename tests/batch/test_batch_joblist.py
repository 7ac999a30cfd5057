"""Lists of jobs as spreadsheets save them."""

from __future__ import annotations

from pathlib import Path

import pytest

from devcad.batch.joblist import read_list
from devcad.batch.orders import Order, orders_of
from devcad.errors import DevcadError, JobError


def listed(folder: Path, text: str | bytes, name: str = "parts.csv") -> list[Order]:
    path = folder / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_list(str(path))


def problems(folder: Path, text: str) -> list[str]:
    with pytest.raises(JobError) as caught:
        listed(folder, text)
    errors: list[DevcadError] = [caught.value, *getattr(caught.value, "others", ())]
    assert {error.code for error in errors} == {2}
    return [str(error).replace(f"{folder}/", "") for error in errors]


PLAIN = "job,quantity,surface.radius,outputs\nlamp.toml,3,81.5,dxf;svg\n"


def same_as_plain(orders: list[Order]) -> bool:
    (order,) = orders
    return (order.changes, order.formats) == (
        (("meta.quantity", "3"), ("surface.radius", "81.5")),
        ("dxf", "svg"),
    )


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.replace("\n", "\r\n"),
        "\ufeff" + PLAIN,
        "Job, Quantity ,surface.radius,OUTPUTS,,\nlamp.toml, 3.0 ,81.5,DXF; svg ,,\n,,,\n",
        'job;quantity;surface.radius;outputs\nlamp.toml;3,0;81,5;"dxf;svg"\n',
        "sep=;\r\njob;quantity;surface.radius;outputs\r\nlamp.toml;3;81,5;dxf,svg\r\n",
        PLAIN.replace(",", "\t"),
        '\n\n"job","quantity","surface.radius","outputs"\n"lamp.toml","3","81.5","dxf;svg"',
        "job,quantity,surface.radius,outputs\nlamp.toml,\u00a03\u00a0,'81.5,dxf;svg\n",
    ],
    ids=["plain", "crlf", "bom", "untidy", "german", "sep", "tabs", "quoted", "guarded"],
)
def test_one_list_in_the_forms_that_spreadsheets_give_it(tmp_path: Path, text: str) -> None:
    assert same_as_plain(listed(tmp_path, text))


def test_utf_16_as_spreadsheets_save_unicode_text(tmp_path: Path) -> None:
    assert same_as_plain(listed(tmp_path, PLAIN.replace(",", "\t").encode("utf-16"), "parts.txt"))


def test_jobs_are_named_relative_to_the_list_and_an_empty_cell_changes_nothing(
    tmp_path: Path,
) -> None:
    (order,) = listed(tmp_path, "job,thickness,revision,due\nsub\\lamp.toml,,03,24.12.2026\n")
    assert Path(order.path) == tmp_path / "sub" / "lamp.toml"
    assert order.changes == (("meta.revision", "03"),)
    assert order.due == "2026-12-24"


def test_every_fault_of_a_list_is_told_with_its_row_and_column(tmp_path: Path) -> None:
    told = problems(
        tmp_path,
        "job,quantity,due,outputs,surface.radius\n"
        "a.toml,0,2026-02-30,dxf,1\n"
        "\n"
        ",1,,dfx,\n"
        'b.toml,"1,000",12/11/2026,,"1,5"\n'
        "c.toml,1,,,1,more\n",
    )
    begins = [line.split(": ")[0] for line in told]
    assert begins == [
        "parts.csv > row 2, column quantity",
        "parts.csv > row 2, column due",
        "parts.csv > row 4, column outputs",
        "parts.csv > row 4, column job",
        "parts.csv > row 5, column quantity",
        "parts.csv > row 5, column due",
        "parts.csv > row 5, column surface.radius",
        "parts.csv > row 6",
    ]
    assert "known: 3mf" in told[2]


def test_columns_that_are_no_keys_twice_there_or_missing(tmp_path: Path) -> None:
    assert "column Materiel" in problems(tmp_path, "job,Materiel\nx,y\n")[0]
    assert 'did you mean "material"?' in problems(tmp_path, "job,Materiel\nx,y\n")[0]
    assert "twice" in problems(tmp_path, "job,revision,meta.revision\nx,1,2\n")[0]
    assert 'no column "job"' in problems(tmp_path, "quantity\n3\n")[0]
    assert "column without a name" in problems(tmp_path, "job,\nx,y\n")[0]
    assert "empty" in problems(tmp_path, "\n\n")[0]
    assert "no rows" in problems(tmp_path, "job\n")[0]
    assert "row 2: not CSV" in problems(tmp_path, 'job,material\na.toml,"steel\n')[0]


def test_a_folder_stands_for_its_job_files_in_order(tmp_path: Path) -> None:
    for name in ("b.toml", "a.toml", "notes.md"):
        (tmp_path / name).write_text("")
    assert [Path(order.path).name for order in orders_of([str(tmp_path)])] == ["a.toml", "b.toml"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(JobError, match="no job files"):
        orders_of([str(tmp_path / "empty")])
