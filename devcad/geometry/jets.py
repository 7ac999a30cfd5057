"""Safe expressions: text in, Taylor series out.

An expression is made of numbers, the given names, pi, e, + - * / **, parentheses and the
functions of FUNCTIONS; nothing else is read, nothing is ever executed. The text is cut into
tokens, every name is looked up in a closed list, and only then ``ast`` parses it; the tree
becomes a straight list of steps on Taylor series (no recursion, equal parts computed once).

Source of the recurrences: Griewank and Walther, Evaluating Derivatives, chapter 13.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from operator import itemgetter
from typing import Any

import numpy as np
import numpy.typing as npt

from devcad.errors import JobError, LimitError
from devcad.geometry import elementary, taylor
from devcad.geometry.taylor import Array

MAX_TEXT = 2000  # characters
MAX_NODES = 500  # numbers, names, operators and functions
MAX_DEPTH = 50  # parentheses within parentheses
MAX_TOWER = 4  # exponents within exponents

CONSTANTS = {"pi": math.pi, "e": math.e}

Step = tuple[Callable[..., Any], tuple[int, ...]]
"""A function and the registers that it reads; its result is the next register."""


@dataclass(frozen=True, slots=True)
class Expression:
    """An expression that was read; call ``series`` or ``at`` to evaluate it.

    ``names_used`` are the variables that occur in it, in the order of ``names``.
    """

    text: str
    names: tuple[str, ...]
    names_used: tuple[str, ...]
    _steps: tuple[Step, ...] = field(repr=False, compare=False)
    _value: float | None = field(repr=False, compare=False)  # what it is, when no name occurs

    def series(self, **values: Array) -> Array:
        """The Taylor series (K + 1, n), given those of the variables, all of one shape.

        Where the expression has no value or no derivative the coefficients are nan or infinite.
        Every column depends on the same column of the values alone.
        """
        if self._value is not None:
            order, n = next(iter(values.values())).shape
            return taylor.constant(self._value, order - 1, n)
        registers: list[Any] = [values.get(name) for name in self.names]
        with np.errstate(all="ignore"):
            for function, reads in self._steps:
                registers.append(function(*(registers[i] for i in reads)))
        return np.array(registers[-1])

    def at(self, t: npt.ArrayLike, order: int) -> Array:
        """The Taylor series (order + 1, n) of an expression in one variable at t, (n,)."""
        t = np.atleast_1d(np.asarray(t, dtype=float))
        return self.series(**{self.names[0]: taylor.variable(t, order)})

    def constant(self) -> float:
        """The value of an expression without variables; JobError if it has some."""
        if self._value is None:
            raise JobError(
                f"{shown(self.text)} is not constant: {self.names_used[0]} occurs in it",
                value=self.text,
                remedy="write a number, or an expression of numbers, pi and e",
            )
        return self._value


def parse(text: str, names: tuple[str, ...] = ("t",)) -> Expression:
    """Read an expression in the given variables.

    Raises:
        JobError: something that is not allowed, or a constant part without a value (1/0).
        LimitError: the text is longer or deeper than MAX_TEXT, MAX_NODES, MAX_DEPTH or
            MAX_TOWER allow, or a constant part is too large for a floating-point number.
    """
    tree = _tree(_tokens(text, names), text, names)
    compiler = _Compiler(text, names)
    result = compiler.run(tree)
    if isinstance(result, float):
        return Expression(text, names, (), (), result)
    steps = compiler.steps
    if result != len(names) + len(steps) - 1:  # a bare name: the last register is the result
        steps = [*steps, (_same, (result,))]
    used = tuple(name for name in names if name in compiler.used)
    return Expression(text, names, used, tuple(steps), None)


def shown(text: str) -> str:
    """The text in quotation marks for a message, shortened and printable."""
    return ascii(text if len(text) <= 60 else text[:57] + "...")


TOKEN = re.compile(
    r"[ \t\r\n]*(?:(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z_0-9]*)|(?P<operator>\*\*|[-+*/(),]))"
)


def _allowed(names: tuple[str, ...]) -> str:
    """What an expression may hold, as a remedy."""
    listed = ", ".join((*names, *CONSTANTS))
    functions = " ".join(FUNCTIONS)
    return f"allowed are numbers, {listed}, + - * / **, parentheses and {functions}"


def _tokens(text: str, names: tuple[str, ...]) -> list[str]:
    """The text cut into allowed tokens, every number as a float."""
    if len(text) > MAX_TEXT:
        raise LimitError(
            f"expression {shown(text)} has {len(text)} characters, limit {MAX_TEXT}",
            value=len(text),
            limit=MAX_TEXT,
            remedy="shorten it, or give the curve as points",
        )
    tokens: list[str] = []
    position, end, depth = 0, len(text.rstrip(" \t\r\n")), 0
    while position < end:
        match = TOKEN.match(text, position)
        if match is None:
            piece = text[position:].lstrip(" \t\r\n")[0]
            hint = "write ** for a power; " if piece == "^" else ""
            raise _refused(text, f"{piece!a} is not allowed", hint + _allowed(names))
        token, kind = match[0].strip(), match.lastgroup
        tokens.append(_token(token, str(kind), text, match.end(), names))
        depth += (token == "(") - (token == ")")
        if depth > MAX_DEPTH:
            raise _too_complex(text, "parentheses within parentheses", MAX_DEPTH)
        position = match.end()
    return tokens


def _token(token: str, kind: str, text: str, end: int, names: tuple[str, ...]) -> str:
    """The token as ``ast`` gets it; names are looked up here."""
    if kind == "name" and token not in (*names, *CONSTANTS, *FUNCTIONS):
        raise _refused(text, f"the name {token!a} is not known", _allowed(names))
    if kind != "number":
        return token
    if re.match(r"[A-Za-z_0-9.]", text[end : end + 1]):
        piece = ascii(token + text[end])
        raise _refused(text, f"{piece} is not a number", "write * between factors, as in 2*t")
    value = float(token)
    if math.isinf(value):
        raise _refused(text, f"the number {shown(token)} is too large", "the limit is 1.8e308")
    return repr(value)


def _tree(tokens: list[str], text: str, names: tuple[str, ...]) -> ast.expr:
    """The syntax tree of the tokens."""
    try:
        return ast.parse(" ".join(tokens), mode="eval").body
    except SyntaxError:
        raise _refused(text, "it cannot be read as a formula", _allowed(names)) from None
    except (RecursionError, MemoryError):
        raise _too_complex(text, "operators within operators", MAX_NODES) from None


def _refused(text: str, reason: str, remedy: str) -> JobError:
    return JobError(f"expression {shown(text)}: {reason}", value=text[:60], remedy=remedy)


def _too_complex(text: str, what: str, limit: int) -> LimitError:
    return LimitError(
        f"expression {shown(text)} has more than {limit} {what}",
        limit=limit,
        remedy="simplify it, or give the curve as points",
    )


def _same(x: Array) -> Array:
    return x


def _add_constant(value: float, x: Array) -> Array:
    out = x.copy()
    out[0] += value
    return out


def _base_constant(value: float, x: Array) -> Array:
    """value ** x."""
    out = taylor.exp(np.log(np.float64(value)) * x)
    out[0] = np.power(value, x[0])
    return out


SHARED = {  # two functions that cost one
    "sin": (taylor.sin_cos, 0),
    "cos": (taylor.sin_cos, 1),
    "sinh": (taylor.sinh_cosh, 0),
    "cosh": (taylor.sinh_cosh, 1),
}

FUNCTIONS: dict[str, tuple[Callable[[Any], Any], Callable[[Array], Array] | None]] = {
    "sin": (np.sin, None),
    "cos": (np.cos, None),
    "tan": (np.tan, elementary.tan),
    "asin": (np.arcsin, elementary.asin),
    "acos": (np.arccos, elementary.acos),
    "atan": (np.arctan, elementary.atan),
    "sinh": (np.sinh, None),
    "cosh": (np.cosh, None),
    "tanh": (np.tanh, elementary.tanh),
    "asinh": (np.arcsinh, elementary.asinh),
    "acosh": (np.arccosh, elementary.acosh),
    "atanh": (np.arctanh, elementary.atanh),
    "exp": (np.exp, taylor.exp),
    "log": (np.log, taylor.log),
    "sqrt": (np.sqrt, partial(elementary.power, exponent=0.5)),
    "abs": (np.abs, elementary.absolute),
}
"""Every function that an expression may call: on a number, and on a series (None: SHARED)."""

OPERATORS: dict[type[ast.operator], tuple[str, Callable[[Any, Any], Any]]] = {
    ast.Add: ("+", np.add),
    ast.Sub: ("-", np.subtract),
    ast.Mult: ("*", np.multiply),
    ast.Div: ("/", np.divide),
    ast.Pow: ("**", np.power),
}

Operand = float | int
"""A constant (float), or the register (int) that holds a series."""


class _Compiler:
    """Turns one syntax tree into steps; lives for one call of ``parse``."""

    def __init__(self, text: str, names: tuple[str, ...]) -> None:
        self.text, self.names = text, names
        self.steps: list[Step] = []
        self.used: set[str] = set()
        self._known: dict[tuple[Any, ...], int] = {}

    def run(self, tree: ast.expr) -> Operand:
        """The whole tree, operands before operators."""
        pending: list[tuple[ast.expr, int, bool]] = [(tree, 0, False)]
        done: list[Operand] = []
        count = 0
        while pending:
            node, tower, ready = pending.pop()
            if ready:
                self._apply(node, done)
                continue
            count += 1
            if count > MAX_NODES:
                raise _too_complex(self.text, "numbers, names, operators and functions", MAX_NODES)
            if tower > MAX_TOWER:
                raise _too_complex(self.text, "exponents within exponents", MAX_TOWER)
            pending.append((node, tower, True))
            pending += [(child, level, False) for child, level in self._children(node, tower)]
        return done[0]

    def _children(self, node: ast.expr, tower: int) -> list[tuple[ast.expr, int]]:
        """The operands of a node, last first, with their height in a tower of exponents."""
        match node:
            case ast.Constant(value=float()) | ast.Name():
                return []
            case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
                return [(operand, tower)]
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return [(right, tower + 1), (left, tower)]
            case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
                return [(right, tower), (left, tower)]
            case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if (
                name in FUNCTIONS and not isinstance(argument, ast.Starred)
            ):
                return [(argument, tower)]
        raise self._not_allowed(node)

    def _not_allowed(self, node: ast.expr) -> JobError:
        if isinstance(node, ast.Call) and not isinstance(node.func, ast.Name):
            reason = "a parenthesis follows a value (write * between factors)"
        elif isinstance(node, ast.Call) and ast.unparse(node.func) not in FUNCTIONS:
            reason = f"{ast.unparse(node.func)} is not a function (write * between factors)"
        elif isinstance(node, ast.Call):
            reason = f"{ast.unparse(node.func)} takes exactly one value"
        else:
            reason = f"{type(node).__name__} is not allowed"
        return _refused(self.text, reason, _allowed(self.names))

    def _apply(self, node: ast.expr, done: list[Operand]) -> None:
        """Replace the operands of a node on top of ``done`` by its result."""
        match node:
            case ast.Constant(value=float(value)):
                done.append(value)
            case ast.Name(id=name):
                done.append(self._name(name))
            case ast.UnaryOp(op=ast.USub()):
                done.append(self._negative(done.pop()))
            case ast.BinOp(op=op):
                right, left = done.pop(), done.pop()
                done.append(self._binary(type(op), left, right))
            case ast.Call(func=ast.Name(id=name)):
                done.append(self._call(name, done.pop()))

    def _name(self, name: str) -> Operand:
        if name in self.names:
            self.used.add(name)
            return self.names.index(name)
        if name in CONSTANTS:
            return CONSTANTS[name]
        raise _refused(
            self.text, f"the function {name} has no value", f"write {name}(...) with parentheses"
        )

    def _negative(self, x: Operand) -> Operand:
        return -x if isinstance(x, float) else self._step(("neg",), np.negative, x)

    def _call(self, name: str, x: Operand) -> Operand:
        on_number, on_series = FUNCTIONS[name]
        if isinstance(x, float):
            return self._fold(name, on_number, x)
        if on_series is not None:
            return self._step((name,), on_series, x)
        function, which = SHARED[name]
        both = self._step((function,), function, x)
        return self._step((which,), itemgetter(which), both)

    def _binary(self, kind: type[ast.operator], x: Operand, y: Operand) -> Operand:
        symbol, on_numbers = OPERATORS[kind]
        if isinstance(x, float) and isinstance(y, float):
            return self._fold(symbol, on_numbers, x, y)
        if isinstance(y, float):
            return self._with_number(symbol, int(x), y)
        if isinstance(x, float):
            return self._number_with(symbol, x, y)
        functions: dict[str, Callable[..., Any]] = {
            "+": np.add,
            "-": np.subtract,
            "*": taylor.mul,
            "/": taylor.div,
            "**": elementary.power_series,
        }
        return self._step((symbol,), functions[symbol], x, y)

    def _with_number(self, symbol: str, x: int, value: float) -> int:
        """A series and then a number."""
        if symbol in "+-":
            value = value if symbol == "+" else -value
            return self._step(("+", value), partial(_add_constant, value), x)
        if symbol == "*":
            return self._step(("*", value), partial(np.multiply, value), x)
        if symbol == "/":
            self._fold("/", np.divide, 1.0, value)  # refuses a division by 0
            return self._step(("/", value), lambda a: a / value, x)
        return self._step(("**", value), partial(elementary.power, exponent=value), x)

    def _number_with(self, symbol: str, value: float, y: int) -> int:
        """A number and then a series."""
        if symbol == "+":
            return self._with_number("+", y, value)
        if symbol == "-":
            return self._with_number("+", int(self._negative(y)), value)
        if symbol == "*":
            return self._with_number("*", y, value)
        if symbol == "/":
            return self._with_number("*", self._step(("1/",), taylor.reciprocal, y), value)
        return self._step(("base", value), partial(_base_constant, value), y)

    def _step(self, key: tuple[Any, ...], function: Callable[..., Any], *reads: int) -> int:
        """The register of a step, an earlier one if the same was computed before."""
        key = (*key, *reads)
        if key not in self._known:
            self.steps.append((function, reads))
            self._known[key] = len(self.names) + len(self.steps) - 1
        return self._known[key]

    def _fold(self, symbol: str, function: Callable[..., Any], *values: float) -> float:
        """The value of a constant part."""
        part = f"{symbol} of {', '.join(f'{value:.6g}' for value in values)}"
        with np.errstate(divide="raise", invalid="raise", over="raise", under="ignore"):
            try:
                return float(function(*(np.float64(value) for value in values)))
            except FloatingPointError as error:
                if "overflow" in str(error):
                    raise LimitError(
                        f"expression {shown(self.text)}: {part} is too large",
                        value=part,
                        limit=float(np.finfo(float).max),
                        remedy="use smaller numbers",
                    ) from None
                raise _refused(self.text, f"{part} has no value", "change its constants") from None
