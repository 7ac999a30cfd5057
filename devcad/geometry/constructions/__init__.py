"""The surface kinds of a job file: one file a kind, one row in the table."""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from devcad.geometry.constructions.base import Built, Closable, Surface
from devcad.geometry.constructions.cone import Cone
from devcad.geometry.constructions.cylinder import Cylinder
from devcad.geometry.constructions.frustum import Frustum
from devcad.geometry.constructions.line_of_curvature import LineOfCurvature
from devcad.geometry.constructions.plane import Plane
from devcad.geometry.constructions.rectifying import Rectifying
from devcad.geometry.constructions.ruled import Ruled
from devcad.geometry.constructions.tangent import Tangent

SURFACES: dict[str, type[Surface]] = {
    "plane": Plane,
    "cylinder": Cylinder,
    "cone": Cone,
    "frustum": Frustum,
    "ruled": Ruled,
    "tangent": Tangent,
    "rectifying": Rectifying,
    "line-of-curvature": LineOfCurvature,
}
"""Each kind's model."""

if TYPE_CHECKING:  # a union made from a table is beyond static typing
    SurfaceSpec = Surface
else:
    SurfaceSpec = Annotated[reduce(or_, SURFACES.values()), Field(discriminator="kind")]
    """Any surface, told apart by its key ``kind``."""

__all__ = ["SURFACES", "Built", "Closable", "Surface", "SurfaceSpec"]
