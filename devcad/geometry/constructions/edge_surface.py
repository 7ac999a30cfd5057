"""Edge surfaces: the developables that touch a space curve twice, or two curves once each."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from devcad.errors import GeometryError, JobError
from devcad.geometry import taylor
from devcad.geometry.bitangents import monotone
from devcad.geometry.bitangents.bitangent import Pairs
from devcad.geometry.bitangents.branches import Filled, Path
from devcad.geometry.bitangents.families import families
from devcad.geometry.bitangents.monotone import Piece
from devcad.geometry.bitangents.rails import Rail, rail
from devcad.geometry.bitangents.supporting import supported
from devcad.geometry.bitangents.zeroset import Unresolved
from devcad.geometry.constructions.base import Built, BuiltPanel, Closable, smooth
from devcad.geometry.constructions.segments import reversed_
from devcad.geometry.curve import Curve, angles
from devcad.geometry.curves import Count, CurveSpec, Flag
from devcad.geometry.patch import Patch, RulingJet
from devcad.geometry.taylor import Array

REFINED = 2
"""How often the grid is doubled before a surface is given up."""

FANS = "the fans from the end points of an open curve are not bitangent and not part of it"
FACES = "flat faces of the convex hull, if it has any, are not part of it"


class EdgeSurface(Closable):
    """The bitangent developable of one curve, or of two: every plane touches at both ends.

    Each branch of pairs is a panel, in the order of its smallest parameter on the first curve
    (of one curve: the smaller parameter of each pair is the first). ``component`` = 1, 2, .. takes
    one of them. ``hull`` keeps only what bounds the convex hull; its front is the outside.

    c0 = the pair's point on the first curve, e towards the other, v from 0 to their distance;
    t begins with the first curve's parameter and grows by half of what both parameters move (the
    second's scaled to the first's domain). Where a point stands still one patch ends.
    Where the curves meet, a ruling has no length: one panel ends there in a tip, another begins.

    Source: geometry.md, section 6.
    """

    kind: Literal["edge-surface"]
    curves: Annotated[tuple[CurveSpec, ...], Field(min_length=1, max_length=2)]
    component: Count | None = None
    hull: Flag = False

    @model_validator(mode="after")
    def _two_curves(self) -> EdgeSurface:
        if len(self.curves) == 2 and self.curves[0] == self.curves[1]:
            raise JobError(
                "curves: both are the same curve",
                remedy="give it once: curves = [curve] touches one curve twice",
            )
        return self

    def build(self) -> Built:
        """One panel for each branch, one patch for each part of it between turning points.

        Raises:
            JobError: there is no such component.
            GeometryError: there are no bitangent pairs, or more than curves of them; a curve has
                corners; the curves touch.
        """
        names = ["curves[0]", "curves[1]"] if len(self.curves) == 2 else ["curves"]
        curves = [
            _round(smooth(spec.curve(), name, order=3), name)
            for spec, name in zip(self.curves, names, strict=True)
        ]
        rails = [rail(curve) for curve in curves]
        pairs = Pairs(rails[0], rails[-1], len(rails) == 1)
        if pairs.same:
            _require_torsion(rails[0])
        sheets = self._sheets(pairs)
        notes: tuple[str, ...] = (FANS,) if not all(one.period for one in rails) else ()
        if self.hull:
            notes += (FACES,)
        return Built(tuple(_panel(pairs, sheet, notes) for sheet in sheets))

    def _sheets(self, pairs: Pairs) -> list[_Sheet]:
        """The sheets that were asked for."""
        for refined in range(REFINED + 1):
            try:
                found = families(pairs, refined)
                if not found:
                    raise _none(pairs)
                if not self.hull:
                    found = [found[k] for k in self._chosen(len(found))]
                sheets = [_sheet(pairs, path) for path in found]
                break
            except Filled as filled:
                raise _too_many(pairs, filled) from None
            except Unresolved as unresolved:
                if refined == REFINED:
                    raise _tangled(unresolved) from None
        if not self.hull:
            return sheets
        sheets = [arc for sheet in sheets for arc in _hull(pairs, sheet)]
        if not sheets:
            raise GeometryError(
                "hull: no bitangent plane has all of the curve on one side"
                if pairs.same
                else "hull: no bitangent plane has both curves on one side",
                remedy="without hull = true every bitangent developable is built",
            )
        return [sheets[k] for k in self._chosen(len(sheets))]

    def _chosen(self, number: int) -> list[int]:
        """The indices of the components that were asked for."""
        if self.component is None:
            return list(range(number))
        if self.component > number:
            raise JobError(
                f"component: {self.component} was asked for, there are {number}",
                value=self.component,
                limit=number,
                remedy=f"choose one of 1 to {number}, or leave it out for all of them",
            )
        return [self.component - 1]


@dataclass(frozen=True, slots=True)
class _Sheet:
    """Consecutive arcs (piece, from, to) of one branch; ``outside``: +1 where the curves lie on
    the side of a'(s) x e, -1 on the other, None where that is not asked."""

    arcs: tuple[tuple[Piece, float, float], ...]
    closed: bool
    outside: float | None = None


def _sheet(pairs: Pairs, path: Path) -> _Sheet:
    """The whole branch."""
    pieces = monotone.pieces(pairs, path)
    return _Sheet(tuple((piece, *piece.domain) for piece in pieces), path.closed)


def _hull(pairs: Pairs, sheet: _Sheet) -> list[_Sheet]:
    """What of a branch bounds the convex hull: arcs that follow one another stay together."""
    runs: list[list[tuple[Piece, float, float, float]]] = []
    for piece, _, _ in sheet.arcs:
        for low, high, side in supported(pairs, piece):
            last = runs[-1][-1] if runs else None
            if last is not None and last[2] == low:
                runs[-1].append((piece, low, high, side))
            else:
                runs.append([(piece, low, high, side)])
    begin, end = sheet.arcs[0][1], sheet.arcs[-1][2]
    whole = sheet.closed and bool(runs) and runs[0][0][1] == begin and runs[-1][-1][2] == end
    out = [_Sheet(tuple(arc[:3] for arc in run), False, run[0][3]) for run in runs]
    if whole and len(runs) == 1:
        return [replace(out[0], closed=True)]
    if whole:  # one run across the start of the branch
        shift = end - begin
        ahead = tuple((piece.shifted(shift), a + shift, b + shift) for piece, a, b in out[0].arcs)
        out = [*out[1:-1], replace(out[-1], arcs=out[-1].arcs + ahead)]
    return out


def _panel(pairs: Pairs, sheet: _Sheet, notes: tuple[str, ...]) -> BuiltPanel:
    """The patches of a sheet, its front outside where there is one."""
    first, last = sheet.arcs[0][1], sheet.arcs[-1][2]
    patches = tuple(_patch(pairs, *arc) for arc in sheet.arcs)
    if sheet.outside is not None:
        patch = patches[0]
        t = np.array([0.5 * (patch.domain[0] + patch.domain[1])])
        s, _ = sheet.arcs[0][0].at(t, 0)
        e = sheet.arcs[0][0].rulings(pairs, t, 0)[1][0, 0]
        front = patch.frame(t).n[0]
        across = np.cross(pairs.first.jet(s[0], 1)[1, 0], e)
        if float(front @ across) * sheet.outside > 0.0:  # the curves lie in front
            patches = tuple(reversed_(patch, first + last) for patch in patches[::-1])
    return BuiltPanel(patches, sheet.closed, notes=notes)


def _patch(pairs: Pairs, piece: Piece, low: float, high: float) -> Patch:
    """The rulings of one arc."""

    def field(sigma: Array, order: int) -> RulingJet:
        c0, e, length = piece.rulings(pairs, sigma, order)
        return RulingJet(c0, e, taylor.constant(0.0, order, len(sigma)), length)

    return Patch(field, (low, high), tuple(x for x in piece.breaks if low < x < high))


# --- what cannot be built ------------------------------------------------------------------


def _round(curve: Curve, name: str) -> Curve:
    """The curve, refused where a closed one has a corner at its seam."""
    if curve.closed:
        before, after = curve.jet(np.array(curve.domain), 1)[1]
        if not angles(before[None], after[None])[0] <= 1e-6:
            raise GeometryError(
                f"{name}: the tangent jumps where the curve closes, at t = {curve.domain[0]:.6g}",
                value=curve.domain[0],
                remedy="round the corner, or end the curve a little before it",
            )
    return curve


def _require_torsion(rail: Rail) -> None:
    """Raise a GeometryError where the torsion jumps through zero: a tip without a tangent."""
    if not rail.breaks:
        return
    low, high = rail.curve.domain
    breaks = np.array(rail.breaks)
    before = rail.jet(np.nextafter(np.where(breaks == low, high, breaks), -np.inf), 3)
    after = rail.jet(breaks, 3)
    one, two = (np.linalg.det(np.moveaxis(x[1:], 0, 1)) for x in (before, after))
    sizes = np.abs(np.concatenate([one, two])).max()
    bad = (one * two < 0.0) & (np.abs(one - two) > 1e-6 * sizes)
    if bad.any():
        at = float(breaks[int(np.argmax(bad))])
        raise GeometryError(
            f"curves: the torsion jumps through zero at t = {at:.6g}, where a branch would end",
            value=at,
            remedy="take a smoother curve: degree = 5, or an expression",
        )


def _none(pairs: Pairs) -> GeometryError:
    if pairs.same:
        return GeometryError(
            "curves: no plane touches the curve at two points: there are no bitangent pairs",
            remedy="an edge surface needs a curve that turns back, such as a closed one",
        )
    return GeometryError(
        "curves: no plane touches both curves: there are no bitangent pairs",
        remedy="extend the curves, or place them so that a plane can roll along both",
    )


def _too_many(pairs: Pairs, filled: Filled) -> GeometryError:
    """The refusal where pairs fill an area."""
    s, t = filled.place
    if filled.whole:
        what = (
            "curves: the curve lies in a plane, which touches it everywhere"
            if pairs.same
            else "curves: any two points of the curves have a common tangent plane: they lie in "
            "one plane, or on one cone or cylinder"
        )
        return GeometryError(what, remedy="give curves that are not plane together")
    whose = "part of the curve is plane" if pairs.same else "these parts of the curves are coplanar"
    return GeometryError(
        f"curves: around the parameters {s:.6g} and {t:.6g} any two points have a common tangent "
        f"plane: {whose}",
        value=float(s),
        remedy="bend such a part, for instance as a spline through points (kind points)",
    )


def _tangled(unresolved: Unresolved) -> GeometryError:
    s, t = unresolved.place
    return GeometryError(
        f"curves: branches of pairs come too close to one another near the parameters {s:.6g} "
        f"and {t:.6g}",
        value=float(s),
        remedy="change the curve a little there: a symmetry may make several branches meet",
    )
