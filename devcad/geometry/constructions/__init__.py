"""The surface kinds of a job file: one file a kind, one row in the table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import reduce
from importlib import import_module
from operator import or_
from typing import Annotated, Any

from pydantic import Field

from devcad.geometry.constructions.base import Built, BuiltPanel, Closable, Surface

ROWS = {
    "plane": "Plane",
    "cylinder": "Cylinder",
    "cone": "Cone",
    "frustum": "Frustum",
    "ruled": "Ruled",
    "tangent": "Tangent",
    "rectifying": "Rectifying",
    "line-of-curvature": "LineOfCurvature",
    "envelope": "Envelope",
    "tangent-planes": "TangentPlanes",
    "oriented": "Oriented",
    "darboux": "Darboux",
    "principal-normal-darboux": "PrincipalNormalDarboux",
    "focal": "Focal",
    "bezier": "Bezier",
    "loft": "Loft",
    "curved-fold": "CurvedFold",
    "translational": "Translational",
    "pq-strip": "PqStrip",
    "gore": "Gore",
    "conic-map": "ConicMap",
    "edge-surface": "EdgeSurface",
    "oloid": "Oloid",
    "sphericon": "Sphericon",
    "cylindrical-mechanism": "CylindricalMechanism",
}
"""Each kind's class; it stands in the file of the kind's name."""


class _Table(Mapping[str, type[Surface]]):
    """Kind -> model; a kind's file is loaded when it is asked for, as a job has only a few."""

    def __getitem__(self, kind: str) -> type[Surface]:
        name = ROWS[kind]
        model: type[Surface] = getattr(import_module(f"{__name__}.{kind.replace('-', '_')}"), name)
        return model

    def __iter__(self) -> Iterator[str]:
        return iter(ROWS)

    def __len__(self) -> int:
        return len(ROWS)

    def __contains__(self, kind: object) -> bool:
        return kind in ROWS


SURFACES: Mapping[str, type[Surface]] = _Table()
"""Each kind's model."""


def surface_spec() -> Any:
    """The type of any surface, told apart by its key ``kind``, for the JSON Schema."""
    return Annotated[reduce(or_, SURFACES.values()), Field(discriminator="kind")]


__all__ = ["SURFACES", "Built", "BuiltPanel", "Closable", "Surface", "surface_spec"]
