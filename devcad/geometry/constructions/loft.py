"""The developable loft between two rails."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from devcad.errors import GeometryError, JobError
from devcad.geometry.constructions.base import Built, Closable, Figure, one_panel, sound
from devcad.geometry.curve import Curve
from devcad.geometry.curves import CurveSpec, Flag, Number, Positive
from devcad.geometry.loft.loft import Lofted, creases, lofted
from devcad.geometry.loft.relax import MODES, relaxed
from devcad.geometry.rail_fit import RailFit
from devcad.geometry.regularity import clearance, twist

HOPELESS = 45.0
"""Closed rails along whose best matching the tangent plane turns by more, in degrees, have none."""
EXACT = 1e-6
"""A warp below this, in degrees, is one of rounding."""
CROSSED = 0.95
"""Beyond this |u - v| the rulings run from one rail's end to the other's opposite end."""
FOLDED = 0.1
"""A crease below this, in degrees, is none (design.md, section 7)."""
KINDS = ("strip", "fan", "plane", "quasi")


class Loft(Closable):
    """The developable through two ``rails``: which point of one belongs to which of the other.

    c0 on rails[0], v from 0 to rails[1]; t is the share of the way through the rulings, 0 to 1.
    Where both rails move, their tangents and the ruling lie in one plane to rounding; between
    there are cones about corners and, with ``fans``, about the ends of open rails, and planes
    between straight pieces. Closed rails are matched whatever their starts and senses are.

    ``rulings`` = [[u, v], ...] must be among the rulings, by the rails' parameters; ``trim`` ends
    the sheet where its end fans would begin; ``max_twist`` (degrees) accepts a surface that warps;
    ``relax`` names a rail that may be moved, as little as possible and by ``relax_max`` at most,
    where no developable exists.

    Source: algorithms.md, section 1.
    """

    kind: Literal["loft"]
    rails: tuple[CurveSpec, CurveSpec]
    max_twist: Positive | None = None
    fans: Flag = True
    trim: Flag = False
    rulings: tuple[tuple[Number, Number], ...] = Field(default=())
    relax: Literal["rail-a", "rail-b"] | None = None
    relax_max: Positive | None = None

    @model_validator(mode="after")
    def _check(self) -> Loft:
        if self.relax_max is not None and self.relax is None:
            raise JobError("relax_max belongs to relax", remedy='give relax = "rail-b" too')
        return self

    def build(self) -> Built:
        """One chain of planes, cones and strips.

        Raises:
            JobError: a ruling names a parameter that its rail does not have.
            GeometryError: a rail stands still, closed rails have no closed matching, or moving a
                rail gives no developable.
        """
        first, second = (spec.curve() for spec in self.rails)
        sound(first, "rails[0]")
        sound(second, "rails[1]")
        if not (first.closed and second.closed):
            first, second = (replace(curve, closed=False) for curve in (first, second))
        through = self._through(first, second)
        best = _best(first, second, self.fans, self.trim, through)
        moved = None
        if not best.exact and self.relax is not None:
            best, moved = self._relaxed(first, second, best)
        if best.made.closed and best.warp > HOPELESS:
            raise GeometryError(
                "the closed rails have no closed matching: on the best way through them the "
                f"tangent plane turns by {best.warp:.4g} deg",
                value=best.warp,
                limit=HOPELESS,
                remedy="whole circles that wrap into one another are an oloid or an edge-surface; "
                "for a loft give arcs of them",
            )
        folds = creases(best.made)
        advice = "" if best.exact else self._advice(first, second, best)
        return one_panel(
            best.made.patches,
            best.made.closed,
            figures=_figures(best),
            rail_fit=RailFit(
                best.crease,
                max((fold.angle for fold in folds), default=0.0),
                self.max_twist,
                moved,
                advice,
            ),
        )

    def _through(self, first: Curve, second: Curve) -> tuple[tuple[float, float], ...]:
        """The rulings to be kept, checked and in order."""
        for pair in self.rulings:
            for name, t, curve in zip(("rails[0]", "rails[1]"), pair, (first, second), strict=True):
                low, high = curve.domain
                if not low <= t <= high:
                    raise JobError(
                        f"rulings: {name} has no t = {t:.9g}, it runs from {low:.6g} to {high:.6g}",
                        value=t,
                        limit=high,
                        remedy="give the rails' own parameters",
                    )
        return tuple(sorted(self.rulings))

    def _relaxed(self, first: Curve, second: Curve, best: _Found) -> tuple[_Found, float]:
        """The loft after moving a rail, and how far it was moved."""
        still, free = (first, second) if self.relax == "rail-b" else (second, first)
        nearest = best.warp
        for modes in MODES:
            curve, away = relaxed(still, free, modes)
            if self.relax_max is not None and away > self.relax_max:
                continue
            pair = (first, curve) if self.relax == "rail-b" else (curve, second)
            found = _best(*pair, self.fans, self.trim, ())
            if found.exact and found.regular:
                return found, away
            nearest = min(nearest, found.warp)
        limit = "" if self.relax_max is None else f" within relax_max = {self.relax_max:.6g}"
        raise GeometryError(
            f"relax: no developable was found by moving {self.relax}{limit}; the best still warps "
            f"by {nearest:.4g} deg",
            value=nearest,
            limit=EXACT,
            remedy="raise relax_max, move the other rail, or bring the rails nearer to parallel",
        )

    def _advice(self, first: Curve, second: Curve, best: _Found) -> str:
        """What came nearest to a developable, and what may help."""
        open_rails = not best.made.closed
        other = _found(first, second, not best.fans, False, ()) if open_rails else None
        said = []
        for found in (best, other):
            if found is not None:
                where = f" with fans {found.summary}" if found.fans else f" {found.summary}"
                said.append(f"{'' if found.fans else 'without fans'}{where}".strip())
        least = "; ".join(said) if open_rails else f"its best {best.summary}"
        return (
            f"no developable joins these rails ({least}); "
            'let one move: relax = "rail-b", or bring their shapes nearer to one another'
        )


@dataclass(frozen=True, slots=True)
class _Found:
    """A loft with its largest warp in degrees and where, and its largest crease that no corner
    asks for."""

    made: Lofted
    fans: bool
    warp: float
    t: float
    crease: float

    @property
    def exact(self) -> bool:
        """Whether it is developable, folds nowhere by itself, and is a sheet from rail to rail: not
        two fans about opposite ends, which any two open rails have."""
        return self.warp <= EXACT and self.crease <= FOLDED and not self.crossed

    @property
    def crossed(self) -> bool:
        """Whether a fan about an end of one rail covers nearly all of the other."""
        path = self.made.path
        return not self.made.closed and float(np.abs(path.u - path.v).max()) > CROSSED

    @property
    def regular(self) -> bool:
        """Whether it stays off its regression curve."""
        return all(clearance(patch, (0.0,)).value >= 0.0 for patch in self.made.patches)

    @property
    def summary(self) -> str:
        """Its figures in words."""
        return f"warps by {self.warp:.4g} deg and folds by {self.crease:.4g} deg"


def _best(
    first: Curve,
    second: Curve,
    fans: bool,
    trim: bool,
    through: tuple[tuple[float, float], ...],
) -> _Found:
    """The loft with fans where it is exact, else the one that warps least without."""
    found = _found(first, second, fans, trim, through)
    if found.exact or not fans or found.made.closed:
        return found
    plain = _found(first, second, False, trim, through)
    return plain if found.crossed or plain.warp < max(found.warp, found.crease) else found


def _found(
    first: Curve,
    second: Curve,
    fans: bool,
    trim: bool,
    through: tuple[tuple[float, float], ...],
) -> _Found:
    made = lofted(first, second, fans=fans, through=through, trim=trim)
    extremes = [twist(patch) for patch in made.patches]
    worst = max(extremes, key=lambda extreme: extreme.value)
    crease = max((fold.angle for fold in creases(made) if not fold.asked), default=0.0)
    return _Found(made, fans, float(np.degrees(worst.value)), worst.t, crease)


def _figures(found: _Found) -> dict[str, Figure]:
    """The largest warp in degrees and its t, and the share of the way that each kind takes."""
    figures = {"warp_deg": Figure(found.warp, 0), "warp_t": Figure(found.t, 0)}
    total = sum(part.share for part in found.made.parts)
    for kind in KINDS:
        share = sum(part.share for part in found.made.parts if part.kind == kind) / total
        figures[f"share_{kind}"] = Figure(share, 0)
    return figures
