"""Curved creases: two chains of one sheet that meet along a curve, and how they fold together.

Along a curved crease both sides bend: with alpha the angle from the crease's osculating plane to
the tangent plane of either side, the sheet folds by 2 alpha, and the crease's curvature in the
pattern is kg = k cos(alpha), its normal curvature k sin(alpha) = kg tan(alpha). The rulings stay
where they are in the pattern while the crease folds exactly if sin(alpha) keeps its proportions
along it: from cot(beta_1) - cot(beta_2) = 2 alpha' / (kg tan(alpha)) both alpha and mu alpha give
one right-hand side when the logarithm of sin(alpha) has the same slope. Each side then bends by
lambda(t) c with lambda = tan(alpha_mu) / tan(alpha), sin(alpha_mu) = mu sin(alpha).

Source: geometry.md, 8 (Fuchs and Tabachnikov, Kilian and others) and 14; the proportion of
sin(alpha) is derived here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from devcad.geometry import taylor
from devcad.geometry.patch import Frame, FrameJet, Patch, RulingJet
from devcad.geometry.taylor import Array, rows_cross, rows_dot

Side = Literal["base", "top"]
Bending = Callable[[Array, int], Array]
"""t (n,) and an order K -> the series (K + 1, n) of what c is multiplied by."""


@dataclass(frozen=True, slots=True)
class Crease:
    """Where two patches of a sheet meet: the ``side`` edge of ``parent`` is the base curve (v = 0)
    of ``child``, ruling by ruling."""

    parent: Patch
    child: Patch
    side: Side

    def fold_angle(self, t: Array) -> Array:
        """The fold angle at t (n,) in radians: positive towards the front, a valley."""
        one, other = self.parent.frame(t), self.child.frame(t)
        along = tangent(other, np.zeros(len(t)))
        right, left = (one.n, other.n) if self.side == "base" else (other.n, one.n)
        return np.arctan2(rows_dot(rows_cross(right, left), along), rows_dot(right, left))

    def squared_sine(self, t: Array, order: int) -> Array:
        """The series of sin(alpha)^2, half the fold angle's, (order + 1, n)."""
        apart = self.parent.frame_jet(t, order).n - self.child.frame_jet(t, order).n
        return taylor.dot(apart, apart)[: order + 1] / 4.0

    def bending(self, mu: float) -> Bending:
        """By what c is multiplied on both sides where sin(alpha) is ``mu`` times what it is."""

        def share(t: Array, order: int) -> Array:
            square = self.squared_sine(t, order)
            one = taylor.constant(1.0, order, len(t))
            return mu * taylor.sqrt(taylor.div(one - square, one - mu**2 * square))

        return share

    def proportion(self, bending: float, t: float) -> float:
        """The mu at which c is multiplied by ``bending`` on the ruling t."""
        square = float(self.squared_sine(np.array([t]), 0)[0, 0])
        return float(bending / np.sqrt(1.0 - square + bending**2 * square))

    def mismatch(self, t: Array) -> Array:
        """How far the child's base curve is from the parent's edge at t (n,), mm."""
        return np.asarray(np.linalg.norm(self.crease(t) - self.child.point(t, 0.0 * t), axis=1))

    def crease(self, t: Array) -> Array:
        """The parent's edge at t (n,), (n, 3)."""
        jet = self.parent.jet(t, 0)
        return self.parent.point(t, (jet.v_from if self.side == "base" else jet.v_to)[0])

    def started(self, frame: Frame, slope: Array, angle: float) -> Frame:
        """The child's frame at its first ruling, beside the parent's first ``frame`` as it stands:
        folded by ``angle``. ``slope`` (1,) is that of the parent's edge, dv/dt."""
        v = frame.v_from if self.side == "base" else frame.v_to
        at = frame.c0 + v[:, None] * frame.e
        along = tangent(frame, v, slope)
        turn = angle if self.side == "base" else -angle
        n = np.cos(turn) * frame.n + np.sin(turn) * rows_cross(along, frame.n)
        rest = self.child.frame(frame.t)
        theta = np.arctan2(rest.q, rest.p)[:, None]
        e = np.cos(theta) * along - np.sin(theta) * rows_cross(n, along)
        zero = np.zeros(1)
        return Frame(
            frame.t, at, e, rows_cross(n, e), n, *(zero,) * 4, rest.v_from, rest.v_to, zero, zero
        )


def tangent(frame: Frame, v: Array, slope: Array | float = 0.0) -> Array:
    """The unit tangent (n, 3) of a curve at heights v (n,) that rise by ``slope`` = dv/dt."""
    x, y = frame.p + slope, frame.q + v * frame.a
    along = x[:, None] * frame.e + y[:, None] * frame.m
    return np.asarray(along / np.hypot(x, y)[:, None])


def heading(frame: Frame, v: Array, slope: Array | float = 0.0) -> Array:
    """The angle (n,) from the ruling to that tangent, in the sheet."""
    return np.arctan2(frame.q + v * frame.a, frame.p + slope)


def grooved(patch: Patch, side: Side, width: float) -> Patch:
    """The patch without what lies within ``width`` / 2 of its edge, square to the edge."""

    def field(t: Array, order: int) -> RulingJet:
        jet = patch.frame_jet(t, order + 1)
        ruling = jet.ruling
        v = ruling.v_from if side == "base" else ruling.v_to
        x, y = _along(jet, v)
        size = taylor.sqrt(taylor.mul(x, x) + taylor.mul(y, y))
        step = 0.5 * width * taylor.div(size, y)
        k = order + 1
        v_from, v_to = ruling.v_from[:k], ruling.v_to[:k]
        if side == "base":
            return RulingJet(ruling.c0[:k], ruling.e[:k], v_from + step[:k], v_to)
        return RulingJet(ruling.c0[:k], ruling.e[:k], v_from, v_to - step[:k])

    return Patch(field, patch.domain, patch.breaks, patch.causal)


def _along(jet: FrameJet, v: Array) -> tuple[Array, Array]:
    """The series of p + v' and q + v a, one order lower than the frame's."""
    slope = taylor.derivative(v)
    k = len(slope)
    return jet.p[:k] + slope, (jet.q + taylor.mul(v, jet.a))[:k]
