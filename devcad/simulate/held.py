"""Supports and loads of a job on the nodes of a net: who holds what, who bears how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from devcad.errors import GeometryError
from devcad.geometry.taylor import Array
from devcad.simulate.net import Net, Numbers
from devcad.simulate.settings import Load, Simulation, Support, Where

AXES = ("x", "y", "z")
GRAVITY = 9.80665  # m/s2, the standard value (CGPM 1901)
KG_PER_G = 1e-3
OUTSIDE = 1e-6
"""Of the sheet's size: how far beyond its edge a place may lie."""
RANK = 1e-9
"""Of the largest singular value: below it, supports leave a motion free."""


@dataclass(frozen=True, slots=True)
class Held:
    """Fixed components: ``nodes`` (s,), ``axes`` (s,) 0 to 2, and the table of the job, from 0,
    that asked for each first. ``clamped`` (c, 2) are the border's edges that cannot turn, and
    ``bearing`` (n, 3) the table that bears each component's reaction, -1 where none does."""

    nodes: Numbers
    axes: Numbers
    tables: Numbers
    clamped: Numbers
    bearing: Numbers


def held(net: Net, supports: Sequence[Support]) -> Held:
    """What the supports hold; a component that two of them hold belongs to the first.

    Raises:
        GeometryError: a place outside of the sheet, or supports that let the sheet move as a whole.
    """
    rows: dict[tuple[int, int], int] = {}
    clamped = [np.zeros((0, 2), dtype=np.intp)]
    turned: list[tuple[int, int]] = []
    bearing = np.full((len(net.flat), 3), -1, dtype=np.intp)
    for number, support in enumerate(supports):
        nodes = _nodes(net, support.where)
        edge = support.where.edge
        if support.clamp and edge is not None and edge in net.inner:
            pairs = _line(net, support.where)[1]
            inner = net.inner[edge]
            if len(pairs) == 0:  # a border that is a point has no tangent: the next row is held
                nodes = np.concatenate([nodes, inner])
            clamped.append(pairs)
            turned += [(k, AXES.index(axis)) for axis in support.fix for k in inner.tolist()]
            bearing[nodes] = np.where(bearing[nodes] < 0, number, bearing[nodes])
        for axis in support.fix:
            for node in nodes.tolist():
                rows.setdefault((node, AXES.index(axis)), number)
    keys = np.array(sorted(rows), dtype=np.intp).reshape(-1, 2)
    tables = np.array([rows[node, axis] for node, axis in keys.tolist()], dtype=np.intp)
    bearing[keys[:, 0], keys[:, 1]] = tables
    if supports:
        _refuse_free(net, np.concatenate([keys, np.array(turned, dtype=np.intp).reshape(-1, 2)]))
    return Held(keys[:, 0], keys[:, 1], tables, np.concatenate(clamped), bearing)


def _refuse_free(net: Net, fixed: Numbers) -> None:
    """GeometryError where the sheet can move as a rigid body; ``fixed`` (s, 2) node and axis, the
    row of nodes beside a clamped border among them."""
    nodes, axes = fixed.T
    points = net.built - net.built.mean(axis=0)
    points = points[nodes] / max(float(np.abs(points).max()), 1e-300)
    turns = np.cross(np.eye(3)[None], points[:, None])  # of unit turns about x, y, z
    moves = np.concatenate([np.tile(np.eye(3)[None], (len(points), 1, 1)), turns], axis=1)
    rows = moves[np.arange(len(points)), :, axes]
    sizes = np.linalg.svd(rows, compute_uv=False) if len(rows) else np.zeros(0)
    rank = int((sizes > RANK * max(sizes.max(initial=0.0), 1.0)).sum())
    if rank < 6:
        raise GeometryError(
            f"the supports leave the sheet free to move in {6 - rank} of 6 ways",
            value=float(rank),
            limit=6.0,
            place="simulate.supports",
            remedy="hold it at three points that are not on a line, or clamp an edge",
        )


def forces(net: Net, how: Simulation, masses: Array | None) -> Array:
    """The loads on the nodes, (n, 3) in N, their sum that of the job's loads and the weight.

    An edge's force is spread evenly along it; one at a place goes to the corners of the triangle
    that it lies in, so that its moment in the flat sheet is kept. ``masses`` (n,) in g.

    Raises:
        GeometryError: a place outside of the sheet.
    """
    out = np.zeros((len(net.flat), 3))
    for load in how.loads:
        nodes, shares = spread(net, load)
        np.add.at(out, nodes, shares[:, None] * np.array(load.force))
    if how.weight is not None and masses is not None:
        down = np.array(how.weight) / np.linalg.norm(how.weight)
        out += masses[:, None] * (KG_PER_G * GRAVITY * down)
    return out


def spread(net: Net, load: Load) -> tuple[Numbers, Array]:
    """The nodes (k,) that bear a load, and the share (k,) of each; the shares sum up to 1."""
    if load.where.at is not None:
        return _inside(net, load.where)
    nodes, pairs = _line(net, load.where)
    lengths = np.linalg.norm(net.flat[pairs[:, 1]] - net.flat[pairs[:, 0]], axis=1)
    weights = np.zeros(len(net.flat))
    np.add.at(weights, pairs.ravel(), np.repeat(0.5 * lengths, 2))
    shares = weights[nodes]
    total = float(shares.sum())
    if total <= 0.0:  # an edge that is a point
        return nodes, np.full(len(nodes), 1.0 / len(nodes))
    return nodes, shares / total


def node_areas(net: Net) -> Array:
    """The share (n,) of the sheet's area in mm2 that belongs to each node."""
    corners = net.flat[net.faces]
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = 0.5 * (one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
    out = np.zeros(len(net.flat))
    np.add.at(out, net.faces, np.repeat(areas[:, None] / 3.0, 3, axis=1))
    return out


def _line(net: Net, where: Where) -> tuple[Numbers, Numbers]:
    """The nodes of an edge and the pairs of neighbours on it."""
    if where.edge == "crease":
        if not len(net.creases):
            raise _nowhere(where, "the sheet has no crease", "name a border, or give at = [x, y]")
        return net.edges["crease"], net.creases
    nodes = net.edges[where.edge or "start"]
    return nodes, np.stack([nodes[:-1], nodes[1:]], axis=1)


def _nodes(net: Net, where: Where) -> Numbers:
    """The nodes that a table speaks of: those of an edge, or the one nearest to a place."""
    if where.at is None:
        return _line(net, where)[0]
    _inside(net, where)
    away = np.linalg.norm(net.flat - np.array(where.at), axis=1)
    return np.array([int(away.argmin())])


def _inside(net: Net, where: Where) -> tuple[Numbers, Array]:
    """The corners of the triangle of the pattern that a place lies in, and its shares of them."""
    at = np.array(where.at)
    corners = net.flat[net.faces]  # (f, 3, 2)
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    here = at - corners[:, 0]
    twice = _cross(one, other)
    with np.errstate(invalid="ignore", divide="ignore"):
        b, c = _cross(here, other) / twice, _cross(one, here) / twice
    shares = np.nan_to_num(np.stack([1.0 - b - c, b, c], axis=1), nan=-1.0, neginf=-1.0)
    best = int(shares.min(axis=1).argmax())
    height = float(np.sqrt(abs(twice[best])))
    beyond = -float(shares[best].min()) * height
    if beyond > OUTSIDE * float(np.ptp(net.flat, axis=0).max()):
        x, y = at
        raise _nowhere(
            where,
            f"the place [{x:.6g}, {y:.6g}] lies outside of the sheet's pattern",
            "give a place in the pattern; its DXF shows where that is",
        )
    return net.faces[best], np.maximum(shares[best], 0.0) / np.maximum(shares[best], 0.0).sum()


def _cross(one: Array, other: Array) -> Array:
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])


def _nowhere(where: Where, what: str, remedy: str) -> GeometryError:
    value = "crease" if where.at is None else f"[{where.at[0]:.6g}, {where.at[1]:.6g}]"
    return GeometryError(what, place=where.key, value=value, remedy=remedy)
