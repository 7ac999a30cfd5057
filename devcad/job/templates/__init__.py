"""Job files to start from: one for each surface kind, each builds as it stands.

KIND.toml beside this file holds a kind's part: a title, the sheet's thickness, the surface's keys.
"""

from __future__ import annotations

from importlib.resources import files

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


def template_kinds() -> list[str]:
    """The kinds that have a template, by name."""
    names = (entry.name for entry in files(__name__).iterdir())
    return sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml"))


def template(kind: str) -> str:
    """The commented job file of a kind; FileNotFoundError where there is none."""
    text = files(__name__).joinpath(f"{kind}.toml").read_text(encoding="ascii")
    title, thickness, body = text.split("\n", 2)
    return (
        _HEADER.format(
            title=title.removeprefix("# "),
            kind=kind,
            thickness=thickness.removeprefix("# thickness "),
        )
        + body
    )
