"""Derivatives of the energy against differences of eighth order."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hinged import PAPER, annulus, grid

from devcad.geometry.taylor import Array
from devcad.simulate import energy
from devcad.simulate.energy import Forces
from devcad.simulate.hinges import angles, chord_angle, gradients, hessians
from devcad.simulate.model import build
from devcad.simulate.topology import Sheet

LIMIT = 1e-8  # the issue's; what is left are the differences' own rounding and h^8


def difference(function: Callable[[float], Array | float], h: float) -> Array:
    """The derivative at 0 by central differences of eighth order."""
    weights = {1: 672.0, 2: -168.0, 3: 32.0, 4: -3.0}
    terms = [w * (np.asarray(function(k * h)) - function(-k * h)) for k, w in weights.items()]
    return np.asarray(sum(terms) / (840 * h))


@pytest.mark.parametrize("name", ["exact", "exact-shear", "woodruff-filipov", "filipov-2017"])
@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_gradient_and_hessian_of_a_crumpled_sheet(name: str, scale: float) -> None:
    flat, quads, number = grid(scale * np.arange(4.0), scale * np.linspace(0, 3, 5))
    sheet = Sheet(flat, quads, creases=number[[1, 1], [0, 1]][None] * 1)
    model = build(sheet, PAPER, length_scale=scale, coefficients=name)
    rng = np.random.default_rng(8)
    x = model.start + 0.1 * scale * rng.normal(size=model.start.shape)
    rest, near = model.rest(1.0), np.zeros(len(model.hinges))
    way = scale * rng.normal(size=x.shape) / np.sqrt(x.size)
    at = energy.state(model, x, near)
    slope = energy.gradient(model, at, rest)
    forces = Forces(at.stress, energy.moments(model, at, rest))
    curve = energy.hessian(model, energy.pattern(model), at, forces) @ way.reshape(-1)

    def level(s: float) -> float:
        there = energy.state(model, x + s * way, near)
        return sum(energy.energies(model, there, rest).values())

    def force(s: float) -> Array:
        return energy.gradient(model, energy.state(model, x + s * way, near), rest).reshape(-1)

    got = float(np.sum(slope * way))
    assert difference(level, 3e-3) == pytest.approx(got, abs=LIMIT * np.linalg.norm(slope) * scale)
    assert difference(force, 3e-3) == pytest.approx(curve, abs=LIMIT * np.max(np.abs(curve)))


def test_angles_bent_past_a_right_angle_and_their_derivatives() -> None:
    """Wings at any angle: the angle itself is the closed form, its derivatives differences."""
    folds = np.radians([-170, -100, -1e-3, 0.0, 60, 135, 179])
    one = np.tile([[0.0, 0, 0], [0, 2, 0], [1.5, 0.3, 0], [-0.7, 1.5, 0]], (len(folds), 1))
    points = one.reshape(-1, 4, 3)
    points[:, 2] = np.stack([1.5 * np.cos(folds), np.full(7, 0.3), 1.5 * np.sin(folds)], axis=1)
    hinges = np.arange(4 * len(folds)).reshape(-1, 4)
    x = points.reshape(-1, 3)
    assert angles(x, hinges) == pytest.approx(folds, abs=1e-15)  # the right wing rises: a valley
    way = np.cos(np.arange(x.size)).reshape(x.shape)
    slope = np.einsum("hki,hki->h", gradients(x, hinges), way[hinges])
    assert difference(lambda s: angles(x + s * way, hinges), 1e-3) == pytest.approx(
        slope, rel=LIMIT
    )
    curve = np.einsum("hkilj,hlj->hki", hessians(x, hinges), way[hinges])
    got = difference(lambda s: gradients(x + s * way, hinges), 1e-3)
    assert got == pytest.approx(curve, abs=LIMIT * np.max(np.abs(curve)))


def test_a_rigid_motion_costs_nothing() -> None:
    sheet, _ = annulus(6, across=2)
    model = build(sheet, PAPER, length_scale=0.1)
    rng = np.random.default_rng(1)
    x = model.start + 0.05 * rng.normal(size=model.start.shape)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    near, rest = np.zeros(len(model.hinges)), model.rest(0.5)
    here = energy.energies(model, energy.state(model, x, near), rest)
    there = energy.energies(model, energy.state(model, x @ turn.T + 3.0, near), rest)
    assert there == pytest.approx(here, rel=1e-11)  # rounding of coordinates near 3


def test_the_chord_angle_is_that_of_a_pyramid_about_the_folded_cone() -> None:
    """The folded ring's cones, cut by planes through rulings psi / cos(alpha) apart."""
    alpha, radius, psi = 0.6, 2.0, 0.3
    turn = psi / np.cos(alpha)
    ring = (
        radius
        * np.cos(alpha)
        * np.stack([np.cos([0, turn]), np.sin([0, turn]), np.zeros(2)], axis=1)
    )
    apex = radius * np.sin(alpha) * np.array([[0.0, 0, -1], [0.0, 0, 1]])
    outer = ring[0] + (ring[0] - apex[0])  # beyond the crease on the other cone
    got = angles(np.stack([ring[0], ring[1], outer, apex[1]]), np.array([[0, 1, 2, 3]]))
    wanted = chord_angle(
        np.array(alpha), np.array(1 / radius), np.array(2 * radius * np.sin(psi / 2))
    )
    assert abs(got[0]) == pytest.approx(float(wanted), rel=1e-14)
