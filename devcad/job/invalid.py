"""What pydantic found, told as devcad tells it: place, what, value, limit, remedy."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from devcad.errors import DevcadError, JobError

if TYPE_CHECKING:
    from pydantic import BaseModel, ValidationError

SHOWN = 60  # characters of a wrong value that a message repeats
NEAR = 0.6  # likeness of two words, 1 for equal ones
NEAR_SHORT = 0.7  # of words up to SHORT letters; pdf and dxf have 2/3
SHORT = 4
MOST = 20  # problems told of one file
_NUMBERED = re.compile(r" \d+$")


class InvalidJob(JobError):
    """Several problems of one file: the first is the error itself, ``others`` follow it."""

    others: tuple[DevcadError, ...] = ()


def raise_all(problems: Sequence[DevcadError]) -> None:
    """Raise the problems as one error; nothing happens where there are none."""
    if not problems:
        return
    first = problems[0]
    if len(problems) == 1 or not isinstance(first, JobError):
        raise first
    error = InvalidJob(first.what, first.place, first.panel, first.value, first.limit, first.remedy)
    error.others = tuple(problems[1:MOST])
    if len(problems) > MOST:
        rest = f"{len(problems) - MOST} more problems of this kind"
        error.others += (JobError(rest, place=first.place.split(" > ")[0]),)
    raise error


def problems(
    found: ValidationError, tree: Any, model: type[BaseModel], *, place: str
) -> list[DevcadError]:
    """One error per place of the file, in the order of the model's keys.

    ``tree`` is what was validated; ``place`` names the file and the table that it stands in.
    """
    groups: dict[str, list[Mapping[str, Any]]] = {}
    for item in _once(found.errors(include_url=False), model):
        groups.setdefault(_path(tree, item, model), []).append(item)
    return [_problem(items, model, place, path) for path, items in groups.items()]


def _once(items: Sequence[Mapping[str, Any]], model: type[BaseModel]) -> list[Mapping[str, Any]]:
    """The findings without the keys that are missing because they are mistyped, and without the
    arrays that are too short because their entries are wrong."""
    meant: set[tuple[str | int, ...]] = set()
    for item in items:
        if item["type"] == "extra_forbidden":
            *table, key = item["loc"]
            nearest = _nearest(str(key), _known_keys(model, table))
            meant.update((*table, name) for name in nearest)
        elif item["type"] == "too_short":
            within = (other["loc"][: len(item["loc"])] for other in items if other is not item)
            meant.update([item["loc"]] if item["loc"] in within else [])
    once = {"missing", "too_short"}
    return [item for item in items if item["type"] not in once or item["loc"] not in meant]


def below(place: str, path: str) -> str:
    """A path inside a place: after " > " where the place is only the file or ends with a number
    (in which a dot would be a decimal point), else after a dot."""
    if not path:
        return place
    dotted = " > " in place and not _NUMBERED.search(place)
    separator = "" if path.startswith("[") else "." if dotted else " > "
    return f"{place}{separator}{path}"


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """A remedy that names the nearest known word, or all of them."""
    names = sorted(set(known))
    close = _nearest(word, names)
    return f'did you mean "{close[0]}"?' if close else f"known: {', '.join(names)}"


def _nearest(word: str, names: Sequence[str]) -> list[str]:
    """The one known word that is near enough to be meant, or none."""
    from difflib import get_close_matches  # only failures need it

    cutoff = NEAR if len(word) > SHORT else NEAR_SHORT
    return get_close_matches(word.lower(), names, n=1, cutoff=cutoff)


def shown(value: Any) -> str:
    """A value as it stands in a job file, shortened."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{_clip(value)}"'
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list | tuple):
        return f"an array of {len(value)}"
    if isinstance(value, int) and abs(value) >= 10**SHOWN:
        return f"a whole number of {value.bit_length()} bits"
    return _clip(str(value))


def _clip(text: str) -> str:
    """The beginning of a text, control characters escaped."""
    text = text if len(text) <= SHOWN else f"{text[: SHOWN - 3]}..."
    return text if text.isprintable() else ascii(text)[1:-1]


def _path(tree: Any, item: Mapping[str, Any], model: type[BaseModel]) -> str:
    """The location as a dotted path of the file; names of union members are left out.

    An entry that an array lacks is told of the array.
    """
    loc = item["loc"]
    node, path, models = tree, "", [model]
    for k, key in enumerate(loc):
        member = _is_member(models, key)
        models = _inner(models, key)
        if member:
            continue
        if isinstance(key, int):
            if not isinstance(node, list | tuple) or key >= len(node):
                continue
            path, node = f"{path}[{key}]", node[key]
        elif isinstance(node, Mapping) and (key in node or k == len(loc) - 1):
            path, node = f"{path}.{_clip(key)}", node.get(key)
    return path.removeprefix(".")


_TYPES = {
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "int_parsing": "a whole number",
    "string_type": "a text in quotes",
    "bool_type": "true or false",
    "list_type": "an array",
    "tuple_type": "an array",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
}
_RANGES = {
    "greater_than": ("greater than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}
_LENGTHS = {"too_short": ("at least", "min_length"), "too_long": ("at most", "max_length")}


def _problem(
    items: Sequence[Mapping[str, Any]], model: type[BaseModel], place: str, path: str
) -> DevcadError:
    """The one error of a place: what a value of the right type lacks, else the types allowed."""
    where = below(place, path)
    lacking = [item["loc"][-1] for item in items if item["type"] == "missing"]
    if lacking and isinstance(lacking[-1], int):
        return _wrong_length(lacking[0], f"{lacking[-1] + 1}", where)
    telling = [item for item in items if item["type"] not in _TYPES]
    if telling:
        return _tell(telling[0], model, where)
    names = list(dict.fromkeys(_TYPES[item["type"]] for item in items))
    return _must_be(" or ".join(names), items[0]["input"], where, limit=" or ".join(names))


def _must_be(
    wanted: str, value: Any, place: str, *, limit: float | str, remedy: str = ""
) -> JobError:
    return JobError(
        f"must be {wanted}, is {shown(value)}",
        place=place,
        value=value if _is_number(value) else shown(value).strip('"'),
        limit=limit,
        remedy=remedy or f"give {wanted}",
    )


def _is_number(value: Any) -> bool:
    """Whether a report can repeat the value as a finite number."""
    return type(value) in (int, float) and abs(value) < 1e300


def _tell(item: Mapping[str, Any], model: type[BaseModel], place: str) -> DevcadError:
    """The error of one finding that is not a mere type mismatch."""
    kind, value, ctx = item["type"], item["input"], item.get("ctx", {})
    if isinstance(error := ctx.get("error"), DevcadError):
        error.place = below(place, error.place)
        return error
    if kind in _RANGES:
        word, key = _RANGES[kind]
        wanted, remedy = f"{word} {ctx[key]:g}", f"give a number {word} {ctx[key]:g}"
        return _must_be(wanted, value, place, limit=ctx[key], remedy=remedy)
    if kind in _LENGTHS:
        word, key = _LENGTHS[kind]
        return _wrong_length(ctx["actual_length"], f"{word} {ctx[key]}", place)
    if kind in ("literal_error", "enum"):
        words = ctx["expected"].replace("'", '"')
        known = [word for word in words.replace(" or ", ", ").replace('"', "").split(", ") if word]
        return _must_be(words, value, place, limit=words, remedy=did_you_mean(str(value), known))
    if kind in ("extra_forbidden", "missing", "union_tag_invalid", "union_tag_not_found"):
        return _wrong_key(kind, item, model, place)
    if kind == "finite_number":
        return _must_be("a finite number", value, place, limit="finite")
    return JobError(_sentence(item), place=place, value=shown(value), remedy="see devcad schema")


def _wrong_length(has: int, wanted: str, place: str) -> JobError:
    return JobError(
        f"has {has} {'entry' if has == 1 else 'entries'}, must have {wanted}",
        place=place,
        value=has,
        limit=wanted,
        remedy=f"give {wanted}",
    )


def _wrong_key(kind: str, item: Mapping[str, Any], model: type[BaseModel], place: str) -> JobError:
    """A key that is missing or unknown, or a kind that is."""
    key = str(item["loc"][-1]) if item["loc"] else ""
    if kind == "extra_forbidden":
        known = _known_keys(model, item["loc"][:-1])
        return JobError(
            f'this version knows no key "{_clip(key)}" here',
            place=place,
            value=_clip(key),
            limit=", ".join(known),
            remedy=did_you_mean(key, known),
        )
    if kind == "missing":
        return JobError(
            "the key is missing", place=place, value="", limit="required", remedy=f"add {key} = ..."
        )
    known = item["ctx"].get("expected_tags", "").replace("'", "").split(", ")
    if kind == "union_tag_invalid":
        return unknown_kind(str(item["ctx"]["tag"]), known, place=f"{place}.kind")
    return JobError(
        "the key is missing",
        place=f"{place}.kind",
        value="",
        limit="required",
        remedy="add kind = ...",
    )


def unknown_kind(tag: str, known: Iterable[str], *, place: str, noun: str = "kind") -> JobError:
    """The error of a kind (or shape) that this version has not."""
    names = sorted(known)
    return JobError(
        f'this version knows no {noun} "{_clip(tag)}"',
        place=place,
        value=_clip(tag),
        limit=", ".join(names),
        remedy=did_you_mean(tag, names),
    )


def _sentence(item: Mapping[str, Any]) -> str:
    """Pydantic's own words, beginning in lower case."""
    message = str(item["msg"]).removeprefix("Value error, ").removeprefix("Assertion failed, ")
    return message[:1].lower() + message[1:]


def _known_keys(model: type[BaseModel], loc: Sequence[str | int]) -> list[str]:
    """The keys of the table at ``loc`` inside the model."""
    models = [model]
    for key in loc:
        models = _inner(models, key)
    return sorted(
        {field.alias or name for one in models for name, field in one.model_fields.items()}
    )


def _is_member(models: Sequence[type[BaseModel]], key: str | int) -> bool:
    """Whether a part of a location only names one of several kinds, as key or not."""
    return len(models) > 1 and any(key == kind_of(one) for one in models)


def _inner(models: list[type[BaseModel]], key: str | int) -> list[type[BaseModel]]:
    """The models that the next part of a location leads to."""
    if isinstance(key, int):
        return models
    if _is_member(models, key):
        return [one for one in models if kind_of(one) == key]
    for one in models:
        one.model_rebuild()  # one that speaks of itself, as a chain of chains, is not yet complete
    fields = [
        field
        for one in models
        for name, field in one.model_fields.items()
        if key in (name, field.alias)
    ]
    return [inner for field in fields for inner in models_in(field.annotation)]


def models_in(annotation: Any) -> list[type[BaseModel]]:
    """The models that an annotation speaks of, in unions, arrays and annotated types too."""
    if hasattr(annotation, "model_fields"):
        return [annotation]
    if get_origin(annotation) is Literal:
        return []
    value = getattr(annotation, "__value__", None)  # a named type alias
    inner = get_args(annotation) if value is None else (value,)
    return [model for part in inner for model in models_in(part)]


def kind_of(model: type[BaseModel]) -> str | None:
    """The value of the model's key ``kind``."""
    field = model.model_fields.get("kind")
    options = get_args(field.annotation) if field else ()
    return str(options[0]) if options else None
