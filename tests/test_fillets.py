"""Creases as bends with an inside radius: blanks, solids and reliefs against closed forms."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import shapely

import devcad
from devcad.errors import GeometryError
from devcad.flatten.pattern import sample
from devcad.mesh.build import volume

SQUARE = "points = [[-{0}, -{1}, 0], [{0}, -{1}, 0], [{0}, {1}, 0], [-{0}, {1}, 0]]"
LOW = [[100, 0], [100, 100], [-100, 100], [-100, -100], [100, -100]]
HIGH = [[70, 0], [0, 70], [-70, 0], [0, -70]]
SQUARE_TO_DIAMOND = f"""
[surface]
kind = "pq-strip"
polylines = [
  {[[*LOW[k], 0] for k in (0, 1, 1, 2, 2, 3, 3, 4, 4, 0)]},
  {[[*HIGH[k], 120] for k in (0, 0, 1, 1, 2, 2, 3, 3, 0, 0)]},
]
"""
"""Triangles about the corners of a square and of a diamond above it, from the middle of a side."""
FANS = """
[surface]
kind = "pq-strip"
polylines = [
  [[0, 0, 0], [100, 0, 0], [100, 0, 0], [200, 0, 40]],
  [[0, 100, 0], [0, 100, 0], [120, 90, 60], [120, 90, 60]],
]
"""
"""Three triangles in a row, a fan of two creases and two corners where one crease runs out."""
PYRAMID = f"""
[surface]
kind = "cone"
apex = [0, 0, -300]
extent = [0.4, 1]
[surface.directrix]
kind = "polyline"
closed = true
{SQUARE.format(120, 80)}
"""
D_TUBE = """
[surface]
kind = "cylinder"
direction = [0, 0, 1]
length = 100
[surface.directrix]
kind = "chain"
closed = true
[[surface.directrix.curves]]
kind = "line"
from = [-50, 0, 0]
to = [50, 0, 0]
[[surface.directrix.curves]]
kind = "circle"
radius = 50
sweep = 180
"""


def job(thickness, inside, surface, *, neutral="k = 0.5", more=""):
    bends = "" if inside is None else f"[recipe.bends]\ninside_radius = {inside}\n"
    head = f"thickness = {thickness}\n{more}\n{bends}"
    return f"{head}[recipe.neutral]\n{neutral}\n{surface}"


def made(folder, text):
    path = folder / "job.toml"
    path.write_text(f'name = "job"\n{text}')
    return devcad.build(path)


def folded(*points):
    """A sheet 50 mm wide along a polyline in the plane."""
    line = [[float(x), float(y), 0.0] for x, y in points]
    return (
        '[surface]\nkind = "cylinder"\ndirection = [0, 0, 1]\nlength = 50\n'
        f'[surface.directrix]\nkind = "polyline"\npoints = {line}\n'
    )


def bracket(a, b, degrees):
    """Two legs of lengths a and b that turn by an angle, to the front where it is positive."""
    turn = np.radians(degrees)
    return folded((0, 0), (a, 0), (a + b * np.cos(turn), b * np.sin(turn)))


def bends(panel):
    return [line for line in panel.pattern.lines if line.angle]


@pytest.mark.parametrize("degrees", [30.0, -90.0, 135.0, -178.0])
@pytest.mark.parametrize("reference", ["middle", "front", "back"])
def test_a_bracket_is_as_long_as_its_legs_less_the_setbacks_and_the_allowance(
    tmp_path, degrees, reference
):
    # fabrication.md, 4: BA = theta (Ri + K T), OSSB = (Ri + T) tan(theta / 2) on the outer faces,
    # so Ri tan(theta / 2) on the inner ones and half way between on the middle
    a, b, thick, inside, k = 320.0, 300.0, 2.0, 3.0, 0.4
    text = job(
        thick, inside, bracket(a, b, degrees), neutral=f"k = {k}",
        more=f'reference = "{reference}"',
    )  # fmt: skip
    (panel,) = made(tmp_path, text).panels
    inner = "front" if degrees > 0 else "back"
    radius = inside + {"middle": 0.5 * thick, inner: 0.0}.get(reference, thick)
    theta = np.radians(abs(degrees))
    setback = radius * np.tan(theta / 2)
    allowance = theta * (inside + k * thick)
    length = a + b - 2 * setback + allowance
    x0, y0, x1, y1 = panel.pattern.bbox
    assert (x1 - x0, y1 - y0) == pytest.approx((50.0, length), rel=1e-12)
    (line,) = bends(panel)
    assert line.angle == pytest.approx(np.radians(degrees), abs=1e-12)
    assert line.layer == ("BEND_UP" if degrees > 0 else "BEND_DOWN")
    assert line.radius == (inside, inside)
    assert [line.start[1], line.end[1]] == pytest.approx([a - setback + 0.5 * allowance] * 2)
    assert panel.shapes[1].radius == pytest.approx(inside + 0.5 * thick, rel=1e-12)
    middle = 50.0 * (a + b - 2 * setback + theta * (inside + 0.5 * thick))
    assert panel.area == pytest.approx(middle, rel=1e-12)


@pytest.mark.parametrize(
    ("opening", "inside", "thick", "v"), [(90.0, 1.0, 1.0, -1.919), (135.0, 3.0, 2.0, -1.206)]
)
def test_din_6935_shortens_the_legs_by_its_v(tmp_path, opening, inside, thick, v):
    # the values of fabrication.md, 4, with their three digits; legs measured outside
    text = job(
        thick, inside, bracket(60.0, 40.0, 180.0 - opening), neutral='standard = "din6935"',
        more='reference = "back"',
    )  # fmt: skip
    (panel,) = made(tmp_path, text).panels
    assert panel.pattern.bbox[3] - panel.pattern.bbox[1] == pytest.approx(100.0 + v, abs=5e-4)


def test_a_tube_with_its_seam_on_a_crease_is_bent_there_too(tmp_path):
    # a rectangular duct: four flats less two setbacks each, four allowances
    surface = (
        '[surface]\nkind = "cylinder"\ndirection = [0, 0, 1]\nlength = 30\n'
        f'[surface.directrix]\nkind = "polyline"\nclosed = true\n{SQUARE.format(60, 40)}\n'
    )
    (panel,) = made(tmp_path, job(1.5, 2, surface, neutral="k = 0.35")).panels
    length = 2 * (120 + 80) - 8 * 2.75 + 4 * 0.5 * np.pi * (2 + 0.35 * 1.5)
    assert panel.chain.closed
    assert panel.pattern.bbox[3] == pytest.approx(length, rel=1e-12)
    assert [line.angle for line in bends(panel)] == pytest.approx([np.pi / 2] * 4)
    (open_seam,) = made(tmp_path, job(1.5, 2, surface + "").replace(
        "length = 30", "length = 30\ngap = 1"
    )).panels  # fmt: skip
    # where a gap stays open nothing is bent
    assert not open_seam.chain.closed
    assert len(bends(open_seam)) == 3


def test_the_facets_of_a_pyramid_keep_their_planes_and_lose_their_setbacks(tmp_path):
    # by hand: each trapezoid less two strips as wide as the setback, and between two of them a
    # cylinder whose two ends are straight in its development: angle x radius x mean length
    thick, inside = 2.0, 5.0
    (panel,) = made(tmp_path, job(thick, inside, PYRAMID)).panels
    apex = np.array([0.0, 0.0, -300.0])
    corners = np.array([[-120, -80, 0], [120, -80, 0], [120, 80, 0], [-120, 80, 0]], dtype=float)
    normals = []
    for k in range(4):
        n = np.cross(corners[k] - apex, corners[(k + 1) % 4] - apex)
        normals.append(n / np.linalg.norm(n))
    turn = np.arccos(normals[0] @ normals[1])
    setback = (inside + 0.5 * thick) * np.tan(turn / 2)
    area, ends = 0.0, []
    for k in range(4):
        a, b = corners[k], corners[(k + 1) % 4]
        x = (b - a) / np.linalg.norm(b - a)
        y = np.cross(normals[k], x)
        quad = [a, b, apex + 0.4 * (b - apex), apex + 0.4 * (a - apex)]
        flat = np.array([[(p - a) @ x, (p - a) @ y] for p in quad])
        left, own = shapely.Polygon(flat), []
        for first, last in ((1, 2), (3, 0)):
            way = (flat[last] - flat[first]) / np.linalg.norm(flat[last] - flat[first])
            crease = shapely.LineString([flat[first] - 99 * way, flat[last] + 99 * way])
            left = left.difference(crease.buffer(setback, cap_style="flat"))
            own.append(way)
        area += left.area
        ring = np.array(left.exterior.coords[:-1])
        ends.append((ring, flat, own))
    for ring, flat, own in ends:  # by symmetry the neighbour's end is as long as the facet's own
        for (first, _), way in zip(((1, 2), (3, 0)), own, strict=True):
            across = np.array([-way[1], way[0]])
            along = [(p - flat[first]) @ way for p in ring
                     if abs(abs((p - flat[first]) @ across) - setback) < 1e-9]  # fmt: skip
            area += 0.5 * (inside + 0.5 * thick) * turn * np.ptp(along)
    assert [line.angle for line in bends(panel)] == pytest.approx([turn] * 4)
    assert panel.area == pytest.approx(area, rel=1e-9)  # shapely rounds at 1e-12 of 1e3 mm
    frames = [patch.frame(np.linspace(*patch.domain, 5)) for patch in panel.chain.patches[::2]]
    off = [np.abs((f.c0 - apex) @ n).max() for f, n in zip(frames, normals, strict=True)]
    assert max(off) < 1e-10


def test_neighbours_of_a_bend_share_their_rails_ends_to_the_bit(tmp_path):
    (panel,) = made(tmp_path, job(1.5, 2, FANS)).panels
    for before, after in itertools.pairwise(panel.chain.patches):
        one, other = before.jet([before.domain[1]], 0), after.jet([after.domain[0]], 0)
        bent = before.inside_radius or after.inside_radius
        for a, b in ((one.v_from, other.v_from), (one.v_to, other.v_to)):
            apart = np.abs(one.rail(a)[0] - other.rail(b)[0]).max()
            assert apart == 0.0 if bent else apart < 1e-12
    assert all(joint.smooth for joint in panel.chain.around)


@pytest.mark.parametrize(
    ("surface", "count", "more"),
    [
        (FANS, 2, ""),
        pytest.param(SQUARE_TO_DIAMOND, 8, "", marks=pytest.mark.slow),
        pytest.param(SQUARE_TO_DIAMOND, 8, "bend = 0.4", marks=pytest.mark.slow),
        pytest.param(SQUARE_TO_DIAMOND, 8, 'reference = "front"', marks=pytest.mark.slow),
    ],
)
def test_creases_that_fan_out_from_a_corner_get_round_reliefs(tmp_path, surface, count, more):
    thick, inside = 1.5, 2.0
    (panel,) = made(tmp_path, job(thick, inside, surface, more=more)).panels
    pattern = panel.pattern
    assert len(bends(panel)) == count
    radii = []
    assert not any(cut.closed for cut in panel.cuts)
    arcs = [sample(edge, 8) for edge in pattern.outline if edge.name == "cutout"]
    for points in arcs:
        first, last, middle = points[0], points[-1], points[len(points) // 2]
        a, b, c = (np.linalg.norm(x) for x in (middle - first, last - middle, last - first))
        twice = abs(np.cross(np.append(middle - first, 0), np.append(last - first, 0))[2])
        if twice > 1e-3 * c:
            radii.append(a * b * c / (2 * twice))
    # thickness + inside radius at least; no smaller arc is left anywhere
    assert min(radii) > (thick + inside) * (1 - 1e-6)
    assert min(radii) == pytest.approx(thick + inside, rel=1e-6)
    outline = shapely.Polygon(np.concatenate([sample(edge, 256)[:-1] for edge in pattern.outline]))
    assert outline.is_valid
    assert outline.area == pytest.approx(pattern.area, rel=1e-6)  # chords of 256 steps
    assert panel.mesh.watertight
    # K = 0.5: area x thickness, the mesh within area x tolerance
    assert volume(panel.mesh) == pytest.approx(thick * panel.area, abs=0.05 * panel.area)


def test_a_bend_between_a_plane_and_a_tube_touches_both(tmp_path):
    # a circle of radius r inside a circle of radius 50 that touches its chord through the centre:
    # its own centre is r above the chord and 50 - r from the middle
    thick, inside = 2.0, 3.0
    (panel,) = made(tmp_path, job(thick, inside, D_TUBE)).panels
    r = inside + 0.5 * thick
    half = np.sqrt((50 - r) ** 2 - r**2)
    beta = np.arcsin(r / (50 - r))
    turn = np.pi / 2 + beta
    assert [line.angle for line in bends(panel)] == pytest.approx([turn] * 2, rel=1e-12)
    length = 2 * half + 2 * r * turn + 50 * (np.pi - 2 * beta)
    assert panel.pattern.bbox[3] == pytest.approx(length, rel=1e-12)
    assert {round(shape.radius, 9) for shape in panel.shapes if shape.radius} == {r, 50.0}


def test_a_bend_that_needs_more_than_a_face_has_is_refused(tmp_path):
    with pytest.raises(GeometryError, match="the bends beside the face") as caught:
        made(tmp_path, job(1.0, 60, bracket(40.0, 70.0, 90.0)))
    assert caught.value.value == pytest.approx(60.5)
    assert caught.value.limit == pytest.approx(40.0)
    channel = (
        bracket(40.0, 30.0, 90.0).replace("]]", ", 0], [0, 30, 0]]").replace(", 0, 0], [0", "], [0")
    )
    channel = channel.replace("points = ", "points = ")
    with pytest.raises(GeometryError) as caught:
        made(tmp_path, job(1.0, 20, folded((0, 40), (0, 0), (30, 0), (30, 40))))
    assert caught.value.limit == pytest.approx(30.0)
    assert caught.value.value == pytest.approx(41.0)


def test_a_crease_beside_a_cone_is_refused(tmp_path):
    surface = D_TUBE.replace('"cylinder"', '"cone"').replace(
        "direction = [0, 0, 1]\nlength = 100", "apex = [0, 0, 100]\nextent = [0.2, 1]"
    )
    with pytest.raises(GeometryError, match="neither plane nor a cylinder"):
        made(tmp_path, job(0, 2, surface))


def test_no_inside_radius_leaves_creases_sharp(tmp_path):
    panels = [
        made(tmp_path, job(1.0, inside, bracket(40.0, 30.0, 90.0))).panels[0]
        for inside in (None, 0)
    ]
    for panel in panels:
        assert len(panel.chain.patches) == 2
        assert panel.pattern.bbox[3] == pytest.approx(70.0)


@pytest.mark.slow
def test_the_step_solid_has_cylinders_of_the_inside_and_the_outside_radius(tmp_path):
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepGProp import BRepGProp
    from OCP.GeomAbs import GeomAbs_SurfaceType
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    thick, inside = 2.0, 5.0
    part = made(tmp_path, job(thick, inside, PYRAMID))
    devcad.export(part, tmp_path, formats=["step"])
    reader = STEPControl_Reader()
    reader.ReadFile(str(tmp_path / "job" / "job.step"))
    reader.TransferRoots()
    shape = reader.OneShape()
    radii = []
    faces = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while faces.More():
        surface = BRepAdaptor_Surface(TopoDS.Face(faces.Current()))
        if surface.GetType() == GeomAbs_SurfaceType.GeomAbs_Cylinder:
            radii.append(surface.Cylinder().Radius())
        faces.Next()
    assert sorted(radii) == pytest.approx([inside] * 4 + [inside + thick] * 4, rel=1e-9)
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found)
    assert found.Mass() == pytest.approx(thick * part.panels[0].area, rel=1e-9)
