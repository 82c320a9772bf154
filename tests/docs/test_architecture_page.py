"""The map is that of the tree: every path that it names is there, and every room of the program stands in it."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


def test_every_file_that_the_map_names_is_there():
    named = set(re.findall(r"`((?:drivers|acquisition|calibrate|simulators|calibeam|tests|rigs)/[\w/.-]+)`", PAGE))
    assert len(named) > 30
    assert not [path for path in sorted(named) if not (ROOT / path).exists()]


def test_every_room_of_the_program_is_in_the_map():
    rooms = {path.parent.name for path in (ROOT / "calibeam").glob("*/__init__.py")}
    assert not rooms - set(re.findall(r"^\| `(\w+)/` \|", PAGE, re.MULTILINE))


def test_files_of_the_walk_through_a_diagnosis_stand_in_its_folder():
    walk = PAGE[PAGE.index("**diagnose.**") : PAGE.index("| where is")]
    short = re.findall(r"`((?:\w+/)?\w+\.py)`", walk)
    assert len(short) >= 10
    assert not [name for name in short if not (ROOT / "calibrate" / "diagnose" / name).exists()]
