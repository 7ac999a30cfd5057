"""What a job's page says in words: its head, the tools beside the pictures, the tables."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any
from urllib.parse import quote

from devcad import __version__
from devcad.part import Part
from devcad.report.drawing import DIMENSIONS, HIDDEN, RULINGS
from devcad.report.pieces import Piece

LAYERS = {
    RULINGS: "rulings of the mesh",
    "RULING": "ruling lines",
    "CUT_OUTER": "outline",
    "CUT_INNER": "holes",
    "STITCH": "stitch holes",
    "BEND_UP": "bends up",
    "BEND_DOWN": "bends down",
    "SCORE": "scored creases",
    "ENGRAVE": "engraving",
    "MARK": "marks",
    "LABEL": "labels",
    "GRAIN": "grain",
    "GLUE": "glue",
    "SEW": "sewing lines",
    "NOTCH_MARK": "notches",
    DIMENSIONS: "dimensions",
}
"""Words for the layers of a pattern, where there are better ones than their names."""
FACTS = (
    ("type", "surface", ""),
    ("area", "area", "mm²"),
    ("flat_area", "blank", "mm²"),
    ("flat_bbox", "blank's box", "mm"),
    ("min_radius", "smallest radius", "mm"),
    ("ruling_count", "rulings", ""),
    ("cut_length", "length of cut", "mm"),
    ("mass_g", "mass", "g"),
)
"""What is told of every panel: key of the report, words, unit."""
CHECKED = ' checked=""'
EXACT = (
    "Every length on the part is kept at every position of the slider: its facets turn about the "
    "rulings as rigid pieces."
)
SCORED = (
    "A sheet with curved creases folds at all of them together: at every position of the slider "
    "its creases are closed, and its rulings lie on the bent surface, as they do in the pattern."
)
IDLE = "Point at a ruling, here or on the pattern; keys , and . go from one to the next."
KEYS = (
    "Drag to turn, drag with Shift or with two fingers to move, wheel or two fingers to come "
    "nearer. Keys: arrows turn, Shift and arrows move, + and - zoom, Home resets, comma and full "
    "stop go through the rulings."
)


def header(part: Part, report: dict[str, Any]) -> str:
    """The name and what the part is."""
    words = [
        part.description,
        f"part number {part.part_number}" if part.part_number else "",
        f"revision {part.revision}" if part.revision else "",
        part.material,
        f"{part.thickness:g} mm thick" if part.thickness else "a surface without thickness",
        f"{len(part.panels)} panels" if len(part.panels) > 1 else "",
        f"{part.quantity} of each" if part.quantity > 1 else "",
        f"within {part.tolerance:g} mm",
    ]
    told = " · ".join(f"<bdi>{escape(word)}</bdi>" for word in words if word)
    return f"<header><h1><bdi>{escape(part.name)}</bdi></h1><p>{told}</p></header>"


def viewer(picture: str, part: Part, pieces: Sequence[Piece | None]) -> str:
    """The part in space with its tools; the picture shows until the script runs, or instead."""
    there = [piece for piece in pieces if piece is not None]
    hidden = "" if there else ' hidden=""'
    moves = any(piece.moves for piece in there)
    still = "" if moves else ' disabled=""'
    scored = any(piece.fold is not None for piece in there)
    return f"""<section class="card part" aria-labelledby="part-title">
<h2 id="part-title">The part</h2>
<div class="still">{picture}</div>
<div id="stage" tabindex="0" role="application" aria-label="The part in three dimensions" \
aria-describedby="keys"{hidden}>
<canvas id="canvas"></canvas>
<svg id="painted" hidden="" aria-hidden="true"></svg>
<svg id="overlay" aria-hidden="true"><line id="ruling3d" class="chosen" hidden=""/></svg>
</div>
<div class="controls"{hidden}>
<label class="unroll">unroll <input id="unroll" type="range" min="0" max="1000" value="0" \
aria-describedby="exact"{still}><output id="unrolled" for="unroll">as built</output></label>
<button id="play" type="button" aria-pressed="false"{still}>play</button>
<button id="home" type="button">reset view</button>
</div>
<div class="controls"{hidden}>
<label>colour <select id="colour"><option value="0">sheet</option>\
<option value="1">curvature</option><option value="2">bend radius</option></select></label>
<label><input id="show-rulings" type="checkbox" checked=""> rulings</label>
<label><input id="show-curve" type="checkbox" checked=""> regression curve</label>
<label{"" if scored else ' hidden=""'}><input id="show-creases" type="checkbox" checked=""> \
creases</label>
<svg id="legend" hidden="" viewBox="0 0 300 34" role="img" aria-label="scale of the colours">
<defs><linearGradient id="scale"><stop id="stop0" offset="0"/><stop id="stop1" offset="0.5"/>\
<stop id="stop2" offset="1"/></linearGradient></defs>
<rect width="300" height="12" rx="3" fill="url(#scale)"/>
<text id="word0" x="0" y="28"></text><text id="word1" x="150" y="28" text-anchor="middle"></text>
<text id="word2" x="300" y="28" text-anchor="end"></text></svg>
</div>
<p id="told" role="status" data-idle="{escape(IDLE)}">{escape(IDLE)}</p>
<p class="note" id="exact">{_kept(part, pieces)}</p>
<p class="note" id="keys">{escape(KEYS)}</p>
</section>"""


def _kept(part: Part, pieces: Sequence[Piece | None]) -> str:
    """What the slider does to lengths."""
    words = []
    if any(piece is not None and piece.fold is None for piece in pieces):
        words.append(EXACT)
    if any(piece is not None and piece.fold is not None and piece.moves for piece in pieces):
        words.append(SCORED)
    for panel, piece in zip(part.panels, pieces, strict=True):
        if piece is not None and not piece.moves and piece.fold is not None:
            name, why = escape(panel.name), escape(piece.fold.why)
            words.append(
                f"<bdi>{name}</bdi> stands still, as it has no motion with fixed rulings: "
                f"<bdi>{why}</bdi>."
            )
    return " ".join(words)


def pattern(drawn: str, layers: Sequence[str], several: bool) -> str:
    """The patterns with a box for each layer."""
    boxes = "\n".join(
        f'<label><input type="checkbox" data-toggles="{escape(name)}"'
        f"{'' if name in HIDDEN else CHECKED}> "
        f"{escape(LAYERS.get(name, name))}</label>"
        for name in layers
    )
    title = "The flat patterns" if several else "The flat pattern"
    return f"""<section class="card" aria-labelledby="pattern-title">
<h2 id="pattern-title">{title}</h2>
{drawn}
<div class="controls">
{boxes}
<button id="print" type="button">print</button>
</div>
<p class="note">Front up. To be looked at: cut from the DXF, SVG or PDF files.</p>
</section>"""


def panels(report: dict[str, Any]) -> str:
    """A table of the panels' figures; nothing where the report has none."""
    rows = [
        [f"<bdi>{escape(panel['name'])}</bdi>", *(_shown(panel.get(key)) for key, *_ in FACTS)]
        for panel in report["panels"]
    ]
    heads = ["panel", *(f"{words} {unit}".strip() for _, words, unit in FACTS)]
    notes = [
        f'<p class="note"><bdi>{escape(panel["name"])}</bdi>: <bdi>{escape(note)}</bdi></p>'
        for panel in report["panels"]
        for note in panel.get("notes") or ()
    ]
    return _table("Panels", heads, rows, "\n".join(notes))


def folds(part: Part) -> str:
    """A table of the curved creases, each with a plot of its fold angle; nothing where there are
    none."""
    rows = []
    for panel in part.panels:
        for number, fold in enumerate(panel.facts.get("folds") or (), start=1):
            s, angle = ([row[key] for row in fold["table"]] for key in ("s", "fold_deg"))
            low, high = min(map(abs, angle)), max(map(abs, angle))
            even = high - low < 5e-3
            rows.append(
                [
                    f"<bdi>{escape(panel.name)}</bdi>",
                    str(number),
                    escape(fold["way"]),
                    f"{fold['length']:.2f}",
                    f"{high:.2f}" if even else f"{low:.2f} to {high:.2f}",
                    _plot(s, [abs(a) for a in angle]),
                ]
            )
    heads = ["panel", "crease", "way", "length mm", "fold angle °", "fold angle along the crease"]
    return _table("Creases", heads, rows)


def _plot(x: Sequence[float], y: Sequence[float]) -> str:
    """A curve y(x), from 0 up, as a small picture."""
    width, height, top = 180.0, 36.0, max(y) * 1.08 or 1.0
    span = x[-1] - x[0] or 1.0
    places = [
        (width * (a - x[0]) / span, height * (1.0 - b / top)) for a, b in zip(x, y, strict=True)
    ]
    run = "L".join(f"{a:.1f} {b:.1f}" for a, b in places)
    return (
        f'<svg class="plot" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" '
        f'height="{height:.0f}" role="img" aria-label="from {y[0]:.2f}° at the start of the crease '
        f'to {y[-1]:.2f}° at its end"><path class="axis" d="M0 {height:.0f}H{width:.0f}"/>'
        f'<path class="line SCORE" d="M{run}"/></svg>'
    )


def motions(report: dict[str, Any]) -> str:
    """A table of the mechanisms' motions, clockwise and counterclockwise; nothing without any."""
    rows = [
        [
            f"<bdi>{escape(', '.join(dict.fromkeys(item['panels'])))}</bdi>",
            _shown(item["class"]),
            str(item["degrees_of_freedom"]),
            *(_both_ways(item.get(key)) for key in ("range_deg", "outside_deg", "inside_deg")),
            _shown(item.get("mobility")),
            escape("; ".join(item["notes"])),
        ]
        for item in report.get("motion", [])
    ]
    heads = ["panels", "class", "freedom", "range °", "outside °", "inside °", "mobility", ""]
    return _table("Motion", heads, rows)


def _both_ways(turns: list[float] | None) -> str:
    """Two turns as a cell's text."""
    return "–" if turns is None else f"−{turns[0]:.2f} … +{turns[1]:.2f}"


def checks(report: dict[str, Any]) -> str:
    """A table of the checks; what failed here was allowed to."""
    rows = [
        [
            f"<bdi>{escape(item['panel'])}</bdi>",
            escape(item["name"]),
            _shown(item["value"]),
            _shown(item["limit"]),
            escape(item["unit"]),
            '<span class="ok">holds</span>'
            if item["passed"]
            else '<span class="failed">failed, allowed</span>',
        ]
        for item in report["checks"]
    ]
    return _table("Checks", ["panel", "check", "value", "limit", "unit", ""], rows)


def files(report: dict[str, Any]) -> str:
    """A table of the files with their hashes; each leads to the file beside the page."""
    rows = [
        [
            f'<a href="{escape(quote(item["path"]))}"><bdi>{escape(item["path"])}</bdi></a>',
            f"{item['bytes'] / 1000:.1f} kB",
            f"within {item['max_deviation']:.2g} mm" if item["max_deviation"] else "exact",
            escape(item.get("note", "")),
            f"<code>{escape(item['sha256'])}</code>",
        ]
        for item in report["files"]
    ]
    return _table("Files", ["file", "size", "true to the surface", "note", "SHA-256"], rows)


def footer(report: dict[str, Any]) -> str:
    """Who made the page, of which job."""
    job = report.get("job_sha256")
    of = f" · job <code>{escape(job)}</code>" if job else ""
    return f"<footer><p>devcad {escape(__version__)}{of}</p></footer>"


def _table(title: str, heads: Sequence[str], rows: Sequence[Sequence[str]], below: str = "") -> str:
    if not rows:
        return ""
    head = "".join(f'<th scope="col">{escape(word)}</th>' for word in heads)
    body = "\n".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return f"""<section class="card"><h2>{escape(title)}</h2>
<div class="scroll"><table><thead><tr>{head}</tr></thead>
<tbody>
{body}
</tbody></table></div>{below}</section>"""


def _shown(value: Any) -> str:
    """A value of the report as a cell's text."""
    if value is None:
        return "–"
    if isinstance(value, list):
        x0, y0, x1, y1 = value
        return f"{x1 - x0:.2f} × {y1 - y0:.2f}"
    if isinstance(value, float):
        return f"{value:.6g}" if abs(value) >= 1.0 else f"{value:.3g}"
    return escape(str(value))
