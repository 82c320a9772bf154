"""Cones, bars in their positions and spheres of a rig file: each named once, nothing hangs in the air."""

from pathlib import Path

import pytest

from acquisition.recording.errors import RigFileError
from acquisition.recording.rig import parse_rig

TEXT = (Path(__file__).parents[3] / "rigs" / "arm-cmm-reference.toml").read_text()


def test_artefacts_are_read_by_id_in_the_order_of_the_file() -> None:
    rig = parse_rig(TEXT, "rig.toml")
    assert list(rig.seats) == [1, 2, 3]
    assert list(rig.bar_positions) == list(range(1, 21))
    assert rig.spheres[2].diameter_m == 0.025
    assert rig.mpe.e_uni_m == 40e-6
    assert rig.tolerance is not None
    assert rig.tolerance.eccentricity_rad == 1e-4


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("[[seat]]\nid = 2", "[[seat]]\nid = 1", r"id = 1 is used twice in \[\[seat\]\]"),
        ("[[bar]]\nid = 2", "[[bar]]\nid = 1", r"id = 1 is used twice in \[\[bar\]\]"),
        ("[[bar_position]]\nid = 1\nbar = 1", "[[bar_position]]\nid = 1\nbar = 7", r"bar = 7 is no \[\[bar\]\].*1, 2"),
        ("direction = [0.4, -1.0, 0.0]", "direction = [0, 0, 0]", "is the zero vector"),
        ("probe_diameter_m = 0.006\n", "", r"add 'probe_diameter_m'.*to \[tool\]"),
        ("diameter_m = 0.025", "diameter_m = 0.0", "expected float >= 1e-09"),
        ("e_uni_per_m = 3e-5", "e_uni_m_m = 3e-5", "unknown key 'e_uni_m_m'"),
    ],
)
def test_what_is_wrong_is_reported_with_its_place(old: str, new: str, says: str) -> None:
    assert old in TEXT
    with pytest.raises(RigFileError, match=says):
        parse_rig(TEXT.replace(old, new, 1), "rig.toml")
