"""Cones alone hold no length, and that is said; with anything that measures one it is not."""

import pytest

from calibrate.fit.identify.result import scale_alarms


def test_cones_alone_are_asked_to_show_no_length() -> None:
    (alarm,) = scale_alarms(["seat"])
    assert "no length" in alarm
    assert "[[bar]]" in alarm


@pytest.mark.parametrize("others", [["bar"], ["seat", "bar"], ["seat", "position"], ["wire"], []])
def test_with_a_length_nothing_is_said(others: list[str]) -> None:
    assert scale_alarms(others) == ()


def test_a_known_distance_of_two_cones_is_a_length() -> None:
    assert scale_alarms(["seat"], known_lengths=1) == ()
