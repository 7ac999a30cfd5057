"""Nodes of the zero set of a function of two parameters: where several branches cross.

Value and gradient vanish there. Two branches cross along the directions in which the Hessian,
three along those in which the third derivative vanishes when the Hessian does too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from devcad.geometry.taylor import Array

NODE = 1e-11
"""A critical value, against Hessian x cell^2, that counts as zero: branches cross there."""
LOWEST = 1e-9
"""A form below this share of the others vanishes."""


class Height(Protocol):
    """A smooth function f of (s, t)."""

    def value(self, s: Array, t: Array) -> Array:
        """f at n places, (n,)."""

    def slopes(self, s: Array, t: Array) -> tuple[Array, Array]:
        """f and its gradient, (n,) and (n, 2)."""

    def bends(self, s: Array, t: Array) -> tuple[Array, Array, Array]:
        """f, gradient and Hessian, (n,), (n, 2) and (n, 2, 2)."""

    def towards(self, s: Array, t: Array, ds: float, dt: float, order: int) -> Array:
        """The Taylor series (order + 1, n) of f in x along (s + x ds, t + x dt)."""


@dataclass(frozen=True, slots=True)
class Node:
    """A place (2,) where branches cross, and their directions (k, 2), as rows.

    ``degree``: that of the lowest form of the function there; it vanishes along the directions.
    """

    place: Array
    directions: Array
    degree: int


def nodes(height: Height, start: Array, size: Array) -> list[Node]:
    """The nodes within three cells of places (n, 2), cells of ``size`` (n, 2) around them.

    By Newton's method on the gradient; where it is slow, three branches may cross.
    """
    found: list[Node] = []
    at = start
    for _ in range(9):
        _, gradient, hessian = height.bends(*at.T)
        step = solved(hessian, -gradient)
        near = np.all(np.abs(step) < 2.0 * size, axis=1)
        near &= np.all(np.abs(at + step - start) < 3.0 * size, axis=1)
        at, start, size, step = at[near], start[near], size[near], step[near]
        at = at + step
        if not len(at):
            return found
    settled = np.all(np.abs(step) <= 1e-9 * size, axis=1)
    slow = ~settled & np.all(np.abs(step) <= 0.1 * size, axis=1)
    tried = np.zeros((0, 2))
    for k in [*np.flatnonzero(settled), *np.flatnonzero(slow)]:
        cells = 1e-6 if settled[k] else 3.0
        if np.all(np.abs(tried - at[k]) < cells * size[k], axis=1).any():
            continue
        tried = np.append(tried, at[k : k + 1], axis=0)
        degree = 2 if settled[k] else 3
        place = at[k] if degree == 2 else _flattest(height, at[k], size[k])
        node = None if place is None else _node(height, place, degree, size[k])
        if node is not None:
            found.append(node)
    return found


def _node(height: Height, place: Array, degree: int, size: Array) -> Node | None:
    """The node of ``degree`` branches at a place, None where the function does not vanish, or
    where less than that many branches go through."""
    form = _form(height, place, degree, size)
    largest = np.abs(form).max()
    lower = [np.abs(_form(height, place, k, size)).max() for k in range(degree - 1)]
    if max(lower) > NODE * largest:
        return None
    ways = _ways(form, size)
    return Node(place, ways, degree) if len(ways) == degree else None


def node_at(height: Height, place: Array, size: Array) -> Node | None:
    """The node at a place where value and gradient vanish, also if not all its directions are
    real; None if none is."""
    forms = {k: _form(height, place, k, size) for k in (2, 3, 4)}
    largest = max(float(np.abs(form).max()) for form in forms.values())
    for degree, form in forms.items():
        if np.abs(form).max() > LOWEST * largest:
            ways = _ways(form, size)
            return Node(place, ways, degree) if len(ways) else None
    return None


def _ways(form: Array, size: Array) -> Array:
    """The real directions (k, 2) in which a form vanishes."""
    lead = 0.7  # turned, so that no direction is at infinity
    turn = np.array([[np.cos(lead), -np.sin(lead)], [np.sin(lead), np.cos(lead)]])
    roots = np.roots(_turned(form, turn))
    real = np.abs(roots.imag) < 1e-6 * np.maximum(1.0, np.abs(roots))
    ways = np.column_stack([np.ones(real.sum()), roots[real].real]) @ turn.T * size
    return np.asarray(ways / np.linalg.norm(ways, axis=1)[:, None])


def _form(height: Height, place: Array, degree: int, size: Array) -> Array:
    """The terms of one degree at a place, by powers of dt: (degree + 1,), in units of ``size``."""
    angles = (np.arange(degree + 1) + 0.3) * np.pi / (degree + 1)
    ways = np.column_stack([np.cos(angles), np.sin(angles)])
    s, t = place[:1], place[1:]
    order = max(degree, 1)
    values = [
        height.towards(s, t, float(ds), float(dt), order)[degree, 0] for ds, dt in ways * size
    ]
    powers = ways[:, :1] ** np.arange(degree, -1, -1) * ways[:, 1:] ** np.arange(degree + 1)
    return np.asarray(np.linalg.solve(powers, np.array(values)))


def _turned(form: Array, turn: Array) -> Array:
    """The coefficients, highest power of y first, of a form along turn @ (1, y)."""
    degree = len(form) - 1
    y = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    ways = np.column_stack([np.ones(degree + 1), y]) @ turn.T
    values = form * ways[:, :1] ** np.arange(degree, -1, -1) * ways[:, 1:] ** np.arange(degree + 1)
    return np.asarray(np.linalg.solve(np.vander(y), values.sum(axis=1)))


def _flattest(height: Height, place: Array, size: Array) -> Array | None:
    """The place nearby where all second derivatives vanish, by the method of Gauss and Newton."""
    start = place
    for _ in range(12):
        a, b, c = _form(height, place, 2, size)
        f0, f1, f2, f3 = _form(height, place, 3, size)
        matrix = np.array([[3.0 * f0, f1], [2.0 * f1, 2.0 * f2], [f2, 3.0 * f3]])
        step = np.linalg.lstsq(matrix, -np.array([a, b, c]), rcond=None)[0]
        place = place + step * size
        if not (np.abs(place - start) < 3.0 * size).all():
            return None
    return place if np.abs(step).max() <= 1e-9 else None


def solved(matrix: Array, right: Array) -> Array:
    """The solutions of 2 x 2 systems, (n, 2); huge where a matrix is singular."""
    (a, b), (c, d) = matrix[:, 0].T, matrix[:, 1].T
    det = a * d - b * c
    with np.errstate(all="ignore"):
        out = np.column_stack(
            [d * right[:, 0] - b * right[:, 1], a * right[:, 1] - c * right[:, 0]]
        )
        out = out / det[:, None]
    return np.where(np.isfinite(out), out, 1e300)
