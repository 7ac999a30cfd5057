"""The developable loft between two rails."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from devcad.errors import GeometryError, JobError
from devcad.geometry.constructions.base import Built, Closable, Figure, one_panel, sound
from devcad.geometry.curve import Curve
from devcad.geometry.curves import CurveSpec, Flag, Number, Positive
from devcad.geometry.loft.loft import Lofted, creases, lofted, reversed_curve
from devcad.geometry.loft.relax import MODES, relaxed
from devcad.geometry.rail_fit import RailFit
from devcad.geometry.regularity import clearance, twist

HOPELESS = 45.0
"""Closed rails along whose best matching the tangent plane turns by more, in degrees, have none."""
EXACT = 1e-6
"""A warp below this, in degrees, is one of rounding."""
CROSSED = 0.95
"""Beyond this |u - v| the rulings run from one rail's end to the other's opposite end."""
LOOKED = 2049
TORN = 1e-8
APART = 1e-9
"""Rails that come nearer than this share of their size meet."""
MISSED = 5e-3
"""Share of its length by which a fixed ruling may lie beside the nearest of 2049 that are seen."""
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
        _require_apart(first, second)
        through = self._through(first, second)
        best = _best(first, second, self.fans, self.trim, through)
        moved = None
        if not best.exact and self.relax is not None:
            best, moved = self._relaxed(first, second, best)
        if best.torn:
            raise GeometryError(
                "no developable joins these rails, and nothing that comes near one was found",
                value=best.warp,
                limit=EXACT,
                remedy='bring their shapes nearer together, or let one move: relax = "rail-b"',
            )
        if best.made.closed and best.warp > HOPELESS:
            raise GeometryError(
                "the closed rails have no closed matching: on the best way through them the "
                f"tangent plane turns by {best.warp:.4g} deg",
                value=best.warp,
                limit=HOPELESS,
                remedy="whole circles that wrap into one another are an oloid or an edge-surface; "
                "for a loft give arcs of them",
            )
        _require_rulings(best, through, first, second)
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
        kept = tuple(sorted(self.rulings))
        for before, after in pairwise(kept):
            if not (before[0] < after[0] and before[1] < after[1]) and not first.closed:
                raise JobError(
                    f"rulings: {list(before)} and {list(after)} cross",
                    value=after[1],
                    limit=before[1],
                    remedy="give rulings whose parameters grow together on both rails",
                )
        return kept

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
        if open_rails and _found(first, reversed_curve(second), best.fans, False, ()).exact:
            return "rails[1] runs against rails[0]: turn it round, then a developable joins them"
        other = _found(first, second, not best.fans, False, ()) if open_rails else None
        if other is not None and other.exact and other.fans:
            return "with fans about the ends of the rails there is one: leave out fans = false"
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


def _require_apart(first: Curve, second: Curve) -> None:
    """Raise a GeometryError where the rails meet, or lie in one plane: no sheet is to be found."""
    t, s = (np.linspace(*curve.domain, LOOKED) for curve in (first, second))
    here, there = first.point(t), second.point(s)
    both = np.concatenate([here, there])
    size = float(np.linalg.norm(np.ptp(both, axis=0)))
    for curve, own, others in ((first, t, there), (second, s, here)):
        points = curve.point(own)
        away = np.linalg.norm(points[:, None] - others[None, :: LOOKED // 64], axis=2)
        k = int(np.argmin(away.min(axis=1)))
        if away[k].min() <= APART * size:
            raise GeometryError(
                f"the rails meet at t = {own[k]:.6g} of rails[{0 if curve is first else 1}]",
                value=float(away[k].min()),
                limit=APART * size,
                remedy="end one of them before that point",
            )
    flat = np.linalg.svd(both - both.mean(axis=0), compute_uv=False)[-1]
    straight = np.linalg.svd(here - here.mean(axis=0), compute_uv=False)[1]
    if flat <= APART * size * np.sqrt(len(both)) and straight > APART * size:
        raise GeometryError(
            "both rails lie in one plane, so that what is between them is flat already",
            value=float(flat),
            remedy="a flat sheet needs no loft; lift one of the rails",
        )


def _require_rulings(
    found: _Found, through: tuple[tuple[float, float], ...], first: Curve, second: Curve
) -> None:
    """Raise a GeometryError where a ruling that must be among them is not one of the surface."""
    for u, v in through:
        start, end = first.point(np.array([u]))[0], second.point(np.array([v]))[0]
        size = float(np.linalg.norm(end - start))
        missed = min(
            float(
                (
                    np.linalg.norm(jet.c0[0] - start, axis=1)
                    + np.linalg.norm(jet.rail(jet.v_to)[0] - end, axis=1)
                ).min()
            )
            for patch in found.made.patches
            for jet in [patch.jet(np.linspace(*patch.domain, LOOKED), 0)]
        )
        if missed > MISSED * size:
            raise GeometryError(
                f"rulings: the one from {u:.6g} to {v:.6g} is none of the developable through the "
                f"rails: its nearest ruling ends {missed:.4g} beside it",
                value=missed,
                limit=MISSED * size,
                remedy="leave it out, or choose the parameters of a ruling that the report shows",
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
        smooth = self.warp <= EXACT and self.crease <= FOLDED
        return smooth and not self.crossed and not self.torn

    @property
    def torn(self) -> bool:
        """Whether its parts do not join: what was found is no sheet."""
        ends = [patch.jet(patch.domain, 0) for patch in self.made.patches]
        for before, after in pairwise(ends):
            bases = before.c0[0, 1] - after.c0[0, 0]
            tops = before.rail(before.v_to)[0, 1] - after.rail(after.v_to)[0, 0]
            size = self.made.rails[0].size
            if max(np.linalg.norm(bases), np.linalg.norm(tops)) > TORN * size:
                return True
        return not np.isfinite(self.warp)

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
    worse = found.crossed or found.torn or plain.warp < max(found.warp, found.crease)
    return plain if worse and not plain.torn else found


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
