"""Lorentzian unrolling: the metric that Minkowski space induces on a surface, laid out in a plane.

A figure for geometers, not for cutting: what a sheet unrolls to is its Euclidean development. With
the unit direction ``time`` the metric is <x, y> = x . y - 2 (x . time)(y . time). A spacelike
surface goes into the Euclidean plane, where it may overlap itself (a cone's sector may exceed a
full turn); a timelike one into the Minkowski plane dx^2 - dw^2, w upwards, x to the right.

Source: geometry.md, 0.1 and 1; O'Neill, Semi-Riemannian Geometry, chapters 3 and 4.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np

from devcad.errors import GeometryError
from devcad.flatten.border import border
from devcad.flatten.green import bounds
from devcad.flatten.outline import integral, reference_lines
from devcad.flatten.pattern import Pattern
from devcad.geometry import chebyshev
from devcad.geometry.chain import Chain
from devcad.geometry.chebyshev import Piecewise
from devcad.geometry.patch import Frame, Patch
from devcad.geometry.taylor import Array

STEEPEST = 30.0
"""A boost by more than this shears a figure by e^30, which leaves no digits to draw."""
LIGHTLIKE = 1e-12
"""<e, e> or the determinant up to which a ruling or a tangent plane is lightlike, to rounding."""
SEEN = 1025
"""Places where the sign of the metric and the turning are looked at."""


@dataclass(frozen=True, slots=True)
class Spacetime:
    """A chain in Minkowski space, whose time axis points along ``time`` (3,), unit."""

    chain: Chain
    time: Array


@dataclass(frozen=True, slots=True)
class Induced:
    """The induced metric in the Euclidean frame (e, m) of each ruling, (n,).

    ``along`` = <e, e>, ``lean`` = <e, m>, ``det`` = <e, e><m, m> - <e, m>^2, which is positive
    where the surface is spacelike and negative where it is timelike.
    """

    along: Array
    lean: Array
    det: Array


@dataclass(frozen=True, slots=True)
class Unrolling:
    """A patch in its plane: e and m go to frame[0] and frame[1], turned or boosted by omega.

    ``series`` has omega, X, Y (the image of c0) and length, shear, width: the image of e is
    length times the first unit vector, that of m is shear times the first and width times the
    second. ``frame`` (2, 2) are the unit vectors at omega = 0; ``sign`` is -1 where omega is an
    angle (Euclidean plane) and +1 where it is a rapidity (Minkowski plane).
    """

    series: Piecewise
    frame: Array
    sign: float

    def axes(self, t: Array) -> tuple[Array, Array, Array]:
        """The images of c0(t), e(t) and m(t), each (n, 2); those of e and m are not unit."""
        at = self.series(t)
        first, second = _turned(at[:, 0], self.frame, self.sign)
        length, shear, width = at[:, 3:4], at[:, 4:5], at[:, 5:6]
        return at[:, 1:3], length * first, shear * first + width * second

    def points(self, t: Array, v: Array) -> Array:
        """The images of the surface points (t, v), each (n,), shape (n, 2)."""
        origin, e, _ = self.axes(t)
        return np.asarray(origin + v[:, None] * e)

    def placed(self, omega: float, origin: Array) -> Unrolling:
        """The unrolling turned (or boosted) and moved to start with ``omega`` at ``origin``."""
        table = self.series.coefficients.copy()
        table[..., 1:3] = table[..., 1:3] @ _matrix(omega, self.sign).T
        table[:, 0, 0] += omega
        table[:, 0, 1:3] += origin
        return replace(self, series=replace(self.series, coefficients=table))


def induced(frame: Frame, time: Array) -> Induced:
    """The metric that Minkowski space induces on the surface, in the frame (e, m)."""
    e, m = frame.e @ time, frame.m @ time
    return Induced(1.0 - 2.0 * e**2, -2.0 * e * m, 1.0 - 2.0 * (e**2 + m**2))


def lorentz_area(surface: Spacetime) -> float:
    """The area of the induced metric in mm2: the integral of sqrt|det g| over all patches."""

    def density(f: Frame) -> Array:
        strip = f.q * (f.v_to - f.v_from) + 0.5 * f.a * (f.v_to**2 - f.v_from**2)
        return np.asarray(np.sqrt(np.abs(induced(f, surface.time).det)) * strip)

    return sum(integral(patch, density) for patch in surface.chain.patches)


def lorentz_pattern(surface: Spacetime, rulings: tuple[Array, ...]) -> Pattern:
    """The Lorentzian unrolling of a chain: outline, reference rulings, area and box.

    At the start c0 is the origin and e points along +x (upwards, along w, where it is timelike);
    the front faces the viewer. Lengths are Lorentz lengths in mm. It may overlap itself.

    Raises:
        GeometryError: the metric changes its type within a patch or from one to the next, a
            ruling is lightlike, or the boosts are too large to draw.
    """
    unrolled = unroll_chain(surface)
    patches = surface.chain.patches
    fine = [_divided(patch, plane) for patch, plane in zip(patches, unrolled, strict=True)]
    outline = border(list(zip(fine, unrolled, strict=True)))
    pairs = list(zip(patches, unrolled, strict=True))
    lines = reference_lines(surface.chain, pairs, rulings)
    return Pattern(outline, lines, lorentz_area(surface), bounds(outline))


def unroll_chain(surface: Spacetime) -> tuple[Unrolling, ...]:
    """The unrollings of a chain's patches, each laid on along the ruling it shares."""
    out: list[Unrolling] = []
    omega, origin = 0.0, np.zeros(2)
    for k, patch in enumerate(surface.chain.patches):
        here = unroll(patch, surface.time)
        if out:
            if not np.array_equal(here.frame, out[0].frame) or here.sign != out[0].sign:
                _refuse("it is another one from one patch to the next", float(patch.domain[0]))
            start = here.placed(omega, origin).axes(np.array(patch.domain[:1]))
            origin = origin + surface.chain.joints[k - 1].shift * start[1][0]
        here = here.placed(omega, origin)
        end = here.series(np.array([patch.domain[1]]))[0]
        omega, origin = float(end[0]), end[1:3]
        out.append(here)
    return tuple(out)


def unroll(patch: Patch, time: Array) -> Unrolling:
    """The isometry of a patch's induced metric into a plane, by quadrature to rounding.

    In the Lorentz-unit frame e_L = e / length, m_L = (m - shear / length e) / width the rates are
    a_L = a width / length, p_L = p length + q shear, q_L = q width; then omega' = a_L (with the
    sign of the plane's frame), and (X, Y)' is (p_L, q_L) in the frame turned by omega.

    Raises:
        GeometryError: the metric changes its type, a ruling is lightlike, or the boost is too
            large to draw.
    """
    signs = _signs(patch, time)
    sign = -signs[1]
    frame = np.eye(2) if signs[0] > 0.0 else np.array([[0.0, 1.0], [-1.0, 0.0]])
    knots = patch.segments
    span = knots[-1] - knots[0]

    def sample(t: Array, _low: float, _high: float) -> Array:
        f = patch.frame(t)
        metric = induced(f, time)
        length = np.sqrt(np.abs(metric.along))
        width = np.sqrt(np.abs(metric.det)) / length
        shear = metric.lean / metric.along * length
        rate = f.a * width / length
        reach = np.maximum(np.abs(f.v_from), np.abs(f.v_to)) * f.a * width
        rates = [signs[0] * rate if sign > 0.0 else rate, f.p * length + f.q * shear, f.q * width]
        return np.column_stack([*rates, length, shear, width, reach])

    def lift(raw: Array, half: float) -> Array:
        omega = half * (chebyshev.integration_of_values(len(raw)) @ raw[:, 0])
        first, second = _turned(np.clip(omega, -700.0, 700.0), frame, sign)
        path = raw[:, 1:2] * first + raw[:, 2:3] * second
        return np.column_stack([raw[:, 0], path, raw[:, 3:6]])

    def scale(raw: Array) -> Array:
        seen = np.abs(raw).max(axis=0)
        far, size = max(seen[1], seen[2], seen[6]), max(seen[3], seen[5])
        return np.array([1.0 / span, far, far, size, size, size])

    with np.errstate(over="ignore", invalid="ignore"):  # a huge boost: refused below
        series = _assemble(chebyshev.resolve_by(sample, lift, knots, scale=scale), sign)
    unrolled = Unrolling(series, frame, sign)
    if sign > 0.0:
        _require_drawable(patch, unrolled)
    return unrolled


def _signs(patch: Patch, time: Array) -> tuple[float, float]:
    """The signs of <e, e> and of the determinant, which they keep all along the patch."""
    t = np.unique(np.concatenate([np.linspace(*patch.domain, SEEN), patch.segments]))
    t[0], t[-1] = np.nextafter(t[0], t[-1]), np.nextafter(t[-1], t[0])
    metric = induced(patch.frame(t), time)
    middle = len(t) // 2
    for values, what in (
        (metric.det, "the tangent plane is lightlike"),
        (metric.along, "the ruling is lightlike"),
    ):
        kept = values * np.sign(values[middle]) > LIGHTLIKE
        if not kept.all():
            _refuse(f"{what} or changes its type", float(t[int(np.argmin(kept))]))
    return float(np.sign(metric.along[middle])), float(np.sign(metric.det[middle]))


def _refuse(what: str, t: float) -> NoReturn:
    raise GeometryError(
        f"the induced metric has no unrolling: {what} at t = {t:.6g}",
        value=t,
        remedy="end the curve before that point, or leave out lorentz-svg",
    )


def _require_drawable(patch: Patch, unrolled: Unrolling) -> None:
    omega = unrolled.series(np.linspace(*patch.domain, SEEN))[:, 0]
    boost = float(np.nan_to_num(np.abs(omega), nan=np.inf).max())
    if not boost <= STEEPEST:
        raise GeometryError(
            f"the Lorentzian unrolling boosts its rulings by the rapidity {boost:.4g}, "
            f"limit {STEEPEST:g}",
            value=boost,
            limit=STEEPEST,
            remedy="draw a shorter piece of the curve, or leave out lorentz-svg",
        )


def _divided(patch: Patch, unrolled: Unrolling) -> Patch:
    """The patch with more breaks, so that no piece of its edges turns by more than half a turn:
    an arc of more than a full turn is then still seen to be one."""
    if unrolled.sign > 0.0:
        return patch
    t = np.linspace(*patch.domain, SEEN)
    turned = np.cumsum(np.abs(np.diff(unrolled.series(t)[:, 0])))
    at = t[1:][np.diff(np.floor(turned / np.pi), prepend=0.0) > 0.0]
    apart = np.abs(at[:, None] - patch.segments).min(axis=1) > 1e-6 * (t[-1] - t[0])
    return replace(patch, breaks=tuple(sorted([*patch.breaks, *at[apart].tolist()])))


def _assemble(rates: Piecewise, sign: float) -> Piecewise:
    """Panels' own turning and path, each from its own start, joined into one."""
    half = 0.5 * np.diff(rates.knots)
    size = rates.coefficients.shape[1]
    table = np.zeros((len(half), size + 1, 6))
    moving = np.einsum("ij,pjd->pid", chebyshev.integration(size), rates.coefficients[..., :3])
    table[..., :3] = half[:, None, None] * moving
    table[:, :size, 3:] = rates.coefficients[..., 3:]
    omega, origin = 0.0, np.zeros(2)
    for panel in table:
        panel[:, 1:3] = panel[:, 1:3] @ _matrix(omega, sign).T
        turn, *step = panel[:, :3].sum(axis=0)  # T_k(1) = 1: turning and displacement
        panel[0, 0] += omega
        panel[0, 1:3] += origin
        omega, origin = omega + turn, origin + step
    return Piecewise(rates.knots, table, rates.samples)


def _matrix(omega: float, sign: float) -> Array:
    """The rotation by omega (sign -1) or the boost (sign +1), (2, 2)."""
    cosine, sine = (float(x) for x in _waves(np.array(omega), sign))
    return np.array([[cosine, sign * sine], [sine, cosine]])


def _turned(omega: Array, frame: Array, sign: float) -> tuple[Array, Array]:
    """The two unit vectors of a frame turned or boosted by omega (n,), each (n, 2)."""
    cosine, sine = _waves(omega, sign)
    first, second = (
        np.stack([x * cosine + sign * y * sine, x * sine + y * cosine], axis=1) for x, y in frame
    )
    return first, second


def _waves(omega: Array, sign: float) -> tuple[Array, Array]:
    return (np.cosh(omega), np.sinh(omega)) if sign > 0.0 else (np.cos(omega), np.sin(omega))
