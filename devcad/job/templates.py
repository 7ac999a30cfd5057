"""Job files to start from: one for each surface kind, each builds as it stands."""

from __future__ import annotations

_HEADER = """\
# {title}
# Check it:  devcad check {kind}.toml       Write the files:  devcad export {kind}.toml

name = "{kind}"             # the folder and the files are named after it
units = "mm"                # mm, cm, m or in: the unit of every length below
tolerance = 0.05            # largest distance of anything exported from the true surface
thickness = {thickness}             # of the sheet; 0 gives a surface without thickness
# reference = "middle"      # which face is described: middle, front or back
# pipeline = "sheet-metal"  # the recipe; devcad list pipelines names them
# bend = 0.5                # from 0 (flat) to 1 (as described), for the 3D files

# [meta]
# part_number = "A-100"
# description = "what it is"

[surface]
kind = "{kind}"
"""

TEMPLATES: dict[str, tuple[str, float, str]] = {
    "plane": (
        "A flat rectangle",
        1.0,
        """\
width = 200                 # along x
height = 100                # along y
""",
    ),
    "cylinder": (
        "A cylinder: parallel rulings",
        1.0,
        """\
radius = 50                 # about the z axis
length = 120                # or extent = [from, to]: numbers, or expressions in t such as
                            # extent = [0, "120 + 20*cos(t)"], a pipe cut at an angle
# sweep = 180               # degrees; without it the whole turn
# Any other cylinder: a directrix and a direction in place of radius and sweep.
# directrix = { kind = "ellipse", radii = [60, 40] }
# direction = [0, 0, 1]
""",
    ),
    "cone": (
        "A cone: rulings from an apex through any curve",
        1.0,
        """\
apex = [20, 0, 150]
extent = [0.4, 1]           # fractions of the way: 0 is the apex, 1 the directrix

[surface.directrix]
kind = "circle"
radius = 80                 # about z, in z = 0; also center, normal, start, sweep
""",
    ),
    "frustum": (
        "A frustum: a cone between two circles about z",
        1.0,
        """\
radius = 100                # of the circle in z = 0
top_radius = 50             # of the circle in z = height; 0 gives a whole cone
height = 120
# sweep = 180               # degrees; without it the whole turn
# cut = 1.57                # where the pattern opens, radians
# gap = 2                   # width left out there
""",
    ),
    "ruled": (
        "A ruled surface: rulings between two rails, or from a curve along a direction",
        1.0,
        """\
# It is accepted only if the tangent plane stays the same along every ruling.
# extent = [0, 1]           # fractions of the way between the rails

[[surface.rails]]
kind = "circle"
radius = 80

[[surface.rails]]
kind = "circle"
radius = 40
center = [0, 0, 100]
""",
    ),
    "tangent": (
        "A tangent surface: the tangents of a space curve, such as an auger flight",
        0.0,
        """\
extent = [20, 80]           # lengths along the tangent; 0 is the sharp edge

[surface.curve]
kind = "helix"
radius = 30
pitch = 120
turns = 1
""",
    ),
    "rectifying": (
        "A ribbon along a space curve that unrolls to a straight line",
        0.5,
        """\
extent = [-10, 10]          # lengths along the ruling, on both sides of the curve

[surface.curve]
kind = "expression"
t = [0, 2]
x = "100*cos(t)"
y = "100*sin(t)"
z = "30*t + 5*t**2"
""",
    ),
    "line-of-curvature": (
        "A strip that has a space curve as a line of curvature",
        0.5,
        """\
metric = "euclidean"        # or "minkowski", z is time
angle = 30                  # degrees from the curve's normal to the surface's, at the start
extent = [-10, 10]          # lengths along the ruling, on both sides of the curve

[surface.curve]
kind = "helix"
radius = 100
pitch = 200
turns = 0.5
""",
    ),
}
"""Kind to what it is, the sheet's thickness and the keys of its surface."""


def template(kind: str) -> str:
    """The commented job file of a kind; KeyError where there is none."""
    title, thickness, body = TEMPLATES[kind]
    return _HEADER.format(title=title, kind=kind, thickness=thickness) + body
