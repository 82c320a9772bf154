"""Recorded motions with concealed torques: drawn from a seed, driven by the world, weighed against the noise."""

from dataclasses import replace

import numpy as np
import pytest

from simulators.conceal.motion.driving import drive
from simulators.conceal.motion.motion_case import ARMS_IN_MOTION, LISTED, UNLISTED, MotionCase, draw_motion
from simulators.conceal.motion.over_noise import TorquesOnTheWay, over_noise
from simulators.conceal.wanted import ConcealError, Wanted
from simulators.defects import defects_of, written
from simulators.defects.torque import Coulomb


def drawn(arm: str = "ur5e", *defects: str, seed: int = 7) -> MotionCase:
    return draw_motion(Wanted("tracker", seed=seed, arm=arm, defects=defects))


@pytest.mark.parametrize("arm", ARMS_IN_MOTION)
def test_recorded_torques_are_those_that_move_the_arm_as_recorded(arm: str) -> None:
    case = replace(drawn(arm, "coulomb"), angle_sigma_rad=0.0)
    quiet = replace(case, torque_sigma_nm=0.0 * case.torque_sigma_nm)
    moved = drive(quiet)
    way = TorquesOnTheWay(quiet, moved)
    each = round(way.step_s * 500.0)
    left = (moved.torque_nm[::each] - way.reported_nm(case.hidden))[200:-200]
    here = np.abs(way.qd_rad_s[200:-200]) > 0.05  # slower, friction turns within the step that is compared
    off = np.sqrt(np.mean(np.where(here, left, 0.0) ** 2, axis=0))
    assert np.all(off < 4e-3 * np.abs(moved.torque_nm).max(axis=0))


def test_what_is_hidden_differs_from_the_stated_rig_by_the_tolerances_only() -> None:
    case = drawn("kr6", seed=3)
    assert not case.hidden
    for stated, true in zip(case.stated["arm"]["joint"], case.true["arm"]["joint"], strict=True):
        assert stated["mass_kg"] != true["mass_kg"]
        assert true["mass_kg"] == pytest.approx(stated["mass_kg"], rel=0.05)
    assert "emulation" not in case.stated


@pytest.mark.parametrize("name", [*LISTED, *UNLISTED])
def test_every_mechanism_is_drawn_by_its_name_and_can_be_handed_over(name: str) -> None:
    case = drawn("iiwa7", name)
    assert [one.KIND for one in case.hidden] == [name]
    assert defects_of(written(case.hidden)) == case.hidden


def test_effect_over_noise_grows_with_the_mechanism_and_is_small_where_tolerances_take_it() -> None:
    case = drawn("ur5e", seed=5)
    moved = drive(case)
    small, large = (replace(case, hidden=(Coulomb(2, size),)) for size in (0.5, 1.0))
    assert over_noise(large, moved)[0] == pytest.approx(2.0 * over_noise(small, moved)[0], rel=1e-3)
    assert over_noise(case, moved) == []


@pytest.mark.parametrize(("arm", "defects", "names"), [("irb120", (), "ur5e"), ("kr6", ("soft-joint",), "coulomb")])
def test_what_cannot_be_drawn_is_refused_with_what_there_is(arm: str, defects: tuple[str, ...], names: str) -> None:
    with pytest.raises(ConcealError, match=names):
        drawn(arm, *defects)
