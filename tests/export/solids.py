"""What OpenCASCADE measures on a STEP file that a test wrote."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import parts
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepGProp import BRepGProp
from OCP.GeomAbs import GeomAbs_Plane
from OCP.GProp import GProp_GProps
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS, TopoDS_Shape

from devcad.export import Options, Written
from devcad.export.step import write
from devcad.geometry.cuts import Cut
from devcad.part import Panel


def cut_out(panel: Panel, cuts: tuple[Cut, ...], removed: float) -> Panel:
    """The panel with cuts that take ``removed`` mm2 off its pattern."""
    pattern = replace(panel.pattern, area=panel.pattern.area - removed)
    return replace(panel, cuts=cuts, pattern=pattern)


def export(panel: Panel, folder: Path, **keys: object) -> Written:
    (made,) = write(parts.part(panel), folder, Options(**keys))  # type: ignore[arg-type]
    return made


def read(path: Path) -> TopoDS_Shape:
    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    return reader.OneShape()


def walk(shape: TopoDS_Shape, kind: object) -> Iterator[TopoDS_Shape]:
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def kinds(shape: TopoDS_Shape) -> Counter[str]:
    """How many faces of each surface there are."""
    return Counter(
        str(BRepAdaptor_Surface(TopoDS.Face(f)).GetType()).split("_")[-1]
        for f in walk(shape, TopAbs_FACE)
    )


def curves(shape: TopoDS_Shape) -> Counter[str]:
    """How many uses of edges on each curve there are."""
    edges = (TopoDS.Edge(e) for e in walk(shape, TopAbs_EDGE))
    return Counter(
        str(BRepAdaptor_Curve(e).GetType()).split("_")[-1]
        for e in edges
        if not BRep_Tool.Degenerated_s(e)
    )


def area(shape: TopoDS_Shape) -> float:
    """By adaptive quadrature, face by face."""
    total = 0.0
    for face in walk(shape, TopAbs_FACE):
        found = GProp_GProps()
        BRepGProp.SurfaceProperties_s(face, found, 1e-10)
        total += found.Mass()
    return total


def volume(shape: TopoDS_Shape) -> float:
    """By adaptive quadrature."""
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found, 1e-10, True, True)
    return float(found.Mass())


def plain_area(shape: TopoDS_Shape) -> float:
    """As most programs compute it, without adaptation."""
    found = GProp_GProps()
    BRepGProp.SurfaceProperties_s(shape, found)
    return float(found.Mass())


def plain_volume(shape: TopoDS_Shape) -> float:
    """As most programs compute it, without adaptation."""
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found)
    return float(found.Mass())


def image_gap(shape: TopoDS_Shape) -> float:
    """The largest distance of an edge from its image on a curved face at one parameter, mm."""
    worst = 0.0
    for face in map(TopoDS.Face, walk(shape, TopAbs_FACE)):
        if BRepAdaptor_Surface(face).GetType() == GeomAbs_Plane:
            continue
        for edge in map(TopoDS.Edge, walk(face, TopAbs_EDGE)):
            if BRep_Tool.Degenerated_s(edge):
                continue
            space, image = BRepAdaptor_Curve(edge), BRepAdaptor_Curve(edge, face)
            for s in np.linspace(space.FirstParameter(), space.LastParameter(), 101).tolist():
                worst = max(worst, space.Value(s).Distance(image.Value(s)))
    return worst


def taken(panel: Panel, cuts: tuple[Cut, ...]) -> float:
    """The area inside closed contours, by Green's theorem: the integral of q v + a v^2 / 2 over t
    around each, with q + v a the width of the surface between rulings."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    total = 0.0
    for one in cuts:
        inside = 0.0
        for track in one.tracks:
            patch = panel.chain.patches[track.patch]
            for low, high in pairwise(track.series.knots.tolist()):
                u = 0.5 * (low + high) + 0.5 * (high - low) * nodes
                t, v, dt, _ = track(u)
                f = patch.frame(t)
                inside += 0.5 * (high - low) * float(weights @ ((f.q + 0.5 * f.a * v) * v * dt))
        total += abs(inside)
    return total
