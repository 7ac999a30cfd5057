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
            "lorentz_area": 8.143690181079727,
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
        {
            "type": "tangent",
            "causal": "spacelike",
            "area": 0.8526275397575662,
            "lorentz_area": 0.6197261736265631,
        },
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
        {
            "type": "tangent",
            "causal": "timelike",
            # S + k / (2 tau) (cos theta0 - cos(theta0 - tau S)), S = sqrt(3)
            "lorentz_area": float(
                np.sqrt(3.0) + 0.25 * (np.cos(0.2) - np.cos(0.2 - 2.0 / np.sqrt(3.0)))
            ),
        },
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
        "oriented: a circle's tangent planes all 60 degrees up: a right circular cone",
        "oriented",
        'curve = { kind = "circle", radius = 2 }\nangle = 60\nextent = [0, 1]',
        # lengths of the two rims: 2 and 2 - cos(60) about
        {"type": "cone", "closed": True, "area": float(np.pi * (2 + 1.5))},
        apex=(0, 0, float(2 * np.tan(np.pi / 3))),
    ),
    Oracle(
        "oriented: O01 by an angle that falls as the torsion turns (alpha' = -tau)",
        "oriented",
        f'{HELIX_34.format(0.4)}\nangle = "90 + (0.3 - 0.8*t)*180/pi"\nextent = [0, 5]',
        {"type": "tangent", "area": 10.41684547694661},
        regression_start=(-5.333333333333333, 21.55152095843885, -16.16364071882914),
    ),
    Oracle(
        "oriented: O10 by a right angle: the curve is a geodesic",
        "oriented",
        f"{HELIX_34.format(2)}\nangle = 90\nextent = [-1, 1]",
        {"type": "cylinder", "min_radius": 3.0, "area": 12.0},
    ),
    Oracle(
        "O34 a folded circular crease: two cones with their apices 50 above and below",
        "curved-fold",
        'flat_crease = { kind = "circle", radius = 100, sweep = 180 }\n'
        "fold = 60\nextent = [-20, 20]",
        {
            "type": "cone",
            "area": float(np.pi / 2 * (120**2 - 80**2)),
            "min_radius": float(80 / np.tan(np.pi / 6)),  # at the inner edge
            "flat_bbox": [-220.0, 0.0, 20.0, 120.0],
        },
    ),
    Oracle(
        "curved-fold: a parabola's strip across a cylinder, reflected in the crease's plane",
        "curved-fold",
        'flat_crease = { kind = "expression", x = "t**2/100", y = "t", z = 0, t = [-20, 20] }\n'
        # rulings along x: sin(alpha) sin(beta) is constant, sin(beta) = 1/sqrt(1 + (t/50)^2)
        'fold = "2*asin(0.5*sqrt(1 + (t/50)**2))*180/pi"\nruling = "90 - atan(t/50)*180/pi"\n'
        "extent = [-10, 30]",
        {"type": "cylinder", "area": 40.0 * 40.0},
    ),
    Oracle(
        "darboux: a helix (tau/k = 4/3): a cone, its apex scale times the modified Darboux vector",
        "darboux",
        f"{HELIX_34.format(2)}\nscale = 2\nextent = [4, 6]",
        # sector of angle 1.2 between slants v - 2 * 4/3
        {"type": "cone", "area": 0.6 * ((6 - 8 / 3) ** 2 - (4 - 8 / 3) ** 2)},
        apex=(0, 0, 2 * 1.6666666666666667),
    ),
    Oracle(
        "darboux: curvature 1 and torsion s",
        "darboux",
        'curve = { kind = "natural", curvature = "1", torsion = "t", t = [0, 1] }\nextent = [2, 3]',
        {"type": "tangent", "area": 2.0},  # the integral of v - s
        regression_start=(0.0, 0.0, 1.0),
        rel=1e-11,
    ),
    Oracle(
        "darboux: a plane curve: a plane fan of the angle that its tangent turns",
        "darboux",
        'curve = { kind = "ellipse", radii = [3, 2], sweep = 90 }\nextent = [1, 2]',
        {"type": "plane", "area": float(0.75 * np.pi)},
    ),
    Oracle(
        "principal-normal-darboux: a clad helix (psi = 1): a cone, its apex on the axis",
        "principal-normal-darboux",
        'curve = { kind = "natural", curvature = "cos(sqrt(1 - t**2))", '
        'torsion = "-sin(sqrt(1 - t**2))", t = [0, 0.5] }\nextent = [2, 3]',
        # turning W k_N = 1/sqrt(1 - s^2), that is asin(1/2) in all; slants from 1 to 2
        {"type": "cone", "area": float(1.5 * np.pi / 6)},
        apex=(float(-np.cos(1) - np.sin(1)), 0, float(np.cos(1) - np.sin(1))),
        rel=1e-11,
    ),
    Oracle(
        "principal-normal-darboux: a slant helix (sigma = 1): a plane fan",
        "principal-normal-darboux",
        'curve = { kind = "natural", curvature = "cos(t)", torsion = "sin(t)", t = [0, 1] }\n'
        "extent = [1, 2]",
        {"type": "plane", "area": float(1.5 * np.sqrt(2))},
        rel=1e-11,
    ),
    Oracle(
        "focal: a helix: the tangent surface of the helix of its centres of curvature",
        "focal",
        f"{HELIX_34.format(2)}\nextent = [1, 3]",
        {"type": "tangent", "area": 6.4},
        regression_start=(3 - 25 / 3, 0.0, 0.0),
    ),
    Oracle(
        "focal: a curve on a sphere about (1, 2, 3): a cone with the centre as its apex",
        "focal",
        'curve = { kind = "expression", x = "1 + 5*cos(3*t)/cosh(t)", '
        'y = "2 + 5*sin(3*t)/cosh(t)", z = "3 + 5*tanh(t)", t = [0.2, 0.8] }\nextent = [6, 8]',
        {"type": "cone"},
        apex=(1, 2, 3),
    ),
    Oracle(
        "focal: a parabola: a cylinder on its evolute",
        "focal",
        'curve = { kind = "expression", x = "t", y = "t**2", z = "0", t = [0.5, 1] }\n'
        "extent = [0, 2]",
        # the evolute is as long as the radius of curvature (1 + 4 t^2)^1.5 / 2 grows
        {"type": "cylinder", "area": float(5**1.5 - 2**1.5)},
    ),
    Oracle(
        "O44 the same, found by the loft",
        "loft",
        'rails = [{ kind = "circle", radius = 2 }, '
        '{ kind = "circle", radius = 1, center = [1, 0, 3] }]',
        {"type": "cone", "closed": True, "area": 30.467984200264393},
        apex=(2, 0, 6),
    ),
    Oracle(
        "a plane",
        "plane",
        "width = 30\nheight = 20",
        {"type": "plane", "area": 600.0, "flat_bbox": [0, 0, 30, 20], "cut_length": 100.0},
    ),
    Oracle(
        "O42 translational surface: one strip of two parallelograms",
        "translational",
        'curves = [{ kind = "expression", x = "t", y = "0", z = "t**2", t = [0, 1] }, '
        '{ kind = "expression", x = "0", y = "t", z = "t**3", t = [0, 2] }]\ncount = [1, 2]',
        # the sides (1, 0, 1) and (0, 1, 1), then (1, 0, 1) and (0, 1, 7)
        {"type": "cylinder", "area": float(np.sqrt(3) + np.sqrt(51))},
    ),
    Oracle(
        "pq-strip: the sides of a square pyramid cut off at half its height",
        "pq-strip",
        "polylines = [[[2, 2, 0], [-2, 2, 0], [-2, -2, 0], [2, -2, 0], [2, 2, 0]], "
        "[[1, 1, 3], [-1, 1, 3], [-1, -1, 3], [1, -1, 3], [1, 1, 3]]]",
        {"type": "cone", "closed": True, "area": float(4 * 3 * np.sqrt(10))},
    ),
    Oracle(
        "pq-strip: a triangle with a tip and a fan, in one plane",
        "pq-strip",
        "polylines = [[[0, 0, 0], [3, 0, 0], [3, 0, 0]], [[0, 0, 0], [3, 4, 0], [5, 4, 0]]]",
        {"type": "plane", "area": 10.0, "cut_length": float(3 + 5 + 2 + np.sqrt(20))},
    ),
    Oracle(
        "gore: a twelfth of a globe of tangent cylinders",
        "gore",
        "radius = 2\ncount = 12",
        # the seams are half ellipses with the half-axes 2 and 2/cos(15 deg): E by scipy's ellipe
        {
            "type": "cylinder",
            "area": float(16 * np.tan(np.pi / 12)),
            "min_radius": 2.0,
            "cut_length": 2 * 6.394488913696617,
        },
    ),
    Oracle(
        "O27 four links of a cylinder, kept one sheet by living hinges",
        "cylindrical-mechanism",
        'radius = 10\njoints = [0, 50, 170, 290]\nwidths = 8\nhinge = "living"\nclearance = 0.1',
        # the circle's length without the slit in the middle of the ground
        {
            "type": "cylinder",
            "closed": False,
            "area": float(8 * (20 * np.pi - 0.1)),
            "min_radius": 10.0,
            "flat_bbox": [0, 0, 8, float(20 * np.pi - 0.1)],
        },
    ),
    Oracle(
        "O37 equidistant conic map from 40 degrees to the pole",
        "conic-map",
        'projection = "equidistant"\nradius = 1\nparallels = [20, 60]\nlatitudes = [40, 90]\n'
        "longitudes = [0, 90]",
        # n and rho at 40 degrees, less 50 degrees at the pole
        {
            "type": "cone",
            "area": 0.6298132863519681
            * (np.pi / 4)
            * (1.1429519287572978**2 - (1.1429519287572978 - np.radians(50)) ** 2),
            "cut_length": 0.6298132863519681
            * (np.pi / 2)
            * (2 * 1.1429519287572978 - np.radians(50))
            + 2 * np.radians(50),
        },
    ),
    Oracle(
        "Albers' map of the whole globe has the globe's area",
        "conic-map",
        'projection = "albers"\nradius = 1\nparallels = [29.5, 45.5]\nlatitudes = [-90, 90]\n'
        "longitudes = [-180, 180]",
        {"type": "cone", "closed": True, "area": 12.566370614359172},
    ),
    Oracle(
        "O41 cylindrical equal-area map of the whole globe",
        "conic-map",
        'projection = "cylindrical-equal-area"\nradius = 1\nparallels = 30\n'
        "latitudes = [-90, 90]\nlongitudes = [-180, 180]",
        {
            "type": "cylinder",
            "closed": True,
            "area": 12.566370614359172,
            "flat_bbox": [0, 0, 2.309401076758503, 5.441398092702654],
        },
    ),
    Oracle(
        "a map on the cone that touches the globe at 30 degrees south",
        "conic-map",
        'projection = "equidistant"\nradius = 1\nparallels = -30\nlatitudes = [-60, 0]\n'
        "longitudes = [0, 90]",
        # apex at R / sin(p); slants cot(30 deg) +- 30 deg
        {"type": "cone", "area": float(np.pi / 4 * 0.5 * 4 * np.sqrt(3) * np.pi / 6)},
        apex=(0, 0, -2),
    ),
    Oracle(
        "the tangents of the twisted cubic between its polars at 2 and 3: parabolas both",
        "bezier",
        # r[u, v, w] = 30 ((u+v+w)/3, (uv+vw+wu)/3, uvw) + (10, 20, 30): poles r[.., 2] and r[.., 3]
        "boundary = [[30, 20, 30], [40, 40, 30], [50, 70, 90]]\n"
        "opposite_start = [[40, 20, 30], [50, 50, 30]]",
        # 900 times the integral of (5 - 2 t) sqrt(9 t^4 + 9 t^2 + 1) / 9
        {"type": "tangent", "area": 818.435612901644},
        regression_start=(10, 20, 30),
    ),
    Oracle(
        "a parabola under its own level copy: a cylinder",
        "bezier",
        "boundary = [[0, 0, 0], [50, 50, 0], [100, 0, 0]]\nopposite_start = [0, 0, 30]",
        {"type": "cylinder", "area": 1500 * (np.sqrt(2) + np.arcsinh(1))},
    ),
    Oracle(
        "a parabola whose rulings cross at twice their length: a cone",
        "bezier",
        "boundary = [[0, 0, 0], [50, 50, 0], [100, 0, 0]]\nopposite_start = [0, 0, 30]\n"
        'singular = [2, 2]\nmethod = "chu-sequin"',
        # 3/8 of the integral of |(b - apex) x b'|
        {"type": "cone", "area": 3017.063245775969},
        apex=(0, 0, 60),
    ),
    Oracle(
        "O18 envelope of the planes cos t x + sin t y + z = t: the tangents of a helix",
        "envelope",
        'normal = ["cos(t)", "sin(t)", "1"]\noffset = "t"\nt = [1, 2]\nextent = [2, 3]',
        {"type": "tangent", "area": 2.5 / np.sqrt(2) - 0.75},
        regression_start=(-0.8414709848078965, 0.5403023058681398, 1.0),
    ),
    Oracle(
        "O18 with a constant offset: all planes pass through one point",
        "envelope",
        'normal = ["cos(t)", "sin(t)", "1"]\noffset = "2"\nt = [0, "2*pi"]\nextent = [-3, 1]',
        {
            "type": "cone",
            "closed": True,
            "area": np.pi / np.sqrt(2) * ((np.sqrt(2) + 3) ** 2 - (np.sqrt(2) - 1) ** 2),
        },
        apex=(0, 0, 2),
    ),
    Oracle(
        "planes at distance 3 from a line: a cylinder",
        "envelope",
        'normal = ["(2+sin(t))*cos(t)", "(2+sin(t))*sin(t)", "0"]\noffset = "3*(2+sin(t))"\n'
        't = [0, "2*pi"]\nextent = [0, 2]',
        {"type": "cylinder", "closed": True, "area": 12 * np.pi, "min_radius": 3.0},
    ),
    Oracle(
        "planes that stand still for a moment: the tangents of (t, t^2, t^5)",
        "envelope",
        'normal = ["15*t**4", "-10*t**3", "1"]\noffset = "6*t**5"\nt = [-1, 1]\nextent = [3, 4]',
        {"type": "tangent"},
        regression_start=(-1, 1, -1),
    ),
    Oracle(
        "a collar of constant slope 35 degrees, 150 wide, around an ellipse 300 x 200",
        "envelope",
        'normal = ["200*cos(t)", "300*sin(t)", '
        '"sqrt((200*cos(t))**2 + (300*sin(t))**2)/tan(35*pi/180)"]\n'
        'offset = "60000"\nt = [0, "2*pi"]\n'
        'extent = ["-60000*cos(35*pi/180)/sqrt((200*cos(t))**2 + (300*sin(t))**2) - 150", '
        '"-60000*cos(35*pi/180)/sqrt((200*cos(t))**2 + (300*sin(t))**2)"]',
        # perimeter x width + pi width^2 in plan, over the cosine; the perimeter as in O03
        {
            "type": "tangent",
            "closed": True,
            "area": 1586.543958929059 * 150 + np.pi * 150**2 * np.cos(np.radians(35)),
        },
    ),
    Oracle(
        "tangent planes of a sphere along a parallel: a cone with its apex at R / sin(latitude)",
        "tangent-planes",
        'base = { x = "10*cos(u)*cos(v)", y = "10*sin(u)*cos(v)", z = "10*sin(v)" }\n'
        'curve = { u = "t", v = "0.6", t = [0, "2*pi"] }\nextent = [-2, 3]',
        {
            "type": "cone",
            "closed": True,
            "area": np.pi
            * np.sin(0.6)
            * ((10 / np.tan(0.6) + 2) ** 2 - (10 / np.tan(0.6) - 3) ** 2),
        },
        apex=(0, 0, 10 / np.sin(0.6)),
    ),
    Oracle(
        "tangent planes of a sphere along its equator: a cylinder",
        "tangent-planes",
        'base = { x = "10*cos(u)*cos(v)", y = "10*sin(u)*cos(v)", z = "10*sin(v)" }\n'
        'curve = { u = "t", v = "0", t = [0, "2*pi"] }\nextent = [-2, 3]',
        {"type": "cylinder", "closed": True, "area": 100 * np.pi, "min_radius": 10.0},
    ),
    Oracle(
        "the tangents of a helix found as pseudo-antipodal points of its mirror image",
        "tangent",
        'curve = { kind = "pseudo-antipodal", on = "x**2 + y**2 - 9", point = [0, 0, 0], s = 0, '
        f"{HELIX_34.format(2)} }}\nextent = [1, 3]",
        {"type": "tangent", "area": 4.8, "min_radius": 0.75},  # O09
        end=(7.766992383060219, 5.313685379361053),
    ),
    Oracle(
        "O22 oloid: area 4 pi r^2, perimeter two developed arcs and two rulings",
        "oloid",
        "radius = 1",
        {
            "type": "tangent",
            "closed": True,
            "area": 12.566370614359172,
            # each circle's edge: twice there and back through 240 degrees
            "cut_length": 2 * 1.7320508075688772 + 4 * 4 * np.pi / 3,
        },
    ),
    Oracle(
        "O24 sphericon: four sectors of radius sqrt 2 and angle pi / sqrt 2",
        "sphericon",
        "radius = 1",
        {
            "type": "mixed",
            "closed": True,
            "area": 8.885765876316732,
            "cut_length": 2 * 1.414213562373095 + 4 * 1.414213562373095 * 2.221441469079183,
        },
    ),
    Oracle(
        "the bitangent developable of (cos t, sin t, cos 2t): the parabolic cylinder z = 2x^2 - 1",
        "edge-surface",
        'component = 1\ncurves = [{ kind = "expression", x = "cos(t)", y = "sin(t)", '
        'z = "cos(2*t)", t = [0, "2*pi"] }]',
        # 2 sqrt(1 - x^2) sqrt(1 + 16 x^2) dx from -1 to 1: elliptic, by Gauss-Chebyshev quadrature
        {"type": "cylinder", "area": 6.481371497593667},
        rel=1e-11,
    ),
    Oracle(
        "O22 the oloid, found as the hull of its two circles",
        "edge-surface",
        'hull = true\ncurves = [{ kind = "circle", radius = 1, center = [0, -0.5, 0] }, '
        '{ kind = "circle", radius = 1, center = [0, 0.5, 0], normal = [1, 0, 0] }]',
        {"type": "tangent", "closed": True, "area": 12.566370614359172},
        rel=1e-11,
    ),
]

KINDS = sorted({oracle.kind for oracle in ORACLES})
"""The surface kinds that have a worked case."""

REFUSED = {
    "planes that turn back": (
        'kind = "envelope"\nnormal = ["-3*t**2", "1", "0"]\noffset = "-2*t**3"\nt = [-1, 1]\n'
        "extent = [0, 1]",
        "the planes turn back at t = 0",
    ),
    "one plane all the time": (
        'kind = "envelope"\nnormal = ["1+t", "0", "0"]\noffset = "5+5*t"\nt = [0, 1]\n'
        "extent = [0, 1]",
        "stands still throughout",
    ),
    "parallel planes": (
        'kind = "envelope"\nnormal = ["1", "2", "0"]\noffset = "t"\nt = [0, 1]\nextent = [0, 1]',
        "parallel throughout",
    ),
    "a family that closes with its normal reversed": (
        'kind = "envelope"\nnormal = ["cos(t/2)*cos(t)", "cos(t/2)*sin(t)", "sin(t/2)"]\n'
        'offset = "0.3*cos(t/2)"\nt = [0, "2*pi"]\nextent = [1, 2]',
        "crosses the regression curve",
    ),
    "tangent planes along an asymptotic line": (
        'kind = "tangent-planes"\nbase = { x = "u", y = "v", z = "u*v" }\n'
        'curve = { u = "t", v = "0", t = [0, 1] }\nextent = [-1, 1]',
        "asymptotic",
    ),
    "tangent planes of a plane": (
        'kind = "tangent-planes"\nbase = { x = "u", y = "v", z = "u + v" }\n'
        'curve = { u = "t", v = "t**2", t = [0, 1] }\nextent = [-1, 1]',
        "stands still throughout",
    ),
    "a locus of a curve that is not on its surface": (
        'kind = "tangent"\nextent = [1, 2]\ncurve = { kind = "pseudo-antipodal", '
        'on = "x**2 + y**2 + z**2 - 1.001", point = [0, 0, 0.5], s = 0.5, '
        'curve = { kind = "circle", radius = 1 } }',
        "away from the surface",
    ),
    "a second control point beside the plane of the first cell": (
        'kind = "bezier"\nboundary = [[0, 0, 0], [10, 0, 0], [20, 10, 5]]\n'
        "opposite_start = [[0, 0, 10], [10, 1, 10]]",
        "not in the plane",
    ),
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
    "O17 tangent planes that are the osculating planes": (
        f'kind = "oriented"\n{HELIX_34.format(2)}\nangle = 0\nextent = [-1, 1]',
        "its own regression curve",
    ),
    "two curved creases whose rulings meet between them": (
        'kind = "curved-fold"\nflat_crease = { kind = "circle", radius = 100, sweep = 90 }\n'
        "fold = 60\nleft_creases = [-30, -71]\nextent = [-5, 5]",
        "70 from the crease, before left_creases[1] at 71",
    ),
    "the focal surface of a circle": (
        'kind = "focal"\ncurve = { kind = "circle", radius = 2 }\nextent = [-1, 1]',
        "meet in one line",
    ),
    "the Darboux developable of a curve with an inflection": (
        'kind = "darboux"\ncurve = { kind = "expression", x = "t", y = "t**3", z = "t**4", '
        "t = [-1, 1] }\nextent = [1, 2]",
        "inflection (curvature 0) at t = 0",
    ),
    "the principal-normal Darboux developable of a straight line": (
        'kind = "principal-normal-darboux"\n'
        'curve = { kind = "line", from = [0, 0, 0], to = [1, 2, 3] }\nextent = [1, 2]',
        "inflection",
    ),
    "a loft between arcs bowed against one another": (
        'kind = "loft"\n'
        'rails = [{ kind = "expression", x = "60*sin(t)", y = "60*cos(t)-60", z = "0", '
        't = [-0.7, 0.7] }, { kind = "expression", x = "60*sin(t)", y = "60-60*cos(t)", z = "50", '
        "t = [-0.7, 0.7] }]",
        "not developable",
    ),
    "a loft between the whole circles of an oloid": (
        'kind = "loft"\nrails = [{ kind = "circle", radius = 1, center = [0, -0.5, 0] }, '
        '{ kind = "circle", radius = 1, center = [0, 0.5, 0], normal = [1, 0, 0] }]',
        "no closed matching",
    ),
    "an extent that crosses the regression curve": (
        'kind = "tangent"\ncurve = { kind = "helix", radius = 3, pitch = 25, turns = 1 }\n'
        "extent = [-1, 3]",
        "crosses the regression curve",
    ),
    "a quad that is not plane": (
        'kind = "pq-strip"\npolylines = [[[0, 0, 0], [0, 50, 0]], [[60, 0, 0], [60, 50, 10]]]',
        "not developable",
    ),
    "a quad whose rulings cross": (
        'kind = "pq-strip"\npolylines = [[[0, 0, 0], [0, 50, 0]], [[60, 50, 0], [60, 0, 0]]]',
        "strip 1, quad 1",
    ),
    "a cone map between parallels symmetric about the equator": (
        'kind = "conic-map"\nprojection = "lambert"\nradius = 1\nparallels = [-30, 30]\n'
        "latitudes = [0, 60]\nlongitudes = [0, 90]",
        "the cone is a cylinder",
    ),
    "Lambert's map to the pole away from its apex": (
        'kind = "conic-map"\nprojection = "lambert"\nradius = 1\nparallels = [30, 60]\n'
        "latitudes = [-90, 60]\nlongitudes = [0, 90]",
        "infinitely far",
    ),
    "no plane touches a twisted cubic twice": (
        'kind = "edge-surface"\n'
        'curves = [{ kind = "expression", x = "t", y = "t**2", z = "t**3", t = [-1, 1] }]',
        "no bitangent pairs",
    ),
    "a plane touches a plane curve everywhere": (
        'kind = "edge-surface"\ncurves = [{ kind = "ellipse", radii = [3, 2] }]',
        "lies in a plane",
    ),
    "the hull of two circles that touch": (
        'kind = "edge-surface"\ncurves = [{ kind = "circle", radius = 1, center = [1, 0, 0] }, '
        '{ kind = "circle", radius = 1, center = [0, 0, 1], normal = [1, 0, 0] }]',
        "the curves touch",
    ),
}
"""Name -> ([surface] table, words of the refusal): exit 3 and no files."""
