"""What a simulation leaves: its motion as glTF, its steps, nodes and modes as tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from devcad.export import Written
from devcad.export.csvfile import Cell, Figure, write_table
from devcad.export.glbframes import Key, Moving, write_frames
from devcad.simulate.net import Net
from devcad.simulate.outcome import KINDS, Outcome, State

FOLDING, PAUSE, LOADING, REST = 3.0, 0.5, 2.0, 1.0
"""Seconds: the sheet folds, rests, is loaded, and rests again."""
AXES = ("x", "y", "z")


def write_fold(
    outcome: Outcome, name: str, folder: Path, colour: tuple[float, float, float]
) -> list[Written]:
    """<name>-fold.glb, <name>-fold.csv, <name>-fold-nodes.csv and, where modes were asked for,
    <name>-fold-modes.csv in the folder, each read back.

    Raises:
        CheckFailed: a file does not hold what it should. FileError: it cannot be written.
    """
    stem = folder / f"{name}-fold"
    out = [
        write_motion(outcome, stem.with_name(f"{stem.name}.glb"), name, colour),
        _steps(outcome, stem.with_name(f"{stem.name}.csv")),
        _nodes(outcome, stem.with_name(f"{stem.name}-nodes.csv")),
    ]
    if len(outcome.mode_shapes):
        out.append(_modes(outcome, stem.with_name(f"{stem.name}-modes.csv")))
    return out


def write_motion(
    outcome: Outcome, path: Path, name: str, colour: tuple[float, float, float]
) -> Written:
    """The states as frames of one glTF animation; the mesh rests as the last one."""
    net = outcome.net
    nodes, triangles = _drawn(net)
    frames = np.stack([state.positions[nodes] for state in outcome.states])
    keys = keys_of(outcome.states)
    if len(frames) == 1:  # a formed sheet that nothing loads stands still
        frames, keys = np.repeat(frames, 2, axis=0), [(0.0, 0), (REST, 1)]
    mesh = Moving(name, frames, triangles, net.flat[nodes])
    return write_frames(path, [mesh], keys, rest=len(frames) - 1, colour=colour)


def keys_of(states: Sequence[State]) -> list[Key]:
    """When each state is seen: both phases go evenly, with a rest after each."""
    out: list[Key] = []
    time = 0.0
    for phase, span in (("fold", FOLDING), ("load", LOADING)):
        rows = [k for k, state in enumerate(states) if state.phase == phase]
        if not rows:
            continue
        first = out[-1][1] if out else rows[0]
        moving = rows if out else rows[1:]
        if not out:
            out.append((0.0, first))
        for count, k in enumerate(moving, start=1):
            out.append((time + span * count / len(moving), k))
        time = out[-1][0] + (PAUSE if phase == "fold" and moving else REST)
        out.append((time, out[-1][1]))
    return out


def _drawn(net: Net) -> tuple[np.ndarray, np.ndarray]:
    """The nodes (v,) that a viewer's points are, those on creases once for each strip beside them,
    and the triangles between these points."""
    keys = net.face_strips[:, None] * len(net.flat) + net.faces
    points, index = np.unique(keys, return_inverse=True)
    return points % len(net.flat), index.reshape(-1, 3)


def _steps(outcome: Outcome, path: Path) -> Written:
    """A row a step: what of it is done, energies, equilibrium, distances, reactions."""
    header = ["step", "phase", "share"]
    header += [f"{kind}_N_mm" for kind in (*KINDS, "energy")]
    header += ["residual_N", "scale_N", "iterations", "method", "stable", "largest_strain"]
    header += ["furthest_mm", "rms_mm", "reaction_x_N", "reaction_y_N", "reaction_z_N"]
    rows: list[list[Cell]] = []
    for number, state in enumerate(outcome.states):
        energies = [state.energies[kind] for kind in KINDS]
        rows.append(
            [
                number,
                state.phase,
                state.share,
                *(_short(value) for value in (*energies, sum(energies))),
                _short(state.residual),
                _short(state.scale),
                state.iterations,
                state.method,
                state.stable,
                _short(state.strain),
                state.furthest,
                state.rms,
                *(Figure(value) for value in state.reactions.sum(axis=0)),
            ]
        )
    return write_table(path, "csv", header, rows)


def _nodes(outcome: Outcome, path: Path) -> Written:
    """A row a node and step: its place in the pattern, in space, and the force and moment that hold
    it there."""
    header = ["step", "node", "pattern_x", "pattern_y", *AXES]
    header += [f"reaction_{axis}_N" for axis in AXES]
    header += [f"moment_{axis}_N_mm" for axis in AXES]
    flat = outcome.net.flat.tolist()
    rows: list[list[Cell]] = []
    for number, state in enumerate(outcome.states):
        bearing = np.concatenate([state.reactions, state.moments], axis=1)
        holding = np.any(bearing != 0.0, axis=1).tolist()
        reactions: list[list[Cell]] = [[Figure(x) for x in row] for row in bearing.tolist()]
        for node, (place, point) in enumerate(zip(flat, state.positions.tolist(), strict=True)):
            held: list[Cell] = reactions[node] if holding[node] else [None] * 6
            rows.append([number, node, *place, *(Figure(x) for x in point), *held])
    return write_table(path, "csv", header, rows)


def _modes(outcome: Outcome, path: Path) -> Written:
    """A row a node and mode: how the node moves, the largest motion of a mode being 1."""
    rows: list[list[Cell]] = []
    for number, shape in enumerate(outcome.mode_shapes, start=1):
        largest = max(float(np.linalg.norm(shape, axis=1).max()), 1e-300)
        for node, move in enumerate((shape / largest).tolist()):
            rows.append([number, node, *move])
    return write_table(path, "csv", ["mode", "node", *AXES], rows)


def _short(value: float) -> str:
    """A number that is never negative with seven digits, however small it is."""
    return f"{value:.6e}"
