"""Findings that change along the session, and the columns that would tell what they follow."""

from dataclasses import replace

import pytest

from calibrate.diagnose.assess.diagnosis import (
    NOT_FINAL,
    Finding,
    Named,
    RivalName,
)
from calibrate.diagnose.assess.missing_columns import drift_not_determined, not_final_drift, suspects
from calibrate.model.effects.term import Missing

WARMTH = (Missing("temp", "temp_<where>_degC", "link-thermal-growth"),)
PAYLOAD = (Missing("payload", "payload_kg", "payload-compliance"),)


def found(where, physics, shape="exponential", depends_on=("t",)):
    name = Named(where, depends_on, shape, None, physics)
    return Finding(name, {}, 0.7, 0.98, 1e-6, 40.0, 30.0, "drifts", (), None)


def columns(finding, missing):
    return tuple(m.column for m in suspects(finding.name, missing))


def test_a_drift_may_follow_a_temperature_that_was_not_recorded():
    assert columns(found("base.pose", "base-moved"), WARMTH) == ("temp_room_degC",)
    assert not_final_drift(found("base.pose", "base-moved")).confidence == pytest.approx(NOT_FINAL)


def test_what_makes_a_name_less_sure_makes_no_alternative_likelier_than_it():
    other = RivalName(Named("device.pose", ("t",), "exponential", None, "device-drift"), 0.4, 0.1, refitted=True)
    finding = replace(found("base.pose", "base-moved"), confidence=0.6, rivals=(other,))
    (less,) = not_final_drift(finding).rivals
    assert not_final_drift(finding).confidence == pytest.approx(NOT_FINAL)
    assert less.confidence == pytest.approx(0.4 * NOT_FINAL / 0.6)


def test_what_does_not_drift_follows_no_temperature():
    assert columns(found("joint2.angle", "backlash", "hysteresis", ("approach2",)), WARMTH) == ()
    assert columns(found("fixture.pose", "fixture-moved", "step"), WARMTH) == ()


def test_with_thermometers_a_drift_is_none_of_warmth():
    assert columns(found("base.pose", "base-moved"), PAYLOAD) == ()


def test_an_unknown_drift_stays_as_sure_as_it_was_and_may_be_a_load():
    drift = found("link2.tilt", "unknown", "smooth", ("temp_room",))
    assert not_final_drift(drift).confidence == pytest.approx(0.98)
    assert columns(drift, PAYLOAD) == ("payload_kg",)
    assert columns(found("joint2.angle", "unknown", "smooth", ("q2",)), PAYLOAD) == ()


@pytest.mark.parametrize(
    ("where", "columns_named"),
    [
        ("link2.length", ("temp_link2_degC", "temp_room_degC")),
        ("joint3.angle", ("temp_link3_degC", "temp_room_degC")),
        ("laser.direction", ("temp_laser_degC", "temp_room_degC")),
        ("fixture.pose", ("temp_room_degC",)),
    ],
)
def test_the_thermometer_that_would_tell_is_named_with_its_column(where, columns_named):
    drift = found(where, "unknown", "smooth")
    assert columns(drift, WARMTH) == columns_named
    assert all(column in drift_not_determined(drift, suspects(drift.name, WARMTH)).why for column in columns_named)
