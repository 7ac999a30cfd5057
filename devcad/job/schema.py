"""The JSON Schema of the job file, for editors."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, create_model

from devcad.geometry.constructions import surface_spec
from devcad.job.featuretables import SeamTable, TrimTable, cutout_spec, mark_spec
from devcad.job.simulatetables import SimulateTable
from devcad.job.tables import JobTable, PanelTable


def job_schema() -> dict[str, Any]:
    """The schema of a job file (JSON Schema 2020-12): every key, kind and range.

    Conditions between keys (either [surface] or [[panel]], names that differ) are not in it.
    """
    surface = surface_spec()
    features: Any = {
        "cutout": (list[cutout_spec()] | None, None),  # type: ignore[misc]
        "mark": (list[mark_spec()] | None, None),  # type: ignore[misc]
        "trim": (list[TrimTable] | None, None),
    }
    panel = create_model("PanelTable", __base__=PanelTable, surface=(surface, ...), **features)
    panels = Annotated[list[panel], Field(min_length=1)] | None
    job = create_model(
        "JobTable",
        __base__=JobTable,
        surface=(surface | None, None),
        panel=(panels, None),
        seam=(list[SeamTable] | None, None),
        simulate=(SimulateTable | None, None),
        **features,
    )
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "devcad job file",
        **{key: value for key, value in job.model_json_schema().items() if key != "title"},
    }
