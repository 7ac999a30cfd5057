"""Stretching: Green strains of bars, and what stiffness the bars of a flat sheet have.

The default is the natural triangle (J. H. Argyris, 1966): the three edges of a triangle are
bars, and a constant plane strain is known from their three strains, so that the energy is the
quadratic form e^T C e / 2 in them. The entry of C for the longest side of a right-angled half
of an H x W cell is E A_p t c with c = (H/W + W/H)^2 / (2 (1 + nu)): the exact-shear diagonal.
Bars alone are the diagonal of C. Central forces without coupling obey Cauchy's relation
C12 = C66, so plane stress is theirs for nu = 1/3 only; the entries off the diagonal are what
makes every uniform strain, every nu and every shape of triangle exact, and none of them can
make the form indefinite, as areas below zero would.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from devcad.errors import GeometryError
from devcad.geometry.taylor import Array
from devcad.simulate.material import Material

Indices = NDArray[np.int64]

HULL_FIT = (1.25, 0.5)  # a0 and a2 of the hull code's longest side, a0 + a2 AR^2


def sides(flat: Array, triangles: Indices) -> Array:
    """(m, 3, 2) the sides of triangles: side k runs from corner k to corner k + 1."""
    corners = flat[triangles]
    return np.asarray(np.roll(corners, -1, axis=1) - corners)


def areas(flat: Array, triangles: Indices) -> Array:
    """(m,) signed areas, > 0 counter-clockwise."""
    edge = sides(flat, triangles)
    return np.asarray(0.5 * (edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0]))


def natural(flat: Array, triangles: Indices, material: Material) -> Array:
    """Exact: (m, 3, 3) stiffness C of triangles in the Green strains of their sides, N mm.

    e_k = cx^2 Exx + cy^2 Eyy + cx cy Gxy for a side along (cx, cy): e = Q (Exx, Eyy, Gxy), and
    C = A Q^-T (plane stress) Q^-1. Equal to the constant-strain triangle with the
    St. Venant-Kirchhoff law; patch tests hold for any mesh.

    Source:
        Argyris, Continua and Discontinua (1966); the identity with the exact-shear coefficient
        is derived here and tested.
    """
    edge = sides(flat, triangles)
    cx, cy = np.moveaxis(edge / np.linalg.norm(edge, axis=2, keepdims=True), 2, 0)
    inverse = np.linalg.inv(np.stack([cx * cx, cy * cy, cx * cy], axis=2))
    form = np.swapaxes(inverse, 1, 2) @ material.plane_stress @ inverse
    return np.asarray(areas(flat, triangles)[:, None, None] * form)


def _with_longest(
    flat: Array, triangles: Indices, material: Material, longest: Callable[[Array, Array], Array]
) -> Array:
    """(m, 3, 3) diagonal forms: E A_p t for short sides, times ``longest`` on the longest."""
    length = np.linalg.norm(sides(flat, triangles), axis=2)
    order = np.argsort(length, axis=1, kind="stable")
    ranked = np.take_along_axis(length, order, axis=1)
    factor = np.ones_like(length)
    np.put_along_axis(factor, order[:, 2:], longest(ranked[:, 0], ranked[:, 1])[:, None], axis=1)
    one = material.youngs * material.thickness * np.abs(areas(flat, triangles))
    form = np.zeros((len(triangles), 3, 3))
    form[:, range(3), range(3)] = one[:, None] * factor
    return form


def exact_shear(flat: Array, triangles: Indices, material: Material) -> Array:
    """Bars alone, (m, 3, 3) diagonal: longest side c = (H/W + W/H)^2 / (2 (1 + nu)), N mm.

    Exact in shear of right-angled cells, too stiff along their sides.

    Source:
        derived in geometry.md, 8; H and W are taken as the two shorter sides.
    """
    twice = 2 * (1 + material.poisson)
    return _with_longest(
        flat, triangles, material, lambda h, w: np.asarray((h / w + w / h) ** 2 / twice)
    )


def hull_fit(flat: Array, triangles: Indices, material: Material) -> Array:
    """Bars alone, (m, 3, 3) diagonal: longest side 1.25 + 0.5 AR^2, AR = middle / shortest, N mm.

    Source:
        not the paper of Woodruff and Filipov (2020), whose text was not at hand, but the later
        hull code of the same group (a0 = 1.25, a1 = 0, a2 = 0.5); the paper may fit otherwise.
    """
    a0, a2 = HULL_FIT
    return _with_longest(
        flat, triangles, material, lambda short, middle: np.asarray(a0 + a2 * (middle / short) ** 2)
    )


def panel_areas(w: Array, h: Array, material: Material) -> tuple[Array, Array, Array]:
    """Areas (A_X, A_Y, A_D) in mm^2 of the bars of crossed panels w x h, each of the panels' shape.

    A_X is one of the two bars of length w, A_Y of length h, A_D a bar along a diagonal. Exact for
    uniform strains along the sides; the shear stiffness is 2 nu / (1 - nu) of the true one: exact
    for nu = 1/3 only. An area is negative where a side is sqrt(nu) of the other or less.

    Source:
        Filipov, Liu, Tachi, Schenk, Paulino, IJSS 124 (2017) 26-45, as geometry.md, 8 has it.
    """
    nu, t = material.poisson, material.thickness
    plane = 2 * (1 - nu * nu)
    return (
        np.asarray(t * (h * h - nu * w * w) / (h * plane)),
        np.asarray(t * (w * w - nu * h * h) / (w * plane)),
        np.asarray(nu * t * (h * h + w * w) ** 1.5 / (h * w * plane)),
    )


def crossed(flat: Array, quads: Indices, material: Material) -> tuple[Array, Array, Array]:
    """The ``panel_areas`` (m,) of quads, whose side 0-1 is w: w and h are means of opposite sides.

    Raises:
        GeometryError: a panel is so long that an area is not positive; none is clipped.
    """
    corners = flat[quads]
    length = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    w, h = (length[:, 0] + length[:, 2]) / 2, (length[:, 1] + length[:, 3]) / 2
    nu = material.poisson
    ratio = np.minimum(h / w, w / h)
    if nu <= 0 or np.any(ratio**2 <= nu):
        worst = int(np.argmin(ratio))
        raise GeometryError(
            f"crossed panel {worst} is {w[worst]:.4g} x {h[worst]:.4g} mm: its bars would have"
            f" areas that are not positive; sides may differ by at most 1 / sqrt(nu), nu > 0",
            value=float(ratio[worst]),
            limit=float(np.sqrt(max(nu, 0.0))),
            remedy='cells that are nearly square, or coefficients = "exact", which has no such'
            " limit",
        )
    return panel_areas(w, h, material)
