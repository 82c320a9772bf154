"""What a page is told: what is fresh as it is, what is old as nothing, and the beam where the model says."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from msgspec import structs

from acquisition.recording.rig import Placement, Pose, load_rig
from calibeam.live.composer import Composer
from calibeam.live.feed import Progress
from calibeam.live.health import Latest
from calibrate.model.assumed_rig import AssumedRig
from drivers.device import Block

RIGS = Path(__file__).parents[3] / "rigs"


@pytest.fixture
def composer(rig, latest) -> Composer:
    return Composer(rig, latest, "session")


def decoded(text: str) -> dict:
    return msgspec.json.decode(text)


def test_the_rig_is_reported_once(composer, rig) -> None:
    says = decoded(composer.rig())
    assert (says["kind"], says["name"], says["job"]) == ("rig", rig.name, "session")
    assert says["half_m"] == rig.fixture.half_size_m
    assert 1.0 < says["reach_m"] < 1.5


def test_before_anything_is_heard_nothing_is_made_up(composer) -> None:
    now = decoded(composer.now())
    assert (now["faces"], now["q_rad"], now["points_m"], now["beam"]) == (None, None, None, None)
    state = decoded(composer.state())
    assert {device["state"] for device in state["devices"]} == {"waiting"}
    assert state["stop"]["ready"] is False


def test_spots_and_beam_are_those_of_light_and_model(composer, living, rig, latest) -> None:
    latest.stands(1, 1)
    living.send(0.0)
    decoded(composer.state())
    now = decoded(composer.now())
    expected = AssumedRig(rig).expect(living.posture(0.0), 1, 1).spots_m
    shown = [now["faces"][k][name] for k in (0, 1) for name in ("x_m", "y_m")]
    assert shown == pytest.approx(expected + np.array([6e-4, -4e-4, -3e-4, 8e-4]), abs=2e-6)
    by_joints = AssumedRig(rig).expect(np.array(now["q_rad"]), 1, 1).spots_m  # as told: with the noise of the encoders
    assert now["beam"]["spots_m"] == pytest.approx(by_joints, abs=2e-6)
    assert now["beam"]["both"] is True
    assert [face["state"] for face in now["faces"]] == ["light", "light"]
    assert len(now["points_m"]) == 7


def test_the_beam_goes_from_the_laser_over_one_face_to_the_other(composer, living, rig, latest) -> None:
    latest.stands(1, 1)
    living.send(0.0)
    decoded(composer.state())
    laser, first, second = (np.array(point) for point in decoded(composer.now())["beam"]["points_m"])
    origin_m, direction = AssumedRig(rig).beam(living.posture(0.0))
    assert laser == pytest.approx(origin_m, abs=2e-5)
    assert np.cross(first - laser, direction) == pytest.approx(0.0, abs=5e-5)
    normal = AssumedRig(rig).T_base_psd1(1)[:3, 2]
    inward, outward = first - laser, second - first
    mirrored = inward - 2.0 * (inward @ normal) * normal
    assert outward / np.linalg.norm(outward) == pytest.approx(mirrored / np.linalg.norm(mirrored), abs=2e-3)


def test_a_face_in_the_dark_says_so(composer, living) -> None:
    living.dark = {2}
    living.send(0.0)
    one, two = decoded(composer.now())["faces"]
    assert (one["state"], two["state"], two["x_m"]) == ("light", "no light", None)


def test_a_saturated_face_says_so(composer, living) -> None:
    living.bright = {1}
    living.send(0.0)
    assert decoded(composer.now())["faces"][0]["state"] == "saturated"


def test_old_samples_are_not_shown(composer, living, clock) -> None:
    living.send(0.0)
    clock.time_s += 1.0
    now = decoded(composer.now())
    assert (now["faces"], now["q_rad"], now["points_m"]) == (None, None, None)
    assert {device["state"] for device in decoded(composer.state())["devices"]} == {"stale"}


def test_without_the_controller_the_encoders_tell_the_joints(composer, living) -> None:
    living.silent = {"robot"}
    living.send(0.0)
    now = decoded(composer.now())
    assert now["by"] == "encoders"
    assert now["q_rad"] == pytest.approx(living.posture(0.0), abs=1e-4)


def test_a_joint_that_does_not_answer_is_none_and_no_robot_is_drawn(composer, latest, clock) -> None:
    values = {"position_rad": np.array([[0.1, np.nan, 0.3, 0.4, 0.5, 0.6]])}
    latest.heard("encoders", Block(np.array([clock.now_s()]), np.array([1.0]), np.array([1]), values))
    now = decoded(composer.now())
    assert now["q_rad"] == [0.1, None, 0.3, 0.4, 0.5, 0.6]
    assert now["points_m"] is None


def test_where_the_fixture_stands_is_guessed_when_nobody_says(composer, living) -> None:
    living.send(0.0)
    standing = decoded(composer.state())["standing"]
    assert (standing["placement"], standing["first_psd"], standing["told"]) == (1, 1, False)


def test_a_fitted_model_moves_the_beam(composer, living, latest) -> None:
    latest.stands(1, 1)
    living.send(0.0)
    decoded(composer.state())
    before = decoded(composer.now())["beam"]["spots_m"]
    latest.believes({"joint1.zero": 5e-3})
    decoded(composer.state())
    after = decoded(composer.now())["beam"]["spots_m"]
    assert np.max(np.abs(np.subtract(after, before))) > 1e-3


def test_a_place_that_the_rig_file_does_not_have_is_no_trouble(composer, living, latest) -> None:
    latest.stands(9, 1)
    latest.believes({"placement9.x": 1e-3, "joint1.zero": 1e-3})
    living.send(0.0)
    assert decoded(composer.state())["standing"]["placement"] == 1


def test_a_place_that_the_session_added_is_drawn_where_it_is(composer, living, rig, latest) -> None:
    added = Placement(9, Pose(origin_m=(0.3, -0.2, 0.1)))
    latest.measures(structs.replace(rig, placement_list=(*rig.placement_list, added)))
    latest.stands(9, 1)
    living.send(0.0)
    standing = decoded(composer.state())["standing"]
    assert (standing["placement"], standing["told"]) == (9, True)
    assert np.mean(standing["corners_m"][0], axis=0) == pytest.approx((0.3, -0.2, 0.1), abs=1e-4)


def test_progress_and_log_come_with_their_ages(composer, latest, clock) -> None:
    latest.progress(Progress("collecting", 3, 40, 120.0, "too early to tell"))
    latest.said("place 1: light found")
    clock.time_s += 2.0
    state = decoded(composer.state())
    assert state["progress"] == {
        "phase": "collecting",
        "done": 3,
        "total": 40,
        "left_s": 120.0,
        "note": "too early to tell",
    }
    assert state["lines"] == [{"number": 1, "age_s": 2.0, "text": "place 1: light found"}]


def test_a_stop_is_asked_to_every_page(composer, latest, clock) -> None:
    latest.stops_by(lambda: None)
    latest.stop.press("the page at 127.0.0.1")
    clock.time_s += 3.0
    stop = decoded(composer.state())["stop"]
    assert (stop["ready"], stop["delivered"], stop["age_s"]) == (True, True, 3.0)
    assert stop["who"] == "the page at 127.0.0.1"


def test_a_measuring_arm_has_no_beam(clock) -> None:
    rig = load_rig(RIGS / "arm-cmm-reference.toml")
    latest = Latest(clock)
    composer = Composer(rig, latest, "watch")
    q_rad = np.full((1, rig.n_joints), 0.1)
    latest.heard("encoders", Block(np.array([clock.now_s()]), np.array([1.0]), np.array([1]), {"position_rad": q_rad}))
    decoded(composer.state())
    now = decoded(composer.now())
    assert len(now["points_m"]) == rig.n_joints + 1
    assert now["beam"] is None
