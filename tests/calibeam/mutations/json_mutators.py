"""Changes to the tree of a JSON file: numbers, texts, lists, keys, depth."""

import json
import re
from collections.abc import Callable, Iterator
from typing import Any

from tests.calibeam.mutations.text_mutators import (
    BYTES,
    DEEP,
    NUMBERS,
    TEXTS,
    WRONG,
    Mutator,
    Rng,
    bad_utf8,
    bom,
    cut,
    many,
    pick,
)

RAW = "@raw@"


def _places(tree: Any) -> Iterator[tuple[Any, Any]]:
    """Every container and key or index in it."""
    items = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in items:
        yield tree, key
        yield from _places(value)


def _edited(rng: Rng, data: bytes, wanted: Callable[[Any], bool], change: Callable[[Any], Any]) -> bytes:
    """A raw token may be written by a string that begins with RAW."""
    tree = json.loads(data)
    found = [place for place in _places(tree) if wanted(place[0][place[1]])]
    if not found:
        return cut(rng, data)
    # by key first: else most changes fall into the longest list
    key = pick(rng, sorted({str(key) for _, key in found}))
    holder, at = pick(rng, [place for place in found if str(place[1]) == key])
    holder[at] = change(holder[at])
    return re.sub(rf'"{RAW}((?:[^"\\]|\\.)*)"', lambda raw: json.loads(f'"{raw[1]}"'), json.dumps(tree)).encode()


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def json_number(rng: Rng, data: bytes) -> bytes:
    return _edited(rng, data, _is_number, lambda _: RAW + pick(rng, NUMBERS))


def json_numbers(rng: Rng, data: bytes) -> bytes:
    """All numbers of a list alike."""
    size = RAW + pick(rng, NUMBERS[:10])

    def change(value: list[Any]) -> list[Any]:
        return [change(each) if isinstance(each, list) else size if _is_number(each) else each for each in value]

    return _edited(rng, data, lambda value: isinstance(value, list) and bool(value), change)


def json_wrong(rng: Rng, data: bytes) -> bytes:
    wrong = (None, "", "text", True, [], {}, [[1.0]], [1.0, 2.0], -1, {"a": 1}, [None], 1e308)
    return _edited(rng, data, lambda _: True, lambda _: pick(rng, wrong))


def json_text(rng: Rng, data: bytes) -> bytes:
    return _edited(rng, data, lambda value: isinstance(value, str), lambda _: pick(rng, TEXTS))


def json_long(rng: Rng, data: bytes) -> bytes:
    return _edited(rng, data, lambda value: isinstance(value, str), lambda _: "x" * many(rng))


def json_deep(rng: Rng, data: bytes) -> bytes:
    deep = pick(rng, (DEEP, 900))
    nested = pick(rng, ("[" * deep, "[" * deep + "]" * deep, '{"a":' * deep + "1" + "}" * deep))
    return _edited(rng, data, lambda _: True, lambda _: RAW + nested)


def json_uneven(rng: Rng, data: bytes) -> bytes:
    def change(value: list[Any]) -> list[Any]:
        return pick(rng, (value[:-1], value + value[-1:], value * 50, value[:1], value[::-1], []))

    return _edited(rng, data, lambda value: isinstance(value, list) and bool(value), change)


def json_missing(rng: Rng, data: bytes) -> bytes:
    tree = json.loads(data)
    found = [place for place in _places(tree) if isinstance(place[0], dict)]
    if not found:
        return cut(rng, data)
    holder, key = pick(rng, found)
    del holder[key]
    return json.dumps(tree).encode()


def json_renamed(rng: Rng, data: bytes) -> bytes:
    tree = json.loads(data)
    found = [place for place in _places(tree) if isinstance(place[0], dict)]
    if not found:
        return cut(rng, data)
    holder, key = pick(rng, found)
    holder[pick(rng, ("x", "", "k" * many(rng), "a\u0000b", "name"))] = holder.pop(key)
    return json.dumps(tree).encode()


def json_twice(rng: Rng, data: bytes) -> bytes:
    """A key a second time, with another value."""
    text = data.decode()
    keys = list(re.finditer(r'("[\w.]+")\s*:', text))
    if not keys:
        return cut(rng, data)
    one = pick(rng, keys)
    return (text[: one.start()] + f"{one[1]}: {pick(rng, WRONG)}, " + text[one.start() :]).encode()


JSON: tuple[Mutator, ...] = (
    *BYTES, bad_utf8, bom, json_number, json_number, json_numbers, json_wrong, json_text, json_long, json_deep,
    json_uneven, json_missing, json_renamed, json_twice,
)  # fmt: skip
