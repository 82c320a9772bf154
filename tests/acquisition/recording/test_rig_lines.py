"""Finding the line of a key, also where TOML is written in unusual ways."""

import tomllib
from pathlib import Path
from typing import Any

from acquisition.recording.files.explain import KeyPath
from acquisition.recording.files.toml_file import key_lines, line_of

UNUSUAL = '''\
title = """
[not.a.table]
fake = 1"""
"quoted.key" = 'single # no comment' # a comment with = and [
a.b . c = { d = 1, "e" = [ { f = 2 }, { f = 3 } ] }

[ "x y" . z ] # spaced
list = [
  1.5, # one
  [2, 3],

  { deep = """two
lines""" },
]
when = 1979-05-27 07:32:00

[[many]]
n = 1
[many.sub]
m = 2
[[many]]
n = 3
[many.sub]
m = 4
'''


def paths(value: Any, path: KeyPath = ()) -> list[KeyPath]:
    """Every key and array element that the standard reader finds."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [found for key, inner in items for found in ((*path, key), *paths(inner, (*path, key)))]


def test_keys_are_found_in_every_way_of_writing_them() -> None:
    lines = key_lines(UNUSUAL)
    expected = {
        ("title",): 1,
        ("quoted.key",): 4,
        ("a", "b", "c", "d"): 5,
        ("a", "b", "c", "e", 1, "f"): 5,
        ("x y", "z", "list"): 8,
        ("x y", "z", "list", 0): 9,
        ("x y", "z", "list", 1, 1): 10,
        ("x y", "z", "list", 2, "deep"): 12,
        ("x y", "z", "when"): 15,
        ("many", 0, "n"): 18,
        ("many", 0, "sub", "m"): 20,
        ("many", 1): 21,
        ("many", 1, "sub", "m"): 24,
    }
    assert {path: lines[path] for path in expected} == expected


def test_no_key_of_any_rig_stays_without_a_line(root: Path) -> None:
    texts = [UNUSUAL, *(path.read_text() for path in sorted((root / "rigs").glob("*.toml")))]
    for text in texts:
        found = key_lines(text)
        for path in paths(tomllib.loads(text)):
            assert path in found, path
            assert 1 <= found[path] <= text.count("\n") + 1


def test_each_key_of_the_shipped_rig_stands_on_the_line_found(root: Path) -> None:
    text = (root / "rigs" / "ur5e-dual-psd.toml").read_text()
    rows = text.split("\n")
    for path, line in key_lines(text).items():
        key = next(name for name in reversed(path) if isinstance(name, str))
        assert key in rows[line - 1], path


def test_a_key_that_is_not_there_is_placed_at_its_table() -> None:
    assert line_of(key_lines(UNUSUAL), ("many", 1, "nowhere")) == 21
    assert line_of(key_lines(UNUSUAL), ("nothing",)) == 1
