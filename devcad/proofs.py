"""The geometric checks of a panel: what its surface and its pattern prove (design.md, 7)."""

from __future__ import annotations

import numpy as np

from devcad.checks import Check, Where, at_most
from devcad.flatten.blank import Blank
from devcad.flatten.outline import integral
from devcad.flatten.verify import fold_back, isometry, overlap_area
from devcad.geometry.chain import Chain
from devcad.geometry.classify import EXACT
from devcad.geometry.layers import at_apex
from devcad.geometry.patch import Frame, Patch
from devcad.geometry.rail_fit import RailFit
from devcad.geometry.regularity import (
    STRAIGHT,
    Clearance,
    Extreme,
    clearance,
    twist,
)
from devcad.geometry.taylor import Array
from devcad.mesh.build import volume
from devcad.mesh.mesh import Mesh
from devcad.part import Panel

TWIST_LIMIT_DEG = 0.01
CREASE_LIMIT_DEG = 0.1
ISOMETRY_LIMIT = 1e-9
FOLD_BACK_LIMIT = 1e-8  # 1e-6 mm on 100 mm
OVERLAP_LIMIT = 1e-9


def prove_surface(
    name: str,
    chain: Chain,
    layers: tuple[float, ...],
    *,
    reaches_apex: bool,
    fit: RailFit | None = None,
) -> list[Check]:
    """The checks ``twist`` and ``regular`` of a chain, from c0 and e before anything else, and
    ``crease`` where the surface was looked for between rails."""
    creased = [] if fit is None else [_crease(name, fit)]
    return [
        _twist(name, chain, fit),
        *creased,
        _regular(name, chain, layers, reaches_apex=reaches_apex),
    ]


def prove_pattern(panel: Panel, blank: Blank, *, tolerance: float) -> list[Check]:
    """The checks isometry, mesh-deviation, fold-back and overlap."""
    every = zip(blank.middle.patches, blank.developments, blank.fibres, strict=True)
    patch, worst = _worst((p, isometry(p, d, f)) for p, d, f in every)
    return [
        at_most(
            "isometry",
            panel.name,
            worst.value,
            ISOMETRY_LIMIT,
            "",
            where=_where(patch, worst),
            says=f"the pattern's metric differs by {worst.value:.3g} at t = {worst.t:.6g}",
            remedy="the curve may be rougher than its pieces say; give it as points or a chain",
        ),
        _mesh_deviation(panel, tolerance),
        _fold_back(panel, blank),
        overlap(panel),
    ]


def _crease(name: str, fit: RailFit) -> Check:
    return at_most(
        "crease",
        name,
        fit.crease,
        CREASE_LIMIT_DEG,
        "deg",
        says=f"the sheet folds by {fit.crease:.4g} deg where no rail has a corner",
        remedy=fit.advice,
    )


def _twist(name: str, chain: Chain, fit: RailFit | None) -> Check:
    patch, worst = _worst((p, twist(p)) for p in chain.patches)
    degrees = float(np.degrees(worst.value))
    return at_most(
        "twist",
        name,
        degrees if np.isfinite(degrees) else float("inf"),
        fit.max_twist if fit is not None and fit.max_twist is not None else TWIST_LIMIT_DEG,
        "deg",
        where=_where(patch, worst),
        says=f"not developable at t = {worst.t:.6g}: the tangent plane turns {degrees:.4g} deg "
        "along the ruling",
        remedy=(fit.advice if fit is not None else "")
        or "choose rulings along which both boundary tangents and the ruling lie in one plane",
    )


def _regular(name: str, chain: Chain, layers: tuple[float, ...], *, reaches_apex: bool) -> Check:
    stands = [(p, clearance(p, layers, to_apex=reaches_apex)) for p in chain.patches]
    patch, worst = min(stands, key=lambda pair: (pair[1].value, pair[1].touches))
    thick = layers != (0.0,)
    passed = worst.value > 0.0 or (worst.touches and not thick)
    return Check(
        "regular",
        name,
        worst.value,
        0.0,
        "mm",
        passed,
        _where(patch, Extreme(worst.value, worst.t, worst.v)),
        _irregular(patch, worst, thick=thick),
        _regular_remedy(patch, worst, thick=thick),
    )


def _irregular(patch: Patch, worst: Clearance, *, thick: bool) -> str:
    """How the sheet comes to be singular, in words."""
    if worst.value == -np.inf:
        return f"the ruling at t = {worst.t:.6g} has no tangent plane: nothing turns there"
    if worst.value == 0.0 and not worst.touches:
        return f"the ruling at t = {worst.t:.6g} is singular all along: the front turns over there"
    layer = "a skin of the sheet" if thick else "the extent"
    if _edge_height(patch, worst.t) is None:
        return (
            f"{layer} reaches its centre of curvature at t = {worst.t:.6g}: {worst.value:.4g} mm "
            "are left on the inside of the bend"
        )
    crossing = "crosses" if worst.value < 0.0 else "lies on"
    return (
        f"{layer} {crossing} the regression curve at t = {worst.t:.6g}: "
        f"{worst.value:.4g} mm along the ruling"
    )


def _edge_height(patch: Patch, t: float) -> float | None:
    """v of the regression curve at t; None where the ruling does not turn."""
    frame = patch.frame([t])
    a, q = float(frame.a[0]), float(frame.q[0])
    reach = max(abs(float(frame.v_from[0])), abs(float(frame.v_to[0])))
    if not np.isfinite(a) or abs(a) * reach <= STRAIGHT * (abs(q) + abs(a) * reach):
        return None
    return -q / a if abs(q) > EXACT * abs(a) * reach else 0.0


def _regular_remedy(patch: Patch, worst: Clearance, *, thick: bool) -> str:
    """Where the regression curve lies, as a limit for the extent."""
    if worst.value == 0.0 and not worst.touches:
        return "split the curve there"
    edge = _edge_height(patch, worst.t)
    if edge is None:
        return "bend less sharply, or use a thinner sheet" if thick else "give a curve that bends"
    thinner = ", or use a thinner sheet" if thick else ""
    return f"keep the extent on one side of v = {edge:.6g} mm there{thinner}"


def _mesh_deviation(panel: Panel, tolerance: float) -> Check:
    return at_most(
        "mesh-deviation",
        panel.name,
        panel.mesh.deviation,
        tolerance,
        "mm",
        says=f"the triangles are {panel.mesh.deviation:.4g} mm from the surface",
        remedy="raise the tolerance",
    )


def _fold_back(panel: Panel, blank: Blank) -> Check:
    worst, size = fold_back(blank.middle, blank.developments, panel.pattern, blank.fibres)
    return at_most(
        "fold-back",
        panel.name,
        worst.value,
        FOLD_BACK_LIMIT * size,
        "mm",
        where=Where(worst.t, worst.v),
        says=f"the pattern folded up again misses the surface by {worst.value:.3g} mm "
        f"at t = {worst.t:.6g}",
        remedy="the surface bends too suddenly there; smooth or split its curve",
    )


def overlap(panel: Panel) -> Check:
    """The check overlap: that no two places of a panel are cut from one."""
    area = overlap_area(panel.pattern)
    half = 0.5 * (panel.chain.patches[0].domain[0] + panel.chain.patches[-1].domain[1])
    return at_most(
        "overlap",
        panel.name,
        area,
        OVERLAP_LIMIT * panel.pattern.area,
        "mm2",
        says=f"the pattern covers {area:.4g} mm2 twice",
        remedy=f"split the panel in two, for instance at t = {half:.6g}",
    )


def sheet_volume(panel: Panel) -> float:
    """The exact volume of a panel in mm3: net area x thickness and what an apex adds."""
    return sum(
        flank.area * panel.thickness + _tips(flank.chain, panel.thickness) for flank in panel.chains
    )


def volume_error(mesh: Mesh, chain: Chain, area: float, thickness: float) -> float:
    """How far a solid's mesh is from the volume of a sheet of this area, per unit of the area, mm;
    0 of a sheet without thickness."""
    if not mesh.watertight:
        return 0.0
    return abs(volume(mesh) - area * thickness - _tips(chain, thickness)) / area


def _tips(chain: Chain, thickness: float) -> float:
    """At an apex every layer ends by itself where q + v a = d c, which adds
    (T^3 / 24) * integral of c^2 / |a| dt (design.md, section 7)."""
    total = 0.0
    for patch in chain.patches if thickness else ():
        frame = patch.frame(np.linspace(*patch.domain, 17)[1:-1])
        if at_apex(frame, frame.v_from) or at_apex(frame, frame.v_to):
            total += thickness**3 / 24.0 * integral(patch, _tip_density, scale=1e-3)
    return total


def _tip_density(frame: Frame) -> Array:
    return np.asarray(frame.c**2 / np.abs(frame.a))


def mesh_volume(panel: Panel, tolerance: float) -> Check:
    """The check ``volume`` of a solid's mesh: the exact volume, within area x tolerance."""
    area = panel.area
    value = abs(volume(panel.mesh) - sheet_volume(panel))
    return at_most(
        "volume",
        panel.name,
        value,
        area * tolerance,
        "mm3",
        says=f"the mesh holds {value:.4g} mm3 more or less than the sheet",
        remedy="give a finer tolerance",
    )


def _worst(pairs: object) -> tuple[Patch, Extreme]:
    return max(pairs, key=lambda pair: np.nan_to_num(pair[1].value, nan=np.inf))  # type: ignore


def _where(patch: Patch, place: Extreme) -> Where:
    x, y, z = (float(c) for c in patch.point([place.t], [place.v])[0])
    return Where(place.t, place.v, (x, y, z))
