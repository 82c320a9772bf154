"""Motion plans: written and read back, refused with file, line, value and remedy."""

import re
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import RigFileError
from acquisition.recording.motion_plan import JointSeries, MotionPlan, read_motion_plan, write_motion_plan
from acquisition.recording.rig import load_rig

RIG = load_rig(Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml")
SERIES = JointSeries(0.3, (0.4, -0.2, 0.0), (0.4, -0.1, 0.0))  # 0.4 - 2 * 0.2 = 0, 0.4 - 4 * 0.1 = 0
PLAN = MotionPlan(1, RIG.name, 10.0, 2, (SERIES,) * 6, ("a motion for a test",))


def test_a_motion_is_read_as_it_was_written(tmp_path: Path) -> None:
    write_motion_plan(tmp_path / "motion.toml", PLAN)
    assert read_motion_plan(tmp_path / "motion.toml", RIG) == PLAN


def test_every_repeat_begins_at_rest_and_without_acceleration() -> None:
    ends_s = np.array([0.0, 10.0, 20.0])
    assert PLAN.at(ends_s)[:, 0] == pytest.approx(0.3 + 0.4 - 0.1)
    assert PLAN.at(ends_s, 1) == pytest.approx(0.0, abs=1e-12)
    assert PLAN.at(ends_s, 2) == pytest.approx(0.0, abs=1e-12)


def test_derivatives_are_those_of_the_angles() -> None:
    t_s = np.linspace(0.0, 10.0, 20001)
    for order in (0, 1, 2):
        slope = np.gradient(PLAN.at(t_s, order), t_s, axis=0)
        assert slope[1:-1] == pytest.approx(PLAN.at(t_s, order + 1)[1:-1], abs=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("0.4, -0.2, 0.0", "0.4, -0.3, 0.0", r"line 11: joint 1 begins with -0.1257 rad/s; choose sine_rad"),
        ("0.4, -0.1, 0.0", "0.4, 0.1, 0.0", r"line 12: joint 1 begins with -0.3158 rad/s2; choose cosine_rad"),
        ("middle_rad = 0.3", "middle_rad = 6.0", r"motion.toml line 9: joint 1 at 6.3 rad .* outside its range"),
        ("0.4, -0.2, 0.0", "0.4, -0.2", r"cosine_rad of joint 1 has 3 amplitudes, sine_rad of joint 1 has 2"),
        (RIG.name, "another", r"motion.toml line 2: rig = 'another', but this rig is"),
        ("repeats = 2", "repeats = 0", r"motion.toml line 4: repeats = 0 .*>= 1; correct it"),
        ("\n[[joint]]  # 6", "\n[not]", r"motion.toml line 34: unknown key 'not'"),
        ("schema = 1", "schema = 2", r"motion.toml line 1: schema = 2"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(tmp_path: Path, old: str, new: str, says: str) -> None:
    path = tmp_path / "motion.toml"
    write_motion_plan(path, PLAN)
    path.write_text(path.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    with pytest.raises(RigFileError) as refused:
        read_motion_plan(path, RIG)
    assert re.search(says, str(refused.value)), str(refused.value)
