"""Which poses a part of a session takes: the same plan, less what is there, and new places for what was moved."""

from dataclasses import replace
from datetime import UTC, datetime

import pytest

from acquisition.errors import AcquisitionError
from acquisition.recording import Event, RecordingError, RecordingWriter, RigFileError
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan
from acquisition.recording.rig import parse_rig
from acquisition.session.plan import PlanOptions, PoseKey
from calibeam.devices.site import addresses_of
from calibeam.sessions.job import (
    MORE,
    EarlierParts,
    Job,
    more_at,
    new_place,
    notes_of,
    part_of,
    read_earlier_parts,
    same_place,
    with_fixture_moved,
    with_place,
    with_places,
)

from .conftest import RIG_FILE

HALF_M = 0.01
TEXT = RIG_FILE.read_text()


@pytest.fixture
def job(rig, tmp_path) -> Job:
    return Job(rig, TEXT, tmp_path, addresses_of(rig), PlanOptions())


class Clock:
    def now_s(self) -> float:
        return 50.0


def write(job: Job, samples, keys, *, rig_text: str = TEXT, named: int | None = None, notes=None, events=()) -> None:
    """A recording of these samples; of the last ones nobody told which pose they are."""
    notes = notes_of(job, 1) if notes is None else notes
    path = job.out / "recording.mcap"
    started = datetime(2026, 1, 1, tzinfo=UTC)
    with RecordingWriter(
        path, rig_text=rig_text, software="test", clock=Clock(), notes=notes, started_utc=started
    ) as writer:
        writer.event(Event(50.0, "placement", {"id": 1}))
        for kind, detail in events:
            writer.event(Event(50.0, kind, detail))
        for k, (sample, key) in enumerate(zip(samples, keys, strict=True)):
            writer.sample(sample.row())
            if named is None or k < named:
                pose = {"placement": key.placement, "first": key.first, "index": key.index, "again": key.again}
                writer.event(Event(50.0, "sample", {"pose": pose}))


def test_a_session_that_begins_takes_the_whole_plan(job, ahead) -> None:
    part = part_of(job, EarlierParts(), HALF_M)
    assert part.keys == ahead.keys
    assert part.left == 90
    assert part.text == TEXT


def test_yesterday_s_samples_come_back_as_they_were(job, samples, ahead) -> None:
    write(job, samples[:5], ahead.keys[:5])
    earlier = read_earlier_parts(job.out, job.rig)
    assert tuple(earlier.taken) == ahead.keys[:5]
    assert (earlier.standing, earlier.begun) == (1, True)
    for key, sample in zip(ahead.keys, samples[:5], strict=False):
        back = earlier.taken[key]
        assert back.look.spots_m() == pytest.approx(sample.look.spots_m(), abs=0.0)
        assert back.look.q_rad == pytest.approx(sample.look.q_rad, abs=0.0)
        assert (back.placement, back.first, back.centred) == (sample.placement, sample.first, sample.centred)
    assert part_of(job, earlier, HALF_M).left == 85


def test_a_sample_whose_event_was_lost_is_taken_once_more(job, samples, ahead) -> None:
    write(job, samples[:5], ahead.keys[:5], named=4)
    assert tuple(read_earlier_parts(job.out, job.rig).taken) == ahead.keys[:4]


def test_a_recording_that_does_not_say_which_poses_it_holds_is_refused(job, samples, ahead) -> None:
    write(job, samples[:2], ahead.keys[:2], named=0)
    with pytest.raises(RecordingError, match="earlier version"):
        read_earlier_parts(job.out, job.rig)


def test_nothing_to_go_on_with_is_said(job) -> None:
    with pytest.raises(RecordingError, match="no session to go on with"):
        read_earlier_parts(job.out, job.rig)


def test_another_rig_is_refused(job, samples, ahead) -> None:
    write(job, samples[:2], ahead.keys[:2], rig_text=TEXT.replace("d_m = 0.1625", "d_m = 0.1626", 1))
    with pytest.raises(RecordingError, match=r"\[arm\] of the rig has changed"):
        read_earlier_parts(job.out, job.rig)


def test_a_fixture_that_was_moved_stands_at_a_new_place_which_is_measured_as_a_whole(job, samples, ahead) -> None:
    write(job, samples[:5], ahead.keys[:5])
    earlier = read_earlier_parts(job.out, job.rig)
    part = part_of(job, with_fixture_moved(earlier, same_place(job.rig, 1), 1), HALF_M)
    assert {block.placement for block in part.blocks} == {2, 3, 4}
    assert part.left == 90
    assert [key for key in part.keys if key.placement < 4] == [key for key in ahead.keys if key.placement > 1]
    assert part.rig.placements[4].psd1_in_base == job.rig.placements[1].psd1_in_base
    assert parse_rig(part.text, "text").placements.keys() == {1, 2, 3, 4}


def test_the_day_after_knows_of_the_new_place_too(job, samples, ahead) -> None:
    write(job, [], [])
    part = part_of(job, with_fixture_moved(read_earlier_parts(job.out, job.rig), same_place(job.rig, 1), 1), HALF_M)
    (job.out / "recording.mcap").unlink()
    write(job, samples[:1], part.keys[:1], rig_text=part.text, events=[("place added", {"id": 4, "instead_of": 1})])
    again = part_of(job, read_earlier_parts(job.out, job.rig), HALF_M)
    assert again.keys == part.keys
    assert again.left == 89


def test_an_added_place_comes_after_the_others_which_stay_as_they_were(job, ahead) -> None:
    place = new_place(job.rig, (0.5, -0.1, 0.2, 90.0))
    part = part_of(job, with_place(EarlierParts(), place), HALF_M)
    assert part.keys[:90] == ahead.keys
    assert {key.placement for key in part.keys[90:]} == {4}
    assert part.rig.placements[4].psd1_in_base.rotation_rad == pytest.approx((0.0, 0.0, 1.5707963))


def test_a_rig_file_that_takes_no_more_places_is_reported() -> None:
    text = TEXT.replace("[[placement]]", "[[plaice]]")
    rig = parse_rig(TEXT, "rig")
    with pytest.raises(RigFileError, match="a station cannot be added"):
        with_places(rig, text, (new_place(rig, (0.5, 0.0, 0.2, 0.0)),))


def test_more_poses_are_others(job, ahead) -> None:
    part = part_of(job, EarlierParts(), HALF_M)
    more = more_at(part, 2, HALF_M, job.options, 1)
    keys = [key for block in more for key in block.pose_keys()]
    assert not set(keys) & set(part.keys)
    spots = {visit.target.spots_m for block in part.blocks for visit in block.visits if any(visit.target.spots_m)}
    assert not spots & {visit.target.spots_m for block in more for visit in block.visits}


def test_more_poses_of_the_day_after_are_others_than_those_of_the_first_day(job, samples) -> None:
    begun = part_of(job, EarlierParts(), HALF_M)
    first = [key for block in more_at(begun, 2, HALF_M, begun.options, 1) for key in block.pose_keys()]
    part = part_of(job, EarlierParts(dict(zip(first, samples, strict=False))), HALF_M)
    again = more_at(part, 2, HALF_M, part.options, 1)
    assert not {key for block in again for key in block.pose_keys()} & set(first)
    other_station = more_at(part, 3, HALF_M, part.options, 1)
    assert {key.index // MORE for block in other_station for key in block.pose_keys()} == {1}


def plan_of(rig) -> PosePlan:
    poses = tuple(PlannedPose((0.1 * k, -1.4, 1.6, -0.5, 0.5, 0.0)) for k in range(3))
    return PosePlan(schema=1, rig=rig.name, block=(PlannedBlock(pose=poses, placement=2, first_psd=1),))


def test_a_plan_goes_on_with_its_poses_wherever_the_fixture_stands_now(job) -> None:
    planned = replace(job, plan=plan_of(job.rig), plan_text="of yesterday")
    earlier = EarlierParts({PoseKey(2, 1, 0): None}, notes=notes_of(planned, 1), standing=2)  # type: ignore[dict-item]
    part = part_of(planned, earlier, HALF_M)
    assert (part.left, part.open_at(2), part.open_at(1)) == (2, True, False)
    other_station = part_of(planned, with_fixture_moved(earlier, same_place(job.rig, 2), 2), HALF_M)
    assert other_station.plan is not None
    assert [block.placement for block in other_station.plan.block] == [4]
    assert other_station.left == 2


@pytest.mark.parametrize(("plan", "says"), [("of today", "with another --plan"), (None, "with another --plan")])
def test_another_plan_than_yesterday_s_is_refused(job, plan, says) -> None:
    begun = replace(job, plan=plan_of(job.rig), plan_text="of yesterday")
    today = job if plan is None else replace(begun, plan_text=plan)
    with pytest.raises(AcquisitionError, match=says):
        part_of(today, EarlierParts(notes=notes_of(begun, 1)), HALF_M)
