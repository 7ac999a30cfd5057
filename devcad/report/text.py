"""The report as lines for people."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any


def file_lines(report: dict[str, Any], out: str) -> Iterator[str]:
    """A line a file: path, size, distance from the true shape; then the checks that failed but
    were allowed to."""
    files = report["files"]
    paths = [str(Path(out, report["job"], file["path"])) for file in files]
    width = max((len(path) for path in paths), default=0)
    for path, file in zip(paths, files, strict=True):
        deviation = file["max_deviation"]
        near = f"within {deviation:.2g} mm" if deviation else "exact"
        yield f"{path:{width}}  {file['bytes'] / 1000:9.1f} kB  {near}"
    for item in report["checks"]:
        if not item["passed"]:
            value, limit = (_number(item[key]) for key in ("value", "limit"))
            told = f"{item['name']} {value} {item['unit']}".rstrip()
            yield f"allowed: panel {item['panel']}: {told}, limit {limit} {item['unit']}".rstrip()


def check_lines(report: dict[str, Any]) -> Iterator[str]:
    """A table of the checks, one a line; what failed here was allowed to."""
    rows = [("panel", "check", "value", "limit", "unit", "")]
    for item in report["checks"]:
        value, limit = (_number(item[key]) for key in ("value", "limit"))
        state = "ok" if item["passed"] else "allowed"
        rows.append((item["panel"], item["name"], value, limit, item["unit"], state))
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    for row in rows:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        yield "  ".join(cells).rstrip()


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def nest_lines(told: dict[str, Any], out: str) -> Iterator[str]:
    """A line a sheet: path, panels on it, the share of it that they take."""
    paths = [str(Path(out, sheet["file"])) for sheet in told["sheets"]]
    width = max((len(path) for path in paths), default=0)
    for path, sheet in zip(paths, told["sheets"], strict=True):
        yield f"{path:{width}}  {sheet['panels']:4} panels  {100.0 * sheet['utilisation']:5.1f} %"
    yield str(Path(out, "nest.json"))
