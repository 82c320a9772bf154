"""What a guided session takes: lengths are never left out, tests of the standards are whole."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from acquisition.errors import AcquisitionError
from acquisition.guided.plan import (
    GuidedOptions,
    by_kind,
    calibration_plan,
    hemisphere,
    planned_visits,
    readings_of,
    verification_plan,
)
from acquisition.guided.reading import BarEnd, Cone, SphereSpot
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan
from acquisition.recording.rig import load_rig

RIG = load_rig(Path(__file__).parents[3] / "rigs" / "arm-cmm-reference.toml")


def test_cones_come_before_and_after_the_bars():
    plan = calibration_plan(RIG, GuidedOptions(postures=5, lengths=2))
    kinds = [type(visit.targets[0]) for visit in plan]
    assert by_kind(plan) == {"cones": 15, "bars": 80, "spheres": 0}
    assert kinds[0] is kinds[-1] is Cone
    assert kinds[6] is BarEnd
    assert readings_of(plan) == 95


def test_both_ends_of_a_bar_are_one_visit_and_its_length_apart():
    visit = next(v for v in calibration_plan(RIG, GuidedOptions()) if isinstance(v.targets[0], BarEnd))
    a, b = visit.targets
    assert (a.end, b.end) == ("a", "b")
    assert np.linalg.norm(np.subtract(a.point_m, b.point_m)) == pytest.approx(RIG.bars[a.bar].length_m)


def test_without_a_known_length_no_session_begins():
    bare = msgspec.structs.replace(RIG, bar_position_list=())
    with pytest.raises(AcquisitionError, match=r"cones alone show no length.*add a \[\[bar\]\]"):
        calibration_plan(bare, GuidedOptions())


def test_a_single_posture_is_refused():
    with pytest.raises(AcquisitionError, match="take 2 or more"):
        GuidedOptions(postures=1)


def test_verification_touches_every_sphere_as_the_standards_count():
    plan = verification_plan(RIG, repeats=1)
    assert by_kind(plan) == {"cones": 30, "bars": 40, "spheres": 2 * (25 + 5 * 5 + 3 * 9)}
    spots = [visit.targets[0] for visit in plan if isinstance(visit.targets[0], SphereSpot)]
    middle = np.array(RIG.spheres[1].origin_m)
    apart = [np.linalg.norm(np.array(spot.point_m) - middle) for spot in spots if spot.id == 1]
    np.testing.assert_allclose(apart, 0.5 * (0.025 + 0.006))


def test_touches_are_spread_evenly_over_the_upper_half():
    spots = hemisphere(25)
    np.testing.assert_allclose(np.linalg.norm(spots, axis=1), 1.0)
    assert spots[:, 2].min() >= 0.0
    nearest = np.sort(np.linalg.norm(spots[:, None] - spots[None], axis=2), axis=1)[:, 1]
    assert nearest.min() > 0.25


def test_a_pose_plan_is_taken_in_its_cones():
    pose = PlannedPose(q_rad=(0.1,) * 6)
    plan = PosePlan(1, RIG.name, (PlannedBlock((pose,), seat=2),))
    (visit,) = planned_visits(plan, RIG)
    assert visit.targets[0] == Cone(2, RIG.seats[2].origin_m)
    assert visit.posture_rad == (0.1,) * 6
    with pytest.raises(AcquisitionError, match="block 1: seat None is no"):
        planned_visits(PosePlan(1, RIG.name, (PlannedBlock((pose,)),)), RIG)
