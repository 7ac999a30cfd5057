"""Sheets that the tests of the bar-and-hinge model fold: grids, bent grids, a truss."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from devcad.geometry.taylor import Array
from devcad.simulate.bars import Indices
from devcad.simulate.material import Material
from devcad.simulate.model import Model
from devcad.simulate.topology import Sheet

PAPER = Material(youngs=4000.0, poisson=0.3, thickness=0.1)


def grid(
    xs: Array, ys: Array, place: Callable[[Array], Array] = lambda p: p
) -> tuple[Array, Indices, Indices]:
    """Nodes (n, 2), quads and the node numbers by row and column."""
    mesh = np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1)
    number = np.arange(mesh[..., 0].size).reshape(mesh.shape[:2])
    corners = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    return place(mesh.reshape(-1, 2)), np.stack(corners, axis=-1).reshape(-1, 4), number


def polar(p: Array) -> Array:
    """(radius, angle) -> (x, y)."""
    return np.stack([p[:, 0] * np.cos(p[:, 1]), p[:, 0] * np.sin(p[:, 1])], axis=1)


def annulus(
    cells: int,
    *,
    radius: float = 1.0,
    wide: float = 0.2,
    sector: float = np.pi / 2,
    across: int = 1,
) -> tuple[Sheet, Indices]:
    """A sector of a ring with a crease along its middle circle, and the crease's nodes."""
    radii = np.linspace(radius - wide, radius + wide, 2 * across + 1)
    flat, quads, number = grid(radii, np.linspace(0, sector, cells + 1), polar)
    crease = number[across]
    return Sheet(flat, quads, creases=np.stack([crease[:-1], crease[1:]], axis=1)), crease


def circle_radius(points: Array) -> float:
    """The radius of the circle that fits points in space best: in their plane, by Kasa's method."""
    middle = points.mean(axis=0)
    plane = (points - middle) @ np.linalg.svd(points - middle)[2][:2].T
    columns = np.column_stack([2 * plane, np.ones(len(plane))])
    centre = np.linalg.lstsq(columns, (plane**2).sum(axis=1), rcond=None)[0]
    return float(np.sqrt(centre[2] + centre[0] ** 2 + centre[1] ** 2))


def strip(
    cells: int, long: float, wide: float, across: int = 1
) -> tuple[Sheet, Indices, np.ndarray]:
    """A strip along x from 0, one more cell before it for a clamp; nodes by ruling; held nodes."""
    xs = np.append(-long / cells, np.linspace(0, long, cells + 1))
    flat, quads, number = grid(xs, np.linspace(0, wide, across + 1))
    return Sheet(flat, quads), number, flat[:, 0] < 1e-9 * long


def truss(rise: float, stiff: float) -> tuple[Model, Array]:
    """Two bars from (0, 0, 0) and (2, 0, 0) to (1, 0, rise): E A = ``stiff``."""
    long = np.hypot(1.0, rise)
    flat = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    model = Model(
        sheet=Sheet(flat, np.zeros((0, 4), dtype=np.int64)),
        material=PAPER,
        flat=flat,
        bars=np.array([[0, 1], [1, 2]]),
        length=np.full(2, long),
        own=np.full(2, stiff * long),
        members=np.zeros((0, 3), dtype=np.int64),
        forms=np.zeros((0, 3, 3)),
        hinges=np.zeros((0, 4), dtype=np.int64),
        kinds=np.zeros(0, dtype=np.int64),
        stiffness=np.zeros(0),
        creases=np.zeros((0, 1), dtype=np.int64),
    )
    return model, np.array([[0.0, 0.0, 0.0], [1.0, 0.0, rise], [2.0, 0.0, 0.0]])
