"""Stroke text: sizes, smoothness and which characters there are."""

from __future__ import annotations

import string

import numpy as np
import pytest

from devcad.errors import JobError
from devcad.flatten.lettering import lettering, text_box
from devcad.flatten.pattern import Edge, sample
from devcad.geometry.taylor import Array

PRINTABLE = "".join(c for c in map(chr, range(33, 127)))


def points(edges: tuple[Edge, ...]) -> Array:
    return np.concatenate([sample(edge, 16) for edge in edges])


@pytest.mark.parametrize("letter", "AEHIMNTXZ")
@pytest.mark.parametrize("height", [0.1, 5.0, 400.0])
def test_a_capital_stands_on_the_baseline_and_is_as_high_as_asked(
    letter: str, height: float
) -> None:
    y = points(lettering(letter, height))[:, 1]
    assert y.min() == pytest.approx(0.0, abs=1e-12 * height)
    assert y.max() == pytest.approx(height, rel=1e-12)


@pytest.mark.parametrize("letter", PRINTABLE)
def test_every_printable_letter_has_strokes_within_its_box(letter: str) -> None:
    found = points(lettering(letter, 21.0))
    left, bottom, right, top = text_box(letter, 21.0)
    assert found[:, 0].min() >= left - 0.5
    assert found[:, 0].max() <= right + 0.5
    assert found[:, 1].min() >= bottom - 0.5
    assert found[:, 1].max() <= top + 4.5  # brackets and the dollar reach higher than capitals


def test_a_texts_width_is_the_sum_of_its_letters_and_grows_with_the_height() -> None:
    word = "Prism 42"
    widths = [text_box(letter, 7.0)[2] for letter in word]
    assert text_box(word, 7.0)[2] == pytest.approx(sum(widths), rel=1e-14)
    assert text_box(word, 14.0)[2] == pytest.approx(2 * sum(widths), rel=1e-14)
    assert text_box("il", 7.0)[2] < text_box("MW", 7.0)[2] / 2  # proportional


def test_letters_follow_one_another_from_the_origin_along_x() -> None:
    one, two = points(lettering("A", 10.0)), points(lettering("AA", 10.0))
    width = text_box("A", 10.0)[2]
    assert two[: len(one)] == pytest.approx(one)
    assert two[len(one) :] == pytest.approx(one + np.array([width, 0.0]))
    assert one[:, 0].min() >= 0.0


@pytest.mark.parametrize("letter", string.ascii_letters + string.digits + "&@%$#?()~")
def test_no_line_turns_at_once_inside(letter: str) -> None:
    """Between two ends a stroke is tangent continuous; its speed is that of its chords."""
    for edge in lettering(letter, 21.0):
        u = np.linspace(edge.u[0], edge.u[-1], 2001)
        slopes = edge.curve(u)[1]
        tangents = slopes / np.hypot(*slopes.T)[:, None]
        turn = np.arccos(np.clip((tangents[1:] * tangents[:-1]).sum(axis=1), -1.0, 1.0))
        assert turn.max() < np.radians(3.0)


@pytest.mark.parametrize("letter", string.ascii_letters + string.digits)
def test_strokes_go_through_the_fonts_own_points(letter: str) -> None:
    """Against the package's own polylines."""
    from HersheyFonts import HersheyFonts

    font = HersheyFonts()
    font.load_default_font("rowmans")
    glyph = font.all_glyphs[letter]
    drawn = np.concatenate([edge.curve(edge.u)[0] for edge in lettering(letter, 21.0)])
    for x, y in (point for stroke in glyph.strokes for point in stroke):
        assert np.hypot(*(drawn - [x - glyph.left_offset, 9 - y]).T).min() < 1e-12


@pytest.mark.parametrize(
    ("text", "same"),
    [("“a”", '"a"'), ("1–2", "1-2"), ("Straße", "Strasse"), ("½", "1/2"), ("5×5", "5x5")],
)
def test_typographic_signs_become_plain_ones(text: str, same: str) -> None:
    assert points(lettering(text, 5.0)) == pytest.approx(points(lettering(same, 5.0)))


@pytest.mark.parametrize("letter", "ÄÖÜäöüéèêñçåčőØø±")
def test_accents_are_added_to_the_letter_and_do_not_widen_it(letter: str) -> None:
    import unicodedata

    base = {"Ø": "O", "ø": "o", "±": "+"}.get(letter) or unicodedata.normalize("NFD", letter)[0]
    plain, accented = lettering(base, 21.0), lettering(letter, 21.0)
    assert len(accented) > len(plain)
    assert points(accented)[: len(points(plain))] == pytest.approx(points(plain))
    assert text_box(letter, 21.0) == text_box(base, 21.0)
    decomposed = unicodedata.normalize("NFD", letter)
    assert points(lettering(decomposed, 21.0)) == pytest.approx(points(accented))


def test_a_degree_sign_is_a_small_circle_high_up() -> None:
    low, high = points(lettering("°", 21.0)).min(axis=0), points(lettering("°", 21.0)).max(axis=0)
    assert high[1] == pytest.approx(21.0, abs=0.2)
    assert low[1] > 12.0


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("左", "U+5DE6"),
        ("a\nb", "U+000A"),
        ("tab\t", "U+0009"),
        ("☃", "snowman"),
        ("\u0301", "0301"),
    ],
)
def test_other_characters_are_refused_by_name(text: str, named: str) -> None:
    with pytest.raises(JobError, match="has no strokes") as error:
        lettering(text, 5.0)
    assert named in str(error.value)
    assert str(error.value).isprintable()


@pytest.mark.parametrize("text", ["", " ", "\u00a0 "])
def test_a_text_without_letters_is_refused(text: str) -> None:
    with pytest.raises(JobError, match="no letters"):
        lettering(text, 5.0)
