"""What a diagnosis advises to do about rivals."""

from dataclasses import replace

from calibrate.diagnose.assess.diagnosis import Finding, Named, RivalName
from calibrate.diagnose.diagnose import (
    COOLED,
    POSES,
    WITNESS,
    to_measure,
)

GROWTH = Named("link2.length", ("temp_link2",), "linear", None, "link-thermal-growth")


def advice(*rivals):
    found = Finding(GROWTH, {}, 1.0, 0.5, 0.001, 20.0, 30.0, "link 2 grows", rivals, None)
    return to_measure([found])


def rival(alike=False, **other):
    return RivalName(replace(GROWTH, **other), 0.3, 1.0, refitted=True, alike=alike)


def test_rivals_of_one_name_are_reported_with_what_they_follow():
    (said,) = advice(rival(depends_on=("temp_link6",)), rival(depends_on=("t",), shape="exponential"))
    assert "link-thermal-growth at link2.length by temp_link6, link-thermal-growth at link2.length by t" in said


def test_what_only_the_course_of_time_parts_is_not_sent_to_other_poses():
    (said,) = advice(rival(depends_on=("t",), shape="exponential"))
    assert said.endswith(COOLED)


def test_a_drift_at_another_place_is_reported_by_poses():
    (said,) = advice(rival(where="base.pose", depends_on=("t",), physics="base-moved"))
    assert said == f"link-thermal-growth at link2.length could also be base-moved at base.pose: {POSES}"


def test_what_no_pose_can_tell_needs_a_second_instrument():
    (said,) = advice(rival(alike=True, where="device.pose", physics="device-drift"))
    assert said.endswith(WITNESS)
