"""The page of a job in Chromium: it folds, it is quick, it asks nobody, names are text."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import clients
import numpy as np
import pytest
from chromium import Browser

import devcad
from devcad.part import Part
from devcad.poses import poses

pytestmark = pytest.mark.clients

SAMPLES = clients.REPOSITORY / "samples"
SHOWN = (
    "lampshade",
    "spacelike-cone",
    "vent-cowl",
    "hull-strips",
    "square-duct",
    "nameplate",
    "folded-annulus",
    "lens-packet",
)
HOSTILE = "</script><script>document.title='taken'</script>\"'><img src=x onerror=alert(1)>\u2028"

Opened = tuple[Browser, float, Part]


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with Browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.fixture(scope="module", params=SHOWN)
def shown(
    request: pytest.FixtureRequest, browser: Browser, tmp_path_factory: pytest.TempPathFactory
) -> Opened:
    """A sample's page in the browser, how long it took, and the part."""
    part = devcad.build(SAMPLES / f"{request.param}.toml")
    out = tmp_path_factory.mktemp("page")
    devcad.export(part, out, formats=["svg"])
    return browser, browser.open(out / part.name / "index.html"), part


def points(browser: Browser, f: float) -> np.ndarray:
    found = browser.run(f"Array.from(devcad.at({f}))")
    return np.array(found, dtype=np.float32).reshape(-1, 3)


def triangles(browser: Browser) -> np.ndarray:
    """Of all panels, in the numbers of ``at``."""
    each = browser.run("devcad.triangles.map((t) => Array.from(t))")
    start, out = 0, []
    for numbers in each:
        out.append(start + np.array(numbers).reshape(-1, 3))
        start = out[-1].max() + 1
    return np.concatenate(out)


def slide(browser: Browser, f: float) -> None:
    browser.run(
        f"(() => {{ const s = document.getElementById('unroll'); s.value = {1000 * f};"
        " s.dispatchEvent(new Event('input')); })()"
    )
    browser.run("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def pixels(browser: Browser) -> list[int]:
    """What the stage looks like, coarsely: of every 16th place whether there is anything."""
    return browser.run(
        "(() => { const c = document.getElementById('canvas'); const d = document.createElement("
        "'canvas'); d.width = 64; d.height = 64; const x = d.getContext('2d', {willReadFrequently:"
        " true}); devcad.redraw(); x.drawImage(c, 0, 0, 64, 64); return"
        " Array.from(x.getImageData(0, 0, 64, 64).data).filter((_, i) => i % 4 === 3); })()"
    )


def test_it_is_ready_in_three_seconds_and_asks_for_nothing(shown: Opened) -> None:
    browser, seconds, _ = shown
    assert seconds < 3.0
    assert len(browser.requests()) == 1  # the page itself
    assert browser.complaints() == []
    assert browser.run("devcad.painter()") == "webgl"


def test_every_length_is_kept_at_every_position(shown: Opened) -> None:
    browser, _, part = shown
    index = triangles(browser)

    def lengths(f: float) -> np.ndarray:
        corner = points(browser, f)[index].astype(float)
        return np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)

    size = max(float(np.abs(points(browser, f)).max()) for f in (0.0, 0.5, 1.0))
    for f in (0.3, 0.7, 1.0):
        # three coordinates of both ends, each rounded to half a step
        limit = 2 * np.sqrt(3.0) * 2.0**-24 * size * 2
        if any(panel.flanks for panel in part.panels):
            limit = part.tolerance / 50  # points are on the bent surface: chords of its arcs
        assert np.abs(lengths(f) - lengths(0.0)).max() < limit


def test_it_begins_as_the_part_and_ends_as_the_pattern(shown: Opened) -> None:
    browser, _, part = shown
    start, end = points(browser, 0.0), points(browser, 1.0)
    mesh = np.concatenate([panel.mesh.vertices for panel in part.panels])
    low, high = mesh.min(axis=0), mesh.max(axis=0)
    limit = 0.5 * part.thickness * 1.5 + part.tolerance  # the middle lies between the skins
    assert np.abs(start.min(axis=0) - low).max() < limit
    assert np.abs(start.max(axis=0) - high).max() < limit
    assert np.abs(end[:, 2]).max() < 1e-3
    x0, y0, x1, y1 = part.panels[0].pattern.bbox
    assert np.abs(end[:, 0].min() - x0) < 2 * part.tolerance
    assert np.abs(end[:, 1].min() - y0) < 2 * part.tolerance
    if len(part.panels) == 1:
        assert np.abs(end[:, :2].max(axis=0) - [x1, y1]).max() < 2 * part.tolerance


def test_a_sheet_with_creases_folds_as_its_own_poses(shown: Opened) -> None:
    browser, _, part = shown
    (panel, *_) = part.panels
    if not panel.flanks or panel.thickness:
        return
    for f in (0.25, 0.6):
        (exact,) = poses(panel, [1.0 - f])
        found = points(browser, f)[:: len(exact.vertices) // 40]
        # poses stand elsewhere: compared are distances from the first corner, which both begin with
        far = [np.linalg.norm(each - each[0], axis=1) for each in (exact.vertices, found)]
        assert np.abs(far[0][:, None] - far[1]).min(axis=0).max() < 1e-4


def test_the_slider_moves_what_is_seen(shown: Opened) -> None:
    browser, _, part = shown
    if part.name == "nameplate":
        return  # it is flat from the beginning
    slide(browser, 0.0)
    before = pixels(browser)
    slide(browser, 0.6)
    assert sum(map(bool, before)) > 100
    assert sum(bool(a) != bool(b) for a, b in zip(before, pixels(browser), strict=True)) > 40
    slide(browser, 0.0)


def test_thirty_frames_a_second_while_sliding(shown: Opened) -> None:
    """Without a graphics card, in the best of six half seconds: the machine does other things."""
    browser, _, _ = shown
    slid = (
        "new Promise((done) => { const s = document.getElementById('unroll'); const start ="
        " performance.now(); const first = devcad.frames(); let n = 0; const step = () => {"
        " s.value = (n * 7) % 1000; s.dispatchEvent(new Event('input')); n += 1;"
        " if (performance.now() - start < 500) requestAnimationFrame(step);"
        " else done(1000 * (devcad.frames() - first) / (performance.now() - start)); }; step(); })"
    )
    assert max(browser.run(slid) for _ in range(6)) >= 30.0


def test_a_ruling_under_the_pointer_lights_up_in_both_pictures(shown: Opened) -> None:
    browser, _, _ = shown
    slide(browser, 0.0)
    box = browser.run(
        "(() => { const e = document.querySelector('.CUT_OUTER'); const b ="
        " e.getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; })()"
    )
    shared = "['ruling', 'ruling3d'].map((i) => !document.getElementById(i).hasAttribute('hidden'))"
    browser.mouse("mouseMoved", 2, 2)
    assert browser.run(shared) == [False, False]
    seen = []
    for x in np.linspace(0.01, 0.99, 60):  # from one corner of the pattern to the other
        browser.mouse("mouseMoved", box[0] + x * box[2], box[1] + x * box[3])
        seen.append(browser.run(shared))
        if seen[-1] == [True, True]:
            break
    assert seen[-1] == [True, True]
    assert "ruling" in browser.run("document.getElementById('told').textContent")
    browser.mouse("mouseMoved", 2, 2)
    assert browser.run(shared) == [False, False]


def test_keys_turn_the_part_and_go_through_the_rulings(browser: Browser, shown: Opened) -> None:
    browser.run("document.getElementById('stage').focus()")
    before = pixels(browser)
    for _ in range(6):
        browser.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowRight")
    assert pixels(browser) != before
    browser.call("Input.dispatchKeyEvent", type="keyDown", key="Home")
    browser.call("Input.dispatchKeyEvent", type="keyDown", key=".")
    assert "ruling 1 of" in browser.run("document.getElementById('told').textContent")
    browser.call("Input.dispatchKeyEvent", type="keyDown", key="Escape")


def test_layers_go_on_and_off(shown: Opened) -> None:
    browser, _, _ = shown
    outline = "document.querySelector('[data-layer=CUT_OUTER]').hasAttribute('hidden')"
    box = "document.querySelector('[data-toggles=CUT_OUTER]').click()"
    assert browser.run(outline) is False
    browser.run(box)
    assert browser.run(outline) is True
    browser.run(box)
    assert browser.run(outline) is False


def test_colours_have_their_scale(shown: Opened) -> None:
    browser, _, part = shown
    if browser.run("document.getElementById('colour').disabled"):
        assert part.name in ("nameplate", "square-duct")  # nothing is curved
        return
    for mode in (1, 2):
        browser.run(
            "(() => { const c = document.getElementById('colour'); c.value ="
            f" '{mode}'; c.dispatchEvent(new Event('change')); }})()"
        )
        assert "mm" in browser.run("document.getElementById('word0').textContent")
        assert browser.complaints() == []


def test_hostile_names_do_nothing(browser: Browser, tmp_path: Path) -> None:
    part = devcad.build(SAMPLES / "nameplate.toml")
    (panel,) = part.panels
    bad = replace(part, panels=(replace(panel, name=HOSTILE),), description=HOSTILE)
    from devcad.report import make_report
    from devcad.report.page import job_page

    page = tmp_path / "index.html"
    page.write_bytes(job_page(bad, make_report(bad, checks=bad.checks)))
    browser.open(page)
    assert browser.run("document.title") == "nameplate"
    assert browser.run("document.querySelectorAll('img').length") == 0
    assert HOSTILE in browser.run("document.querySelector('header').textContent")
    assert (browser.complaints(), len(browser.requests())) == ([], 1)


def test_the_policy_holds(browser: Browser, shown: Opened) -> None:
    """What a page might be tricked into does not work: no connection, no other script, no style."""
    assert browser.run("fetch('https://example.org/').then(() => 'sent', () => 'refused')") == (
        "refused"
    )
    browser.run(
        "(() => { const s = document.createElement('script'); s.textContent = 'window.taken = 1';"
        " document.body.append(s); })()"
    )
    assert browser.run("window.taken === undefined")
    assert browser.run("(() => { try { return eval('1') } catch (e) { return 'refused' } })()") == (
        "refused"
    )
    browser.events.clear()  # of these tries


@pytest.mark.parametrize("name", ["lampshade", "vent-cowl"])
def test_without_webgl_the_same_is_drawn_as_svg(name: str, tmp_path: Path) -> None:
    part = devcad.build(SAMPLES / f"{name}.toml")
    devcad.export(part, tmp_path / "out", formats=["svg"])
    with Browser(tmp_path / "profile", "--disable-3d-apis") as browser:
        browser.open(tmp_path / "out" / part.name / "index.html")
        assert browser.run("devcad.painter()") == "svg"
        first = browser.run("document.querySelector('#painted path').getAttribute('d')")
        slide(browser, 0.5)
        assert browser.run("document.querySelector('#painted path').getAttribute('d')") != first
        assert browser.complaints() == []


def test_all_of_the_part_is_in_view(browser: Browser, tmp_path: Path) -> None:
    part = devcad.build(SAMPLES / "wall-bracket.toml")  # its corners reach the ball around it
    devcad.export(part, tmp_path, formats=["svg"])
    browser.open(tmp_path / part.name / "index.html")
    for f in (0.0, 0.5, 1.0):
        slide(browser, f)
        seen = np.array(pixels(browser)).reshape(64, 64) > 0
        assert seen.any()
        assert not np.concatenate([seen[[0, -1]].ravel(), seen[:, [0, -1]].ravel()]).any()


def test_rulings_show_all_around_the_part(browser: Browser, tmp_path: Path) -> None:
    part = devcad.build(SAMPLES / "drilled-reducer.toml")
    devcad.export(part, tmp_path, formats=["svg"])
    browser.open(tmp_path / part.name / "index.html")
    with_rulings = row(browser)
    browser.run("document.getElementById('show-rulings').click()")
    drawn = np.abs(with_rulings - row(browser)) > 8
    inside = drawn[drawn.argmax() : drawn.size - drawn[::-1].argmax()]
    assert all(share.any() for share in np.array_split(inside, 8))


def row(browser: Browser) -> np.ndarray:
    """The red of the pixels half way down the stage."""
    found = browser.run(
        "(() => { const c = document.getElementById('canvas'); const d = document.createElement("
        "'canvas'); d.width = c.width; d.height = 1; const x = d.getContext('2d'); devcad.redraw();"
        " x.drawImage(c, 0, -Math.round(0.5 * c.height)); return"
        " Array.from(x.getImageData(0, 0, c.width, 1).data).filter((_, i) => i % 4 === 0); })()"
    )
    return np.array(found, dtype=int)
