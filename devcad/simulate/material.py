"""What a sheet is made of, as the bar-and-hinge model sees it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from devcad.errors import JobError
from devcad.geometry.taylor import Array


@dataclass(frozen=True, slots=True)
class Material:
    """An isotropic sheet: Young's modulus in MPa, Poisson's ratio, thickness in mm.

    Raises:
        JobError: ``youngs`` or ``thickness`` not positive, ``poisson`` not in (-1, 0.5].
    """

    youngs: float
    poisson: float
    thickness: float

    def __post_init__(self) -> None:
        for name in ("youngs", "thickness"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise JobError(f"{name} is {value:g}, must be > 0", value=value, limit=0.0)
        if not -1 < self.poisson <= 0.5:
            raise JobError(
                f"poisson is {self.poisson:g}, must be > -1 and <= 0.5",
                value=self.poisson,
                limit=0.5,
            )

    @property
    def plate(self) -> float:
        """D = E t^3 / (12 (1 - nu^2)), the bending stiffness of a unit width, N mm."""
        return self.youngs * self.thickness**3 / (12 * (1 - self.poisson**2))

    @property
    def plane_stress(self) -> Array:
        """(3, 3) forces per length N/mm from strains (xx, yy, engineering shear)."""
        nu = self.poisson
        factor = self.youngs * self.thickness / (1 - nu * nu)
        return factor * np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, (1 - nu) / 2]])
