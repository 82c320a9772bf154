"""A session on paper: every pose gone through the gate, what cannot be had told, the drawing left."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan
from acquisition.recording.rig import Rig, load_rig
from acquisition.recording.rig.schema import MotionBox
from acquisition.session.plan import PlanOptions
from calibeam.motion.rehearsal import draw_session, rehearse

RIG = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"
FEW = PlanOptions(centred=1, off_centre=1, repeats=0)


@pytest.fixture(scope="module")
def rig() -> Rig:
    return load_rig(RIG)


def boxed(rig: Rig, *lower_upper: tuple[float, float, float]) -> Rig:
    box = MotionBox("crate", *lower_upper)
    return msgspec.structs.replace(rig, motion=msgspec.structs.replace(rig.motion, keep_out=(box,)))


def test_the_cell_of_the_rig_file_leaves_its_session_free_and_it_is_drawn(rig: Rig, tmp_path: Path) -> None:
    said = draw_session(rig, tmp_path / "session.svg", FEW)
    assert said.startswith("18 poses at 3 stations, all within reach and clear of the keep-out boxes")
    text = (tmp_path / "session.svg").read_text()
    assert "post of place 2" in text
    assert "calibrating area, 0.25 m/s" in text
    assert "station 3" in text


def test_a_box_at_one_place_is_reported_with_the_first_pose_that_it_costs(rig: Rig) -> None:
    x, y, z = rig.placements[2].psd1_in_base.origin_m
    rehearsed = rehearse(boxed(rig, (x - 0.2, y - 0.2, z - 0.2), (x + 0.2, y + 0.2, z + 0.2)), FEW)
    assert rehearsed.refused
    assert {2} <= {stop.placement for stop in rehearsed.refused}
    assert "the first: station" in rehearsed.says
    assert "keep-out box 'crate'" in rehearsed.says


def test_a_plan_of_poses_is_gone_through_as_it_is(rig: Rig) -> None:
    assert rig.motion.home_rad is not None
    home_rad = np.array(rig.motion.home_rad)
    poses = tuple(PlannedPose(tuple((home_rad + off).tolist())) for off in (0.1, 9.0))
    plan = PosePlan(1, rig.name, (PlannedBlock(poses, placement=1, first_psd=1),))
    rehearsed = rehearse(rig, FEW, plan)
    np.testing.assert_array_equal(rehearsed.ways[0], [home_rad, home_rad + 0.1])
    (refused,) = rehearsed.refused
    assert refused.name == "block 1, pose 2"
    assert "would leave its range" in refused.why
