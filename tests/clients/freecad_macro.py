"""Runs inside FreeCAD (any Python 3): opens the listed STEP, DXF and SVG files, writes what it saw.

The file list and the answer's path come by environment variables, because freecadcmd opens its
arguments as documents. Each answer is a line [file, facts], written at once: a file that crashes
FreeCAD is the first one without a line.
"""

import json
import os
import traceback
from pathlib import Path

import FreeCAD
import Import
import importSVG
import Part


def step_facts(path):
    shape = Part.Shape()
    shape.read(path)
    boolean_check = "ok"
    for body in shape.Solids or shape.Shells:  # one by one: neighbouring panels touch each other
        try:
            body.check(True)  # True: as before boolean operations, stricter than validity
        except Exception as problem:
            boolean_check = str(problem)
    # By default its 0.20 without a window crashes on every assembly, its own kernel's too.
    settings = FreeCAD.ParamGet("User parameter:BaseApp/Preferences/Mod/Import/hSTEP")
    settings.SetBool("ReadShapeCompoundMode", False)
    document = FreeCAD.newDocument()
    Import.insert(path, document.Name)
    labels = [thing.Label for thing in document.Objects]
    FreeCAD.closeDocument(document.Name)
    return {
        "valid": shape.isValid(),
        "boolean_check": boolean_check,
        "solids": len(shape.Solids),
        "faces": len(shape.Faces),
        "closed_shells": [shell.isClosed() for shell in shape.Shells],
        "area": shape.Area,
        "volume": sum(solid.Volume for solid in shape.Solids),
        "labels": labels,
    }


def dxf_facts(path):
    settings = FreeCAD.ParamGet("User parameter:BaseApp/Preferences/Mod/Draft")
    settings.SetBool("dxfUseLegacyImporter", False)
    settings.SetBool("dxfShowDialog", False)
    settings.SetBool("groupLayers", True)
    document = FreeCAD.newDocument()
    Import.readDXF(path, document.Name)
    document.recompute()
    layers = {}
    for thing in document.Objects:
        shape = getattr(thing, "Shape", None)
        if shape is not None and not shape.isNull():
            box = shape.BoundBox
            layers[thing.Label] = {
                "length": sum(edge.Length for edge in shape.Edges),
                "edges": len(shape.Edges),
                "size": [box.XLength, box.YLength],
            }
    FreeCAD.closeDocument(document.Name)
    return {"layers": layers}


def svg_facts(path):
    document = FreeCAD.newDocument()
    importSVG.insert(path, document.Name)
    shapes = [thing.Shape for thing in document.Objects if hasattr(thing, "Shape")]
    outline = max(shapes, key=lambda shape: shape.Length)
    box = outline.BoundBox
    facts = {"outline": {"length": outline.Length, "size": [box.XLength, box.YLength]}}
    FreeCAD.closeDocument(document.Name)
    return facts


READERS = {".step": step_facts, ".dxf": dxf_facts, ".svg": svg_facts}


def facts(path):
    try:
        return READERS[Path(path).suffix.lower()](path)
    except Exception:
        return {"error": traceback.format_exc()}


with Path(os.environ["DEVCAD_ANSWER"]).open("a") as answer:
    for file in Path(os.environ["DEVCAD_FILES"]).read_text().split("\n"):
        answer.write(json.dumps([file, facts(file)]) + "\n")
        answer.flush()
os._exit(0)  # at once: nothing is saved, not even the import settings made above
