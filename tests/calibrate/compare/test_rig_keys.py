"""Two rig files, key by key."""

from pathlib import Path

import pytest

from acquisition.recording.rig import parse_rig
from calibrate.compare.rig_keys import rig_differences

TEXT = (Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml").read_text(encoding="utf-8")


def differing(*changes):
    text = TEXT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return rig_differences(parse_rig(TEXT, "measured"), parse_rig(text, "simulated"))


def test_rigs_that_differ_in_name_and_layout_only_are_the_same():
    assert differing(('name = "ur5e-dual-psd"', 'name = "another"'), ("0.1333", "1.333e-1")) == ()


def test_keys_stand_in_the_order_of_the_file_and_only_places_decide():
    found = differing(("d_m = 0.1333", "d_m = 0.1233"), ("mass_kg = 0.4\n", "mass_kg = 0.5\n"), ("[0.55, ", "[0.56, "))
    assert [(one.key, one.geometry) for one in found] == [
        ("arm.joint 4.d_m", True),
        ("tool.mass_kg", False),
        ("placement 1.psd1_in_base.origin_m 1", True),
    ]
    assert found[0].difference == pytest.approx(0.01)


def test_a_key_that_one_lacks_stands_with_nothing_on_the_other_side():
    (one,) = differing(("psd_m = 2e-6\n", ""))
    assert (one.key, one.measured, one.simulated, one.difference) == ("noise.psd_m", 2e-6, None, None)
