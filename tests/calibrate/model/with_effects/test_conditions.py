"""What a row lacks is filled in from the recording: what a commanded angle lacks is its difference from the reading."""

import numpy as np
from numpy.testing import assert_allclose

from acquisition.recording import Samples
from calibrate.apply.export.not_carried import _drawn  # pyright: ignore[reportPrivateUsage]
from calibrate.model.with_effects.applied import against, completed

BEHIND_RAD = 90e-6  # of the recorded commands
rng = np.random.default_rng(4)


def table(q_rad, **columns):
    joints = {f"q{j + 1}_rad": values for j, values in enumerate(q_rad.T)}
    n = len(q_rad)
    return Samples({"t_s": np.arange(float(n)), **joints, **columns}, q_rad.shape[1])


RECORDED = table(q := rng.uniform(-2.0, 2.0, (40, 3)), cmd2_rad=q[:, 1] + BEHIND_RAD, temp_cell_degC=np.full(40, 21.0))


def test_a_missing_command_is_as_far_off_its_own_reading_as_the_recorded_ones_were():
    asked = table(rng.uniform(-2.0, 2.0, (5, 3)))
    filled = completed(asked, RECORDED, ("cmd2_rad", "temp_cell_degC"), same_session=False)
    assert_allclose(filled.samples.column("cmd2_rad") - asked.column("q2_rad"), BEHIND_RAD, rtol=1e-9)
    assert_allclose(filled.samples.column("temp_cell_degC"), 21.0)
    assert set(filled.missing) == {"cmd2_rad", "temp_cell_degC"}


def test_only_a_command_is_stated_against_a_reading():
    assert_allclose(against("cmd2_rad", RECORDED), RECORDED.column("q2_rad"))
    assert_allclose(against("temp_cell_degC", RECORDED), 0.0)


def test_poses_drawn_for_an_export_keep_how_far_commands_are_off():
    drawn = _drawn(RECORDED)
    assert np.ptp(drawn.column("q2_rad")) > 1.0
    assert_allclose(drawn.column("cmd2_rad") - drawn.column("q2_rad"), BEHIND_RAD, rtol=1e-6)
