"""Runs inside FreeCAD (any Python 3): opens the listed STEP and DXF files, writes what it saw.

The file list and the answer's path come by environment variables, because freecadcmd opens its
arguments as documents; its exit code is always 0, so the answer is the only sign of life.
"""

import json
import os
import traceback
from pathlib import Path

import FreeCAD
import Import
import Part


def step_facts(path):
    shape = Part.Shape()
    shape.read(path)
    try:
        shape.check(True)  # True: the check made before boolean operations, stricter than validity
        boolean_check = "ok"
    except Exception as problem:
        boolean_check = str(problem)
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


def facts(path):
    try:
        return dxf_facts(path) if path.lower().endswith(".dxf") else step_facts(path)
    except Exception:
        return {"error": traceback.format_exc()}


files = Path(os.environ["DEVCAD_FILES"]).read_text().split("\n")
seen = {"version": FreeCAD.Version()[:3], "files": {f: facts(f) for f in files}}
Path(os.environ["DEVCAD_ANSWER"]).write_text(json.dumps(seen))
os._exit(0)  # at once: nothing is saved, not even the import settings made above
