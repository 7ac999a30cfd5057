"""Expressions: derivatives against closed forms and numpy, hostile texts against refusal."""

import math
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devcad.errors import DevcadError, JobError, LimitError
from devcad.geometry import jets, taylor
from devcad.geometry.jets import parse

# Maclaurin coefficients, Abramowitz and Stegun 4.2 to 4.6
MACLAURIN = {
    "tan(t)": [0, 1, 0, 1 / 3, 0, 2 / 15, 0, 17 / 315, 0, 62 / 2835],
    "tanh(t)": [0, 1, 0, -1 / 3, 0, 2 / 15, 0, -17 / 315, 0, 62 / 2835],
    "asin(t)": [0, 1, 0, 1 / 6, 0, 3 / 40, 0, 15 / 336, 0, 105 / 3456],
    "acos(t)": [math.pi / 2, -1, 0, -1 / 6, 0, -3 / 40, 0, -15 / 336, 0, -105 / 3456],
    "asinh(t)": [0, 1, 0, -1 / 6, 0, 3 / 40, 0, -15 / 336, 0, 105 / 3456],
    "atan(t)": [0, 1, 0, -1 / 3, 0, 1 / 5, 0, -1 / 7, 0, 1 / 9],
    "atanh(t)": [0, 1, 0, 1 / 3, 0, 1 / 5, 0, 1 / 7, 0, 1 / 9],
    "log(1 + t)": [0, 1, -1 / 2, 1 / 3, -1 / 4, 1 / 5, -1 / 6, 1 / 7, -1 / 8, 1 / 9],
    "exp(t)": [1 / math.factorial(k) for k in range(10)],
    "e**t": [1 / math.factorial(k) for k in range(10)],
    "2**t": [math.log(2) ** k / math.factorial(k) for k in range(10)],
    "(1 + t)**-1": [(-1) ** k for k in range(10)],
    "1/(1 + t)**2": [(-1) ** k * (k + 1) for k in range(10)],
    "sin(t)": [0, 1, 0, -1 / 6, 0, 1 / 120, 0, -1 / 5040, 0, 1 / 362880],
    "cosh(t)": [1, 0, 1 / 2, 0, 1 / 24, 0, 1 / 720, 0, 1 / 40320, 0],
    "sqrt(1 + t)": [1, 1 / 2, -1 / 8, 1 / 16, -5 / 128, 7 / 256, -21 / 1024, 33 / 2048],
    "t**3": [0, 0, 0, 1, 0, 0],
    "(t - t**2)**2": [0, 0, 1, -2, 1, 0],
    "(1 + t)**t": [1, 0, 1, -1 / 2, 5 / 6, -3 / 4],  # exp(t log(1 + t))
}


@pytest.mark.parametrize("text", MACLAURIN)
def test_series_at_zero_are_the_known_ones(text):
    known = MACLAURIN[text]
    series = parse(text).at(0.0, len(known) - 1)[:, 0]
    np.testing.assert_allclose(series, known, rtol=4e-15, atol=4e-16)  # a few roundings


def test_derivatives_of_acosh_are_the_closed_forms():
    t = np.array([1.0001, 1.5, 40.0])
    w = (t - 1) * (t + 1)
    expected = [np.arccosh(t), w**-0.5, -t * w**-1.5 / 2, (2 * t * t + 1) * w**-2.5 / 6]
    np.testing.assert_allclose(parse("acosh(t)").at(t, 3), expected, rtol=1e-13)


@pytest.mark.parametrize("exponent", [3, -3, 2.5, -0.5, 0, 17, 100])
def test_powers_have_binomial_series(exponent):
    t = np.array([0.25, 1.5, 7.0])
    series = parse(f"t**({exponent})").at(t, 4)
    falling = 1.0
    for k in range(5):
        np.testing.assert_allclose(series[k], falling * t ** (exponent - k), rtol=1e-14)
        falling *= (exponent - k) / (k + 1)


def test_integer_powers_of_negative_and_zero_bases_are_polynomials():
    t = np.array([-2.0, 0.0, -1e-200])
    np.testing.assert_array_equal(
        parse("t**3").at(t, 4), [t**3, 3 * t**2, 3 * t, np.ones(3), np.zeros(3)]
    )
    np.testing.assert_array_equal(parse("t**100").at(0.0, 3)[:, 0], [0, 0, 0, 0])
    np.testing.assert_array_equal(parse("t**0").at(t, 1), [[1, 1, 1], [0, 0, 0]])
    assert parse("(-2)**3 - 2**-1").constant() == -8.5


def test_what_has_no_derivative_says_so_and_keeps_its_value():
    for text, missing in [("sqrt(t)", 1), ("abs(t)", 1), ("t**2.5", 3), ("asin(1 + t)", 1)]:
        series = parse(text).at(0.0, 4)[:, 0]
        assert np.isfinite(series[:missing]).all(), text
        assert not np.isfinite(series[missing:]).any(), text
    np.testing.assert_array_equal(parse("abs(t**2)").at(0.0, 3)[:, 0], [0, 0, 1, 0])
    np.testing.assert_array_equal(parse("abs(t)").at([-2.0, 3.0], 1), [[2, 3], [-1, 1]])


LEAVES = st.sampled_from(["t", "pi", "e", "2", "0.5", "3.25", "(-1.5)", ".125", "1e-3"])


def _grow(children):
    return st.one_of(
        st.tuples(children, st.sampled_from("+-*/"), children).map(lambda p: f"({' '.join(p)})"),
        st.tuples(st.sampled_from(sorted(jets.FUNCTIONS)), children).map(
            lambda p: f"{p[0]}({p[1]})"
        ),
        st.tuples(children, st.sampled_from(["2", "3", "(-1)", "0.5"])).map(
            lambda p: f"({p[0]})**{p[1]}"
        ),
        children.map(lambda p: f"-{p}"),
    )


NUMPY = {
    **{name: getattr(np, name) for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "abs")},
    **{name: getattr(np, name) for name in ("exp", "log", "sqrt")},
    **{"a" + name: getattr(np, "arc" + name) for name in ("sin", "cos", "tan")},
    **{"a" + name: getattr(np, "arc" + name) for name in ("sinh", "cosh", "tanh")},
    "pi": np.float64(math.pi),
    "e": np.float64(math.e),
}


@settings(max_examples=200, deadline=None)
@given(st.recursive(LEAVES, _grow, max_leaves=12))
def test_values_agree_with_numpy(text):
    t = np.array([-1.7, -0.3, 0.4, 1.1, 2.6])
    try:
        expression = parse(text)
    except (JobError, LimitError) as error:
        assert "no value" in str(error) or "too large" in str(error)  # a constant part like 1/0
        return
    with np.errstate(all="ignore"):
        plain = eval(text, {"__builtins__": {}}, {**NUMPY, "t": t})  # our own text, not a user's
        plain = np.broadcast_to(plain, t.shape)
        nearby = [
            eval(text, {"__builtins__": {}}, {**NUMPY, "t": t * (1 + s)}) for s in (1e-15, -1e-15)
        ]
        noise = sum(np.abs(other - plain) for other in nearby)
        series = expression.at(t, 0)[0]
        error = np.abs(series - plain)
        limit = 1e-10 * np.abs(plain) + 1e3 * noise + 1e-12  # ill-conditioned near poles
    sound = np.isfinite(plain) & np.isfinite(series) & np.isfinite(limit)
    assert (error[sound] <= limit[sound]).all()


def _grow_entire(children):
    """Expressions without poles, kinks and branch points: their Taylor series converge."""
    return st.one_of(
        st.tuples(children, st.sampled_from("+-*"), children).map(lambda p: f"({' '.join(p)})"),
        st.tuples(st.sampled_from(["sin", "cos", "sinh", "cosh", "exp"]), children).map(
            lambda p: f"{p[0]}({p[1]})"
        ),
        st.tuples(children, st.sampled_from("23")).map(lambda p: f"({p[0]})**{p[1]}"),
    )


@settings(max_examples=200, deadline=None)
@given(st.recursive(LEAVES, _grow_entire, max_leaves=8))
def test_the_series_predicts_the_value_nearby(text):
    try:
        expression = parse(text)
    except LimitError:
        return  # a constant part like exp(exp(exp(pi)))
    t, order = np.array([0.73]), 12
    series = expression.at(t, order)[:, 0]
    if not np.isfinite(series).all() or np.abs(series).max() > 1e100:
        return
    size = 1.0 + abs(series[0])
    growth = np.max((np.abs(series[1:]) / size) ** (1 / np.arange(1, order + 1)))
    step = 1 / 32 / max(1.0, growth)  # term k is below 32^-k size
    predicted = np.polynomial.polynomial.polyval(step, series)
    value = expression.at(t + step, 0)[0, 0]
    assert abs(predicted - value) <= 1e-12 * size * max(1.0, growth)  # rounding of sin(large)


@pytest.mark.parametrize(
    "text",
    [
        "tan(atan(3*t))/3",
        "atan(tan(t))",
        "sin(asin(t))",
        "cos(acos(t))",
        "sinh(asinh(5*t))/5",
        "cosh(acosh(1 + t)) - 1",
        "tanh(atanh(t))",
        "atanh(tanh(t))",
        "exp(log(t))",
        "log(exp(t))",
        "sqrt(t)**2",
        "(t**2.5)**0.4",
        "t/(1 + t)*(1 + t)",
        "log(3**t)/log(3)",
        "(1 + t)**t/(1 + t)**(t - 1) - 1",
        "abs(-t)",
        "-acos(t) + pi/2 - asin(t) + t",
    ],
)
def test_a_function_and_its_inverse_cancel_to_all_orders(text):
    t = np.array([0.1, 0.37, 0.8])
    nearest = np.minimum(np.minimum(t, 1 - t), 0.3)  # the next singularity, some at 0 and 1:
    size = nearest ** -np.arange(9)[:, None]  # coefficient k of the parts grows like this
    error = parse(text).at(t, 8) - taylor.variable(t, 8)
    assert (np.abs(error) <= 2e-14 * size).all()


def test_the_result_does_not_depend_on_how_the_points_are_split():
    expression = parse("exp(sin(3*t))*t**2.5 + tan(t)/(1 + t**3) - asinh(t)**t + 2**t")
    t = np.linspace(0.1, 1.4, 101)
    whole = expression.at(t, 5)
    single = np.concatenate([expression.at(x, 5) for x in t], axis=1)
    parts = np.concatenate([expression.at(x, 5) for x in np.split(t, [7, 50])], axis=1)
    np.testing.assert_array_equal(whole, single)
    np.testing.assert_array_equal(whole, parts)


def test_several_variables_are_composed_by_the_chain_rule():
    t = taylor.variable(np.array([0.3, 0.9]), 4)
    expression = parse("x**2*y - z", ("x", "y", "z"))
    s, c = taylor.sin_cos(t)
    assert expression.names_used == ("x", "y", "z")
    np.testing.assert_allclose(
        expression.series(x=s, y=c, z=t), parse("sin(t)**2*cos(t) - t").at(t[0], 4), atol=1e-16
    )


def test_equal_parts_are_computed_once():
    twice = parse("sin(t)*cos(t) + sin(t)")
    assert len(twice._steps) == 5  # sine and cosine together, each taken, a product, a sum


def test_evaluation_leaves_its_input_alone():
    t = taylor.variable(np.array([1.0, 2.0]), 2)
    out = parse("t").series(t=t)
    out[:] = 7.0
    np.testing.assert_array_equal(t, [[1, 2], [1, 1], [0, 0]])


def test_constants_are_numbers():
    assert parse("2*pi").constant() == 2 * math.pi
    assert parse("-(1 + 2)*3**2/4").constant() == -6.75
    assert parse("007.5").constant() == 7.5
    np.testing.assert_array_equal(parse("3").at([1.0, 2.0], 1), [[3, 3], [0, 0]])
    with pytest.raises(JobError, match="not constant"):
        parse("2*t").constant()


SECRET = "/etc/passwd"
HOSTILE = [
    "__import__('os').system('true')",
    "().__class__.__bases__[0].__subclasses__()",
    "t.__class__",
    "t.real",
    "__builtins__",
    "__name__",
    "open('/etc/passwd')",
    f'open("{SECRET}").read()',
    "lambda: t",
    "(lambda t: t)(t)",
    "[t for t in (1, 2)]",
    "{t: t}",
    "{t}",
    "f'{t}'",
    "'text'",
    "b'bytes'",
    "(t := 3)",
    "t if t else t",
    "t and t",
    "not t",
    "t < 3",
    "t == t",
    "True",
    "None",
    "...",
    "1j",
    "2t",
    "t(2)",
    "2(t)",
    "(t)(t)",
    "sin",
    "sin()",
    "sin(t, t)",
    "sin(x=t)",
    "sin(*t)",
    "sin(**t)",
    "sin(t)(t)",
    "t[0]",
    "t, t",
    "()",
    "",
    "   ",
    "t;t",
    "import os",
    "exec('1')",
    "eval('1')",
    "print(t)",
    "globals()",
    "getattr(t, 'x')",
    "exit()",
    "nan",
    "inf",
    "infinity",
    "1e999",
    "9" * 400,
    "0x10",
    "0b1",
    "1_000",
    "1.2.3",
    "1e",
    "1e5e5",
    "t^2",
    "t // 2",
    "t % 2",
    "t @ t",
    "t << 2",
    "t | t",
    "~t",
    "t t",
    "t***t",
    "+",
    "t +",
    ")t(",
    "(t",
    "t)",
    "t\x00",
    "\x00",
    "t # comment",
    "t \\\n + 1",
    "ｓｉｎ(t)",
    "ⅷ",
    "²",
    "t\u200b",
    "\u202et",
    "𝓽",
    "٣",
    "Sin(t)",
    "arcsin(t)",
    "u",
    "yield t",
    "await t",
    "1/0",
    "0**-1",
    "log(0)",
    "sqrt(-1)",
    "acosh(0)",
    "t/0",
    "\ud800",
]
COSTLY = [
    "9**9**9**9",
    "9**9**9",
    "t**" * 300 + "t",
    "t**t**t**t**t**t**t",
    "((9**9)**9)**99",
    "exp(exp(exp(9)))",
    "(" * 900 + "t" + ")" * 900,
    "(" * 1999,
    "sin(" * 300 + "t" + ")" * 300,
    "-" * 1999 + "t",
    "+".join(["t"] * 900),
    "t*" * 600 + "t",
    "t" * 100_000,
    "1" * 100_000,
    "(" * 100_000,
    " " * 3000 + "t",
]


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_text_is_refused_at_once(text):
    start = time.perf_counter()
    with pytest.raises(JobError) as caught:
        parse(text)
    assert time.perf_counter() - start < 0.5
    message = str(caught.value)
    assert message.isprintable() and len(message) < 600
    assert caught.value.code == 2 and caught.value.remedy


@pytest.mark.parametrize("text", COSTLY, ids=lambda text: f"{text[:12]}...{len(text)}")
def test_costly_text_is_over_the_limit(text):
    start = time.perf_counter()
    with pytest.raises(LimitError) as caught:
        parse(text)
    assert time.perf_counter() - start < 0.5
    assert caught.value.code == 4 and len(str(caught.value)) < 600


def test_the_longest_allowed_expression_is_fast():
    text = "+".join(["sin(cos(t**3.5))"] * 62)[:2000]
    expression = parse(text)
    start = time.perf_counter()
    expression.at(np.linspace(0.1, 1.0, 1000), 6)
    assert time.perf_counter() - start < 0.5


def test_nothing_is_opened_while_hostile_text_is_read(monkeypatch):
    def opened(*_args, **_kwargs):
        raise AssertionError("a file was opened")

    monkeypatch.setattr("builtins.open", opened)
    monkeypatch.setattr(Path, "open", opened)
    for text in HOSTILE + COSTLY:
        with pytest.raises(DevcadError):
            parse(text)


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=60) | st.text("t0123456789.e+-*/() sincoexplg,_", max_size=80))
def test_any_text_is_read_or_refused(text):
    try:
        expression = parse(text)
    except (JobError, LimitError):
        return
    assert expression.at(np.array([0.5]), 2).shape == (3, 1)


def test_refusals_name_the_piece_and_what_is_allowed():
    with pytest.raises(JobError, match=r"'foo' is not known .*sin cos tan.*sqrt abs"):
        parse("2*foo + 1")
    with pytest.raises(JobError, match=r"write \*\* for a power"):
        parse("t^2")


def test_expressions_compare_by_what_was_written():
    assert parse("t + 1") == parse("t + 1") != parse("1 + t")
