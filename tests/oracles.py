"""Worked cases with 12-digit answers: job files whose parts are known in closed form.

Each row: the case's number, the surface kind, the [surface] table, and what the report must say.
``facts`` are entries of the panel's report; ``apex`` the single apex; ``regression_start`` the
first point of the regression curve; ``end`` the pattern place of the base curve's last point.
The numbers were derived apart from this program (closed forms, elliptic integrals, quadrature of
the area element), and agree with one another to the tolerance given.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Oracle:
    """One worked case."""

    name: str
    kind: str
    surface: str
    facts: dict[str, Any] = field(default_factory=dict)
    apex: tuple[float, float, float] | None = None
    regression_start: tuple[float, float, float] | None = None
    end: tuple[float, float] | None = None
    rel: float = 1e-12


HELIX_34 = (
    'curve = {{ kind = "expression", x = "3*cos(t)", y = "3*sin(t)", z = "4*t", t = [0, {}] }}'
)

ORACLES = [
    Oracle(
        "O01 helix as a line of curvature",
        "line-of-curvature",
        f"{HELIX_34.format(0.4)}\nangle = {float(np.degrees(0.3))!r}\nextent = [0, 5]",
        {"type": "tangent", "area": 10.41684547694661, "causal": None},
        regression_start=(-5.333333333333333, 21.55152095843885, -16.16364071882914),
    ),
    Oracle(
        "O02 circle as a line of curvature: a cone",
        "line-of-curvature",
        'curve = { kind = "circle", radius = 2 }\nangle = 60\nextent = [0, 1]',
        # sector of angle 5.441398092702654 between slants 2.309401076758503 and one more
        {
            "type": "cone",
            "closed": True,
            "area": 0.5 * 5.441398092702654 * (3.309401076758503**2 - 2.309401076758503**2),
        },
        apex=(0, 0, -1.1547005383792515),
    ),
    Oracle(
        "O03 ellipse as a line of curvature at angle 0: a cylinder",
        "line-of-curvature",
        'curve = { kind = "ellipse", radii = [3, 2] }\nangle = 0\nextent = [0, 1]',
        {"type": "cylinder", "area": 15.86543958929059, "flat_area": 15.86543958929059},
    ),
    Oracle(
        "O04 Minkowski circle: a spacelike cone down to its apex",
        "line-of-curvature",
        'curve = { kind = "circle", radius = 2 }\nmetric = "minkowski"\nangle = 1\n'
        "extent = [0, 1.2961085473277707]",
        {
            "type": "cone",
            "causal": "spacelike",
            "area": 15.795811187446029,
            "apex": True,
            # the whole sector: angle 4.998593251827868, slant 2.5139814306282964
            "cut_length": 2.5139814306282964 * (2 + 4.998593251827868),
        },
        apex=(0, 0, 1.5231883119115297),
    ),
    Oracle(
        "O05 Minkowski spacelike helix",
        "line-of-curvature",
        'curve = { kind = "expression", x = "2*cos(t)", y = "2*sin(t)", z = "t", '
        f't = [0, {float(1.5 / np.sqrt(3.0))!r}] }}\nmetric = "minkowski"\nangle = 0.5\n'
        "extent = [0, 0.5]",
        {"type": "tangent", "causal": "spacelike", "area": 0.8526275397575662},
        regression_start=tuple(
            np.array([2.0, 0, 0])
            + 1.3302283259551109
            * np.array([-1.1276259652063807, 0.3008545149002653, 0.6017090298005306])
        ),
        rel=1e-11,
    ),
    Oracle(
        "O08 Minkowski timelike helix: the timelike developable",
        "line-of-curvature",
        'curve = { kind = "expression", x = "cos(t)", y = "sin(t)", z = "2*t", t = [0, 1] }\n'
        'metric = "minkowski"\ncausal = "timelike"\nangle = 0.2\nextent = [0, 1]',
        {"type": "tangent", "causal": "timelike"},
    ),
    Oracle(
        "O09 tangent developable of a helix: an annulus",
        "tangent",
        f"{HELIX_34.format(2)}\nextent = [1, 3]",
        {"type": "tangent", "area": 4.8, "min_radius": 0.75},
        end=(7.766992383060219, 5.313685379361053),
    ),
    Oracle(
        "O10 rectifying developable of a helix: the cylinder it winds on",
        "rectifying",
        f"{HELIX_34.format(2)}\nextent = [-1, 1]",
        {"type": "cylinder", "min_radius": 3.0},
    ),
    Oracle(
        "O11 rectifying developable of curvature 1 and torsion s: a cone",
        "rectifying",
        'curve = { kind = "natural", curvature = "1", torsion = "t", t = [0, 2] }\n'
        "extent = [-0.2, 0.5]",
        {"type": "cone"},
        apex=(0, 0, -1),
        end=(0.0, 2.0),  # straight, at right angles to its first ruling
        rel=1e-11,
    ),
    Oracle(
        "O35 tangent developable of the twisted cubic",
        "tangent",
        'curve = { kind = "expression", x = "t", y = "t**2", z = "t**3", t = [0, 1] }\n'
        "extent = [0, 1]",
        {"type": "tangent", "area": 0.7254554499320156},
        end=(0.8644620909334679, 1.4897257213641801),
        rel=1e-11,
    ),
    Oracle(
        "O44 oblique transition between two circles: their common cone",
        "cone",
        'apex = [2, 0, 6]\ndirectrix = { kind = "circle", radius = 2 }\nextent = [0.5, 1]',
        {"type": "cone", "area": 30.467984200264393},
        apex=(2, 0, 6),
    ),
    Oracle(
        "O44 the same, ruled between the circles",
        "ruled",
        'rails = [{ kind = "circle", radius = 2 }, '
        '{ kind = "circle", radius = 1, center = [1, 0, 3] }]',
        {"type": "cone", "area": 30.467984200264393},
        apex=(2, 0, 6),
    ),
    Oracle(
        "O47 ruled surface that is a cone with apex (1, 2, 3)",
        "ruled",
        'curve = { kind = "expression", x = "1+cos(t)", y = "2+sin(t)", z = "4", '
        't = [0, "2*pi"] }\ndirection = ["cos(t)", "sin(t)", "1"]\nextent = [0, 1]',
        {"type": "cone", "closed": True},
        apex=(1, 2, 3),
    ),
    Oracle(
        "O48 cylinder cut by a plane",
        "cylinder",
        'radius = 10\nextent = [0, "20 + 10*cos(t)"]',
        {
            "type": "cylinder",
            "area": 1256.6370614359173,
            "cut_length": 62.83185307179586 + 30 + 30 + 76.40395578055424,
        },
    ),
    Oracle(
        "O49 frustum",
        "frustum",
        "radius = 100\ntop_radius = 50\nheight = 120",
        {
            "type": "cone",
            "closed": True,
            "area": 61261.05674500097,
            "cut_length": 2.4166097335306103 * (260 + 130) + 2 * 130,
        },
        apex=(0, 0, 240),
    ),
    Oracle(
        "a plane",
        "plane",
        "width = 30\nheight = 20",
        {"type": "plane", "area": 600.0, "flat_bbox": [0, 0, 30, 20], "cut_length": 100.0},
    ),
]

KINDS = sorted({oracle.kind for oracle in ORACLES})
"""The surface kinds that have a worked case."""

REFUSED = {
    "O08 a timelike curve has no spacelike developable": (
        'kind = "line-of-curvature"\n'
        'curve = { kind = "expression", x = "cos(t)", y = "sin(t)", z = "2*t", t = [0, 1] }\n'
        'metric = "minkowski"\nangle = 0.2\nextent = [0, 1]',
        "timelike",
    ),
    "O45 the hyperboloid of one sheet": (
        'kind = "ruled"\n'
        'curve = { kind = "expression", x = "cos(t)", y = "sin(t)", z = "0", t = [0, "2*pi"] }\n'
        'direction = ["-sin(t)", "cos(t)", "1"]\nextent = [0, 1]',
        "not developable",
    ),
    "the helicoid": (
        'kind = "ruled"\n'
        'curve = { kind = "expression", x = "0", y = "0", z = "t", t = [0, 6] }\n'
        'direction = ["cos(t)", "sin(t)", "0"]\nextent = [1, 2]',
        "not developable",
    ),
    "the hyperbolic paraboloid": (
        'kind = "ruled"\n'
        'rails = [{ kind = "line", from = [0, 0, 0], to = [10, 0, 0] }, '
        '{ kind = "line", from = [0, 10, 0], to = [10, 10, 5] }]',
        "not developable",
    ),
    "an extent that crosses the regression curve": (
        'kind = "tangent"\ncurve = { kind = "helix", radius = 3, pitch = 25, turns = 1 }\n'
        "extent = [-1, 3]",
        "crosses the regression curve",
    ),
}
"""Name -> ([surface] table, words of the refusal): exit 3 and no files."""
