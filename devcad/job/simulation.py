"""The table [simulate] to the values that the simulation reads, in mm, N and N/mm2."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from devcad.errors import DevcadError
from devcad.job.invalid import problems
from devcad.job.simulatetables import LoadTable, SimulateTable, SupportTable
from devcad.simulate.settings import Load, Simulation, Support, Where


def read_simulation(
    tree: dict[str, Any], place: str, mm: float
) -> tuple[Simulation | None, list[DevcadError]]:
    """What a table [simulate] says, or its problems; ``mm`` is the job's unit."""
    where = f"{place} > simulate"
    try:
        table = SimulateTable.model_validate(tree)
    except ValidationError as error:
        return None, problems(error, tree, SimulateTable, place=where)
    return _simulation(table, mm), []


def _simulation(table: SimulateTable, mm: float) -> Simulation:
    def length(value: float | None) -> float | None:
        return None if value is None else value * mm

    kept = ("steps", "load_steps", "cells", "across", "coefficients", "youngs", "poisson")
    return Simulation(
        **{key: getattr(table, key) for key in (*kept, "modes", "panel", "weight")},
        length_scale=length(table.length_scale),
        thickness=length(table.thickness),
        supports=tuple(
            Support(_where(row, f"supports[{k}]", mm), row.fix, row.clamp)
            for k, row in enumerate(table.supports)
        ),
        loads=tuple(
            Load(_where(row, f"loads[{k}]", mm), row.force) for k, row in enumerate(table.loads)
        ),
    )


def _where(row: SupportTable | LoadTable, key: str, mm: float) -> Where:
    at = None if row.at is None else (row.at[0] * mm, row.at[1] * mm)
    return Where(row.edge, at, f"simulate.{key}")
