"""What a curve's place, size, sense and parameter have no part in: the sheet that is cut."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydantic import TypeAdapter
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation
from strategies import scales

import devcad
from devcad.flatten.development import develop
from devcad.geometry.constructions import surface_spec
from devcad.geometry.patch import Patch

KINDS = ("oriented", "darboux", "principal-normal-darboux", "focal")
EXTENT = {
    "oriented": (-0.01, 0.02),
    "darboux": (6.0, 7.0),
    "principal-normal-darboux": (20.0, 21.0),
    "focal": (-25.0, -24.0),
}
SURFACE: TypeAdapter[Any] = TypeAdapter(surface_spec())
# a twisted arc; nudged by less than its distance to an inflection
ARC = np.array([[0, 0, 0], [1, 0, 0], [2, 0.6, 0], [3, 1.8, 0.6], [4, 3.6, 2.4], [5, 6, 6]]) / 5
NUDGES = st.lists(st.floats(-0.01, 0.01), min_size=18, max_size=18).map(np.array)
FRACTIONS = np.linspace(0, 1, 9)


def bezier(points: np.ndarray) -> dict[str, Any]:
    """A job's curve: the quintic of these control points, t from 0 to 1."""
    knots = [0] * 6 + [1] * 6
    return {"kind": "bspline", "degree": 5, "knots": knots, "control_points": points.tolist()}


def strip(
    kind: str,
    curve: dict[str, Any],
    *,
    size: float = 1.0,
    angle: str = "75 + 10*t",
    turned: bool = False,
) -> Patch:
    """The strip over a curve, all lengths ``size`` times those of the examples here; with its
    extent turned round."""
    low, high = EXTENT[kind]
    extent = [-high * size, -low * size] if turned else [low * size, high * size]
    keys = {"oriented": {"angle": angle}, "focal": {}}.get(kind, {"scale": size})
    (panel,) = (
        SURFACE.validate_python({"kind": kind, "curve": curve, "extent": extent, **keys})
        .build()
        .panels
    )
    (patch,) = panel.patches
    return patch


def distances(patch: Patch, t: np.ndarray) -> np.ndarray:
    """All distances between the points of the flat outline at the rulings t: what congruent
    outlines have in common. Sheets through their regression curve are left out."""
    frame = patch.frame(np.linspace(*patch.domain, 65))
    width = np.stack([frame.q + v * frame.a for v in (frame.v_from, frame.v_to)])
    turns = np.einsum("ij,ij->i", frame.n[1:], frame.n[:-1])
    assume(bool((width > 0).all() and (turns > 0).all()))
    jet, flat = patch.jet(t, 0), develop(patch)
    lower, upper = (flat.points(t, v[0]) for v in (jet.v_from, jet.v_to))
    middles = 0.5 * (lower + upper)  # the same points whichever edge is the lower one
    return np.concatenate([pdist(middles), np.linalg.norm(upper - lower, axis=1)])


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=15)
@given(
    nudge=NUDGES,
    turn=st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1),
    shift=st.tuples(*[st.floats(-2, 2)] * 3),
)
def test_moving_the_curve_leaves_the_sheet(kind, nudge, turn, shift):
    points = ARC + nudge.reshape(6, 3)
    moved = points @ Rotation.from_quat(turn).as_matrix().T + shift
    here, there = (distances(strip(kind, bezier(p)), FRACTIONS) for p in (points, moved))
    np.testing.assert_allclose(there, here, rtol=1e-9)  # fifth derivatives of rounded points


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=15)
@given(nudge=NUDGES, size=scales())
def test_scaling_the_curve_scales_the_sheet(kind, nudge, size):
    points = ARC + nudge.reshape(6, 3)
    here = distances(strip(kind, bezier(points)), FRACTIONS)
    there = distances(strip(kind, bezier(size * points), size=size), FRACTIONS)
    np.testing.assert_allclose(there, size * here, rtol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=15)
@given(nudge=NUDGES)
def test_running_along_the_curve_backwards_gives_the_same_sheet(kind, nudge):
    """T and B turn round. The oriented and the focal rulings go with them (and the angle, which is
    measured towards B); the Darboux surfaces become their images in the origin."""
    points = ARC + nudge.reshape(6, 3)
    there = strip(
        kind,
        bezier(points[::-1]),
        angle="-(75 + 10*(1 - t))",
        turned=kind in ("oriented", "focal"),
    )
    here = strip(kind, bezier(points))
    np.testing.assert_allclose(
        distances(there, 1 - FRACTIONS), distances(here, FRACTIONS), rtol=1e-9
    )


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=15)
@given(low=st.floats(0.2, 0.3))
def test_the_parameter_does_not_matter(kind, low):
    """(t, t^2, t^3) up to 0.6, and with exp(t) in place of t."""
    t = np.linspace(low, 0.6, 9)
    both = []
    for s, angle, places in (("t", "75 + 10*t", t), ("exp(t)", "75 + 10*exp(t)", np.log(t))):
        table = {"x": s, "y": f"{s}**2", "z": f"{s}**3", "t": [places[0], places[-1]]}
        both.append(distances(strip(kind, {"kind": "expression", **table}, angle=angle), places))
    np.testing.assert_allclose(*both, rtol=1e-10)


def test_a_job_reports_the_swallowtail_of_its_darboux_developable(tmp_path: Path):
    """f = tau/k = (t - 1)^2 + 0.5 has f' = 0 at t = 1: there D~ = f T + B stands still."""
    job = tmp_path / "job.toml"
    job.write_text(
        'name = "job"\n[surface]\nkind = "darboux"\nextent = [3, 4]\n'
        'curve = { kind = "natural", curvature = "1", torsion = "(t - 1)**2 + 0.5", t = [0, 1.5] }'
    )
    (panel,) = devcad.build(job).panels
    edge, tail = panel.facts["singularities"]
    assert (edge["type"], tail["type"]) == ("cuspidal-edge", "swallowtail")
    assert tail["t"] == pytest.approx(1.0, abs=1e-9)
    jet = panel.chain.patches[0].jet([1.0], 0)
    np.testing.assert_allclose(tail["point"], jet.c0[0, 0] + 0.5 * jet.e[0, 0], atol=1e-9)
