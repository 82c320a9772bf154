"""Changes to a good file of bytes, of text, or of text with keys (TOML).

Each takes a random generator and the good bytes; the same generator gives the same file.
"""

import json
import re
from collections.abc import Callable
from typing import Any

import numpy as np

from tests.mutated import mutated

Rng = np.random.Generator
Mutator = Callable[[Rng, bytes], bytes]

NUMBERS = (
    "1e308", "-1e308", "1e30", "-1e30", "1e5", "-1e5", "1e-300", "-0.0", "0", "-1", "2", "nan", "inf", "-inf", "1e400",
    "99999999999999999999", "9223372036854775808", "4294967296", "1000000", "9" * 400, "٣.٥", "1_000",
    "0x10", "1,5", "1e",
)  # fmt: skip
WRONG = (
    '""',
    '"text"',
    "true",
    "[]",
    "{}",
    "[[1.0]]",
    "[1.0, 2.0]",
    "1979-05-27",
    '"1e5 m"',
    "-1",
    '["a", 1]',
    "1e308",
)
TEXTS = ("[bold]x[/bold]", "a\u202eb", "../../etc/passwd", "\u0000", "\n", " ", "x" * 1000, "Ω", "%s%n{0}", "127.0.0.1")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])")
LONG = 10_000_000
DEEP = 100_000


def pick(rng: Rng, items: Any) -> Any:
    return items[int(rng.integers(len(items)))]


# --- any bytes ---


def flipped(rng: Rng, data: bytes) -> bytes:
    return mutated(rng, [data], pieces=1)


def cut(rng: Rng, data: bytes) -> bytes:
    return data[: int(rng.integers(len(data)))]


def cut_early(rng: Rng, data: bytes) -> bytes:
    return data[: int(rng.integers(min(len(data), 200)))]


def bad_utf8(rng: Rng, data: bytes) -> bytes:
    at = int(rng.integers(len(data)))
    return data[:at] + pick(rng, (b"\xff", b"\xc3(", b"\xed\xa0\x80", b"\x80")) + data[at:]


def nul(rng: Rng, data: bytes) -> bytes:
    at = int(rng.integers(len(data)))
    return data[:at] + bytes(int(rng.integers(1, 9))) + data[at:]


def twice(rng: Rng, data: bytes) -> bytes:
    return data + data


def headless(rng: Rng, data: bytes) -> bytes:
    return data[int(rng.integers(1, 20)) :]


def lengths(rng: Rng, data: bytes) -> bytes:
    """Eight bytes as a length of a binary format would have them: far too large, or zero."""
    at, size = int(rng.integers(len(data) - 8)), pick(rng, (0, 1, 2**31 - 1, 2**32, 2**62, 2**64 - 1))
    return data[:at] + size.to_bytes(8, "little") + data[at + 8 :]


def blank(rng: Rng, data: bytes) -> bytes:
    at, many = int(rng.integers(len(data))), int(rng.integers(1, 400))
    return data[:at] + bytes(len(data[at : at + many])) + data[at + many :]


# --- any text ---


def bom(rng: Rng, data: bytes) -> bytes:
    return pick(rng, (b"\xef\xbb\xbf" + data, data.decode().encode("utf-16"), b"\xef\xbb\xbf" * 2 + data))


def crlf(rng: Rng, data: bytes) -> bytes:
    return data.replace(b"\n", pick(rng, (b"\r\n", b"\r", b"\n\n", b"\r\r\n")))


def number(rng: Rng, data: bytes) -> bytes:
    text = data.decode()
    found = list(NUMBER.finditer(text))
    if not found:
        return cut(rng, data)
    one = pick(rng, found)
    return (text[: one.start()] + pick(rng, NUMBERS) + text[one.end() :]).encode()


def line_lost(rng: Rng, data: bytes) -> bytes:
    lines = data.splitlines(keepends=True)
    del lines[int(rng.integers(len(lines)))]
    return b"".join(lines)


def line_twice(rng: Rng, data: bytes) -> bytes:
    lines = data.splitlines(keepends=True)
    at = int(rng.integers(len(lines)))
    return b"".join([*lines[: at + 1], *lines[at:]])


def lines_mixed(rng: Rng, data: bytes) -> bytes:
    lines = data.splitlines(keepends=True)
    return b"".join(lines[k] for k in rng.permutation(len(lines)))


def stamp(rng: Rng, data: bytes) -> bytes:
    """A number of many digits, as a broken time stamp has them, in place of the first number of a line."""
    lines = data.decode().splitlines(keepends=True)
    at = int(rng.integers(len(lines)))
    digits = pick(rng, ("12345678901234567890", "9" * 300, "1e30", "-5", "nan", "1.2.3"))
    lines[at] = re.sub(r"\d+(\.\d+)?", digits, lines[at], count=1)
    return "".join(lines).encode()


def long_line(rng: Rng, data: bytes) -> bytes:
    lines = data.splitlines(keepends=True)
    at = int(rng.integers(len(lines)))
    lines[at] = lines[at].rstrip(b"\n") * max(2, many(rng) // max(1, len(lines[at]))) + b"\n"
    return b"".join(lines)


def many(rng: Rng) -> int:
    """Characters: seldom very many, because each run with them takes a second."""
    return LONG if rng.random() < 0.1 else 2000


# --- TOML ---


def _values(text: str) -> list[re.Match[str]]:
    return list(re.finditer(r"^([ \t]*[^\s#\[=][^=\n]*?)[ \t]*=[ \t]*([^\n#]*?)[ \t]*(?=#|$)", text, re.MULTILINE))


def _with_value(rng: Rng, data: bytes, change: Callable[[str], str]) -> bytes:
    text = data.decode()
    one = pick(rng, _values(text))
    return (text[: one.start(2)] + change(one[2]) + text[one.end(2) :]).encode()


def value_wrong(rng: Rng, data: bytes) -> bytes:
    return _with_value(rng, data, lambda _: pick(rng, WRONG))


def value_text(rng: Rng, data: bytes) -> bytes:
    return _with_value(rng, data, lambda _: json.dumps(pick(rng, TEXTS)))


def value_long(rng: Rng, data: bytes) -> bytes:
    return _with_value(rng, data, lambda old: '"' + "x" * many(rng) + '"' if rng.random() < 0.7 else f"[{old}]")


def value_deep(rng: Rng, data: bytes) -> bytes:
    deep = pick(rng, (DEEP, 900))
    return _with_value(
        rng, data, lambda _: pick(rng, ("[" * deep, "[" * deep + "]" * deep, "{a=" * deep + "1" + "}" * deep))
    )


def list_uneven(rng: Rng, data: bytes) -> bytes:
    text = data.decode()
    lists = list(re.finditer(r"\[([^\[\]\n]+,[^\[\]\n]+)\]", text))
    if not lists:
        return value_wrong(rng, data)
    one = pick(rng, lists)
    items = one[1].split(",")
    made = pick(rng, (items[:-1], items + items[-1:], items * 50, items[:1]))
    return (text[: one.start(1)] + ",".join(made) + text[one.end(1) :]).encode()


def key_renamed(rng: Rng, data: bytes) -> bytes:
    text = data.decode()
    one = pick(rng, _values(text))
    name = pick(rng, ("x", '"' + "k" * many(rng) + '"', '""', "a.b.c", "schema", "name", ".".join("a" * DEEP), "Ω"))
    return (text[: one.start(1)] + name + text[one.end(1) :]).encode()


def section_lost(rng: Rng, data: bytes) -> bytes:
    parts = re.split(r"(?m)^(?=\[)", data.decode())
    del parts[int(rng.integers(len(parts)))]
    return "".join(parts).encode()


def section_twice(rng: Rng, data: bytes) -> bytes:
    parts = re.split(r"(?m)^(?=\[)", data.decode())
    return "".join([*parts, pick(rng, parts) * pick(rng, (1, 30))]).encode()


BYTES: tuple[Mutator, ...] = (flipped, cut, cut_early, nul, twice, headless)
TEXT = (*BYTES, bad_utf8, bom, crlf, number, line_lost, line_twice, long_line)
BINARY = (*BYTES, lengths, lengths, blank)
LINES = (*TEXT, lines_mixed, stamp, stamp)
TOML = (
    *TEXT, number, number, value_wrong, value_text, value_long, value_deep, list_uneven, key_renamed, section_lost,
    section_twice,
)  # fmt: skip
