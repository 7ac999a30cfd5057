"""Patch: a developable strip as six functions of one parameter.

Every patch carries an orthonormal frame along a base curve c0(t): e the unit ruling, n the
surface normal, m = n x e, with (primes are d/dt)

    e' = a m      m' = -a e + c n      n' = -c m      c0' = p e + q m

and an extent v_from(t) <= v <= v_to(t) along the ruling; its points are P = c0(t) + v e(t).
A construction gives only c0 and e (and the extent) with their derivatives; n is computed here,
oriented so that q + v a > 0 on the open extent: +n is the front of the sheet.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from devcad.geometry import taylor
from devcad.geometry.deflation import deflated
from devcad.geometry.taylor import Array, rows_cross, rows_dot


@dataclass(frozen=True, slots=True)
class RulingJet:
    """Taylor series (derivatives divided by factorials) of order K at n parameters.

    c0 and e are (K + 1, n, 3), v_from and v_to (K + 1, n); e has unit length.
    """

    c0: Array
    e: Array
    v_from: Array
    v_to: Array

    def rail(self, v: Array) -> Array:
        """The series of the curve c0 + v e, v a scalar series of the same order."""
        return self.c0 + taylor.mul(v, self.e)


Field = Callable[[Array, int], RulingJet]


@dataclass(frozen=True, slots=True)
class Frame:
    """The six functions and what belongs to them, at n parameters.

    c0, e, m, n are (n, 3); all others (n,). ``residual_e`` = <e', n> and ``residual_c0`` =
    <c0', n> vanish on a developable; they are kept so that a patch can fail its own test.
    """

    t: Array
    c0: Array
    e: Array
    m: Array
    n: Array
    a: Array
    c: Array
    p: Array
    q: Array
    v_from: Array
    v_to: Array
    residual_e: Array
    residual_c0: Array


@dataclass(frozen=True, slots=True)
class FrameJet:
    """The Taylor series of the frame: e, m, n (K + 1, n, 3), a, c, p, q (K + 1, n)."""

    ruling: RulingJet
    m: Array
    n: Array
    a: Array
    c: Array
    p: Array
    q: Array


@dataclass(frozen=True, slots=True)
class Patch:
    """A tangent-plane continuous developable strip over ``domain`` = (t0, t1).

    ``field(t, order)`` gives the RulingJet at t (n,), on the closed domain. ``breaks`` are the
    interior parameters where the patch is less smooth than elsewhere (spline knots, line to
    arc); quadrature, fits and rulings break there. ``causal`` is "spacelike" or "timelike"
    when the construction was Minkowskian. ``inside_radius`` in mm is that of a bend made at once,
    about the ruling in the middle of its domain; None where the sheet is flat or rolled.
    """

    field: Field
    domain: tuple[float, float]
    breaks: tuple[float, ...] = ()
    causal: str | None = None
    inside_radius: float | None = None

    @property
    def ends(self) -> tuple[float, ...]:
        """The domain's ends with the breaks between them, increasing."""
        return (self.domain[0], *self.breaks, self.domain[1])

    @property
    def segments(self) -> Array:
        """The domain's ends with the breaks between them, increasing, (k + 1,)."""
        return np.array(self.ends)

    def jet(self, t: npt.ArrayLike, order: int) -> RulingJet:
        """The Taylor series of c0, e and the extent at t, (n,) or a number."""
        return self.field(np.atleast_1d(np.asarray(t, dtype=float)), order)

    def frame(self, t: npt.ArrayLike) -> Frame:
        """The frame and its coefficients at t, (n,) or a number.

        Where q + v a vanishes all along the ruling, n and c are limits at an end of the domain
        (a tip) and nan elsewhere; that the result is regular is not checked here.
        """
        t = np.atleast_1d(np.asarray(t, dtype=float))
        jet = self.field(t, 2)
        e, de, dde = jet.e[0], jet.e[1], 2.0 * jet.e[2]
        dc0, ddc0 = jet.c0[1], 2.0 * jet.c0[2]
        inside = _inner_height(jet)[:, None]
        tangent = dc0 + inside * de
        normal = rows_cross(e, tangent)
        with np.errstate(invalid="ignore", divide="ignore"):
            width = np.linalg.norm(normal, axis=1)
            n = normal / width[:, None]
            m = rows_cross(n, e)
            c = rows_dot(ddc0 + inside * dde, n) / width
        for end in deflated(self.field, self.ends, 1):
            near = end.near(t)
            if near.any():
                w = end.series(t[near], 1)
                size = np.linalg.norm(w[0], axis=1)
                n[near] = w[0] / size[:, None]
                m[near] = rows_cross(n[near], e[near])
                c[near] = -rows_dot(w[1], m[near]) / size
        return Frame(
            t,
            jet.c0[0],
            e,
            m,
            n,
            rows_dot(de, m),
            c,
            rows_dot(dc0, e),
            rows_dot(dc0, m),
            jet.v_from[0],
            jet.v_to[0],
            rows_dot(de, n),
            rows_dot(dc0, n),
        )

    def frame_jet(self, t: npt.ArrayLike, order: int) -> FrameJet:
        """The Taylor series of the frame and its coefficients at t, to the given order."""
        t = np.atleast_1d(np.asarray(t, dtype=float))
        jet = self.field(t, order + 2)
        de, dc0 = taylor.derivative(jet.e), taylor.derivative(jet.c0)
        e = jet.e[: order + 2]
        w = taylor.cross(e, dc0 + _inner_height(jet)[None, :, None] * de)
        for end in deflated(self.field, self.ends, order + 1):
            near = end.near(t)
            if near.any():
                w[:, near] = end.series(t[near], order + 1)
        n = taylor.unit(w)
        m = taylor.cross(n, e)
        k = order + 1
        return FrameJet(
            RulingJet(jet.c0[:k], jet.e[:k], jet.v_from[:k], jet.v_to[:k]),
            m[:k],
            n[:k],
            taylor.dot(de, m)[:k],
            -taylor.dot(taylor.derivative(n), m[:k]),
            taylor.dot(dc0, e)[:k],
            taylor.dot(dc0, m)[:k],
        )

    def point(self, t: npt.ArrayLike, v: npt.ArrayLike) -> Array:
        """The points c0(t) + v e(t), shape (n, 3), for t and v of one shape (n,)."""
        jet = self.jet(t, 0)
        return np.asarray(jet.c0[0] + np.asarray(v, dtype=float)[..., None] * jet.e[0])

    def restricted(self, t0: float, t1: float) -> Patch:
        """The part over [t0, t1], inside the domain."""
        return replace(self, domain=(t0, t1), breaks=tuple(b for b in self.breaks if t0 < b < t1))

    def transformed(self, matrix: Array, factor: float = 1.0) -> Patch:
        """The patch moved by the rotation or reflection ``matrix`` (4, 4) after scaling by
        ``factor`` about the origin; a reflection turns the front to the mirrored side."""
        linear, shift = matrix[:3, :3], matrix[:3, 3]

        def field(t: Array, order: int) -> RulingJet:
            jet = self.field(t, order)
            c0 = factor * (jet.c0 @ linear.T)
            c0[0] += shift
            return RulingJet(c0, jet.e @ linear.T, factor * jet.v_from, factor * jet.v_to)

        return replace(self, field=field)

    def scaled(self, factor: float) -> Patch:
        """The patch scaled about the origin."""
        return self.transformed(np.eye(4), factor)

    def parallel(self, distance: float) -> Patch:
        """The parallel surface at ``distance`` along n: c0 -> c0 + d n, hence q -> q - d c."""

        def field(t: Array, order: int) -> RulingJet:
            frame = self.frame_jet(t, order)
            jet = frame.ruling
            return replace(jet, c0=jet.c0 + distance * frame.n)

        return replace(self, field=field)


def _inner_height(jet: RulingJet) -> Array:
    """A height v inside the extent where the tangent plane is well defined, (n,).

    Half way, or at 5/8 where the tangent across the ruling is not larger half way: on a strip
    that crosses its regression curve one of the two may be the singular point itself.
    """
    half = 0.5 * (jet.v_from[0] + jet.v_to[0])
    other = 0.375 * jet.v_from[0] + 0.625 * jet.v_to[0]
    # e x P_t is linear in v: two vector products serve both heights
    still, moving = rows_cross(jet.e[0], jet.c0[1]), rows_cross(jet.e[0], jet.e[1])
    at_half, at_other = still + half[:, None] * moving, still + other[:, None] * moving
    wide = rows_dot(at_half, at_half) >= 0.25 * rows_dot(at_other, at_other)
    return np.asarray(np.where(wide, half, other))
