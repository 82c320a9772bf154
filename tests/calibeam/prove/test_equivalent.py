"""Which places count as one: few, and each with its reason."""

import pytest

from calibeam.prove.scoring import RULES, same_place


def test_the_same_word_needs_no_reason() -> None:
    assert same_place("joint3.angle", "joint3.angle", "dual-psd") == ""


@pytest.mark.parametrize(
    ("true", "said", "family"),
    [
        ("joint3.angle", "joint4.angle", "dual-psd"),
        ("link2.length", "link3.length", "tracker"),
        ("link*.length", "link3.tilt", "tracker"),
        ("base.pose", "device.pose", "dual-psd"),
        ("base.pose", "fixture.pose", "dual-psd"),
        ("psd1.reading", "psd2.reading", "dual-psd"),
    ],
)
def test_another_place_is_wrong(true: str, said: str, family: str) -> None:
    assert same_place(true, said, family) is None


def test_growth_of_the_arm_may_be_named_at_any_link() -> None:
    assert same_place("link*.length", "link4.length", "dual-psd") == RULES[0].reason


def test_base_and_only_device_move_against_each_other() -> None:
    assert same_place("base.pose", "device.pose", "tracker") == RULES[1].reason
