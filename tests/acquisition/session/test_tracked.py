"""Sessions with a tracker in process: what a row holds, what is skipped, wrong units, a clock that goes back."""

import threading
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from acquisition.errors import AcquisitionError, RefusedMotionError
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan
from acquisition.session.control import RunControl, RunEvent, RunState
from acquisition.session.tracked import TrackedOptions, TrackedSession
from acquisition.wires.bench import Pumps, Speeds
from acquisition.wires.tracker_bench import TargetLook, TrackerBench
from drivers.device import Block
from drivers.errors import DeviceLost, DeviceStale

HOME = np.zeros(2)
LOOK = TargetLook(0.0, 0.0, HOME, HOME, HOME, None, {"hall": 21.0}, True, np.zeros(3), np.full(3, 1e-6), 10)


def nominal_m(q_rad: np.ndarray) -> np.ndarray:
    """A target on a pole of 0.5 m."""
    return 0.5 * np.column_stack([np.cos(q_rad[:, 0]), np.sin(q_rad[:, 0]), q_rad[:, 1]])


class Bench:
    """Goes at once where it is told to; beyond 2 rad it refuses."""

    def __init__(self, unit: float = 1.0) -> None:
        self.at, self.moves, self.unit, self.hidden = HOME, [], unit, False

    def move(self, q_rad: np.ndarray) -> None:
        if np.abs(q_rad).max() > 2.0:
            raise RefusedMotionError("beyond its range")
        self.at = q_rad
        self.moves.append(q_rad.tolist())

    def look(self, dwell_s: float) -> TargetLook:
        seen_m = np.full(3, np.nan) if self.hidden else self.unit * nominal_m(self.at[None])[0] + 3.0
        return replace(LOOK, q_rad=self.at, cmd_rad=self.at, position_m=seen_m)

    def stop(self) -> None: ...


class Journal:
    def __init__(self) -> None:
        self.rows, self.events = [], []

    def sample(self, sample) -> None:
        self.rows.append(sample.row())

    def event(self, kind, detail) -> None:
        self.events.append((kind, detail))


def taken(bench: Bench, *poses: PlannedPose):
    journal = Journal()
    session = TrackedSession(bench, journal, TrackedOptions(), HOME, nominal_m)
    summary = session.run(PosePlan(1, "rig", (PlannedBlock(poses),)))
    return summary, journal


def test_rows_have_the_columns_of_an_imported_table() -> None:
    bench = Bench()
    summary, journal = taken(bench, PlannedPose((1.0, -0.5), (1, -1), repeat=3), PlannedPose((0.5, -0.5)))
    assert len(summary.samples) == 2
    first, second = journal.rows
    assert (first["x_m"], first["y_m"], first["z_m"]) == pytest.approx((3.0 + 0.5 * np.cos(1.0), 3.4207355, 2.75))
    assert (first["q1_rad"], first["cmd2_rad"], first["repeat"], first["settled"]) == (1.0, -0.5, 3, 1)
    assert (first["approach1"], first["approach2"]) == (1, -1)
    assert (second["approach1"], second["approach2"], second["repeat"]) == (-1, -1, None)  # joint 2 did not move
    assert first["temp_hall_degC"] == 21.0
    assert bench.moves == [[0, 0], [1.0 - 0.035, -0.5 + 0.035], [1.0, -0.5], [0.5, -0.5], [0, 0]]


def test_what_cannot_be_reached_or_seen_is_skipped_with_its_reason() -> None:
    summary, journal = taken(Bench(), PlannedPose((2.5, 0.0)), PlannedPose((1.99, 0.0), (-1, 0)))
    assert (len(summary.samples), summary.skipped) == (1, 1)
    assert journal.events == [("skipped", {"pose": 1, "why": "beyond its range"}), ("sample", {"pose": 2})]
    assert journal.rows[0]["approach1"] == 1  # from its other side it would have been beyond the range
    hidden = Bench()
    hidden.hidden = True
    summary, journal = taken(hidden, PlannedPose((1.0, 0.0)))
    assert summary.skipped == 1
    assert "no valid position" in journal.events[0][1]["why"]


@pytest.mark.parametrize("unit", [1e-3, 25.4, 1e3])
def test_a_wrong_unit_ends_the_session_after_four_poses(unit: float) -> None:
    poses = [PlannedPose((0.3 * k, 0.2 * k)) for k in range(6)]
    with pytest.raises(AcquisitionError, match=r"the readings spread over .* the target moved over .*length_unit"):
        taken(Bench(unit), *poses)
    assert len(taken(Bench(1.02), *poses)[0].samples) == 6


def test_blocks_that_ask_for_more_than_a_pose_are_refused() -> None:
    plan = PosePlan(1, "rig", (PlannedBlock((PlannedPose((0.0, 0.0)),), payload_kg=2.0),))
    with pytest.raises(AcquisitionError, match="block 1 of the plan names a placement, a seat or a payload"):
        TrackedSession(Bench(), Journal(), TrackedOptions(), HOME, nominal_m).run(plan)


class Readings:
    """A pump whose device gives a sample every 10 ms of its own time."""

    def __init__(self, device_s, position_m) -> None:
        self.blocks = [
            Block(np.array([0.01 * k]), np.array([t]), np.array([k]), {"position_m": p[None], "good": np.ones(1)})
            for k, (t, p) in enumerate(zip(device_s, position_m, strict=True))
        ]
        self.at = 10

    def recent(self, after_s):
        return [b for b in self.blocks[: self.at] if b.host_s[-1] > after_s]

    def latest(self):
        return self.blocks[self.at - 1]

    def wait(self, after_s, timeout_s):
        self.at += 1
        if self.at > len(self.blocks):
            raise DeviceStale("tracker: no sample")
        return self.recent(after_s)


def bench_of(readings: Readings) -> TrackerBench:
    robot = SimpleNamespace(
        recent=lambda s: [Block(np.array([1e9]), np.zeros(1), np.zeros(1), {"actual_q_rad": HOME[None]})]
    )
    supervisor = SimpleNamespace(check=lambda: None)
    clock = SimpleNamespace(now_s=lambda: readings.latest().host_s[-1])
    return TrackerBench(None, Pumps(readings, robot), Speeds(1.0, 1.0), supervisor, clock, rate_hz=100.0)


def ringing(n: int, swing_m: float = 1e-3) -> np.ndarray:
    """A swing of 16 Hz that dies out within 80 ms, and 5 um of noise."""
    swing = swing_m * np.exp(-np.arange(n) / 8.0) * np.sin(np.arange(n))
    noise = 5e-6 * np.random.default_rng(4).standard_normal((n, 3))
    return np.array([2.0, 0.0, 0.0]) + noise + np.column_stack([swing, np.zeros(n), np.zeros(n)])


@pytest.mark.parametrize("clocked", [True, False])
def test_a_reading_begins_where_the_target_stands(clocked: bool) -> None:
    device_s = 7.0 + 0.01 * np.arange(200) if clocked else np.full(200, np.nan)
    look = bench_of(Readings(device_s, ringing(200))).look(0.2)
    assert look.settled
    assert look.position_m == pytest.approx([2.0, 0.0, 0.0], abs=6e-6)  # 4 sigma of the mean
    assert look.samples >= 20


def test_a_clock_that_went_back_is_reported() -> None:
    device_s = np.concatenate([86390.0 + 0.01 * np.arange(10), 0.01 * np.arange(900)])
    with pytest.raises(DeviceStale, match="its time does not go on, or went back"):
        bench_of(Readings(device_s, ringing(910))).look(0.2)


class Stopped(Bench):
    """Told to stop on its way to 1 rad; in the pause a person moves it to 0.5 rad."""

    def __init__(self) -> None:
        super().__init__()
        self.control = RunControl(lambda: None)
        self.trouble = iter((True,))

    def move(self, q_rad: np.ndarray) -> None:
        if q_rad[0] == 1.0 and next(self.trouble, False):
            self.at = np.array([0.5, 0.5])
            self.control.tell(RunEvent.BREAK)
            threading.Timer(0.05, self.control.resume).start()  # a person, once the arm stands
            raise DeviceLost("the motion was broken off")
        super().move(q_rad)


def test_a_pose_that_a_pause_broke_off_is_taken_again_and_its_side_is_that_of_the_last_way() -> None:
    bench, journal = Stopped(), Journal()
    session = TrackedSession(bench, journal, TrackedOptions(), HOME, nominal_m, control=bench.control)
    poses = (PlannedPose((1.5, 0.5)), PlannedPose((1.0, -0.5)), PlannedPose((0.2, -0.5)))
    summary = session.run(PosePlan(1, "rig", (PlannedBlock(poses),)))
    assert [row["q1_rad"] for row in journal.rows] == [1.5, 1.0, 0.2]
    assert [row["approach1"] for row in journal.rows] == [1, 1, -1]
    assert (len(summary.samples), summary.skipped) == (3, 0)
    assert bench.control.state is RunState.DONE


def test_poses_of_before_are_left_out_and_the_others_keep_their_numbers() -> None:
    bench, journal = Bench(), Journal()
    session = TrackedSession(bench, journal, TrackedOptions(), HOME, nominal_m, done={1, 3})
    poses = tuple(PlannedPose((0.1 * k, 0.3)) for k in range(1, 5))
    session.run(PosePlan(1, "rig", (PlannedBlock(poses),)))
    assert [row["q1_rad"] for row in journal.rows] == pytest.approx([0.2, 0.4])
    assert [detail["pose"] for kind, detail in journal.events if kind == "sample"] == [2, 4]


def test_a_session_that_a_person_ends_is_no_failure() -> None:
    bench, journal = Bench(), Journal()
    control = RunControl(bench.stop)
    session = TrackedSession(
        bench, journal, TrackedOptions(), HOME, nominal_m, control=control, tell=lambda done, total: control.stop()
    )
    summary = session.run(PosePlan(1, "rig", (PlannedBlock((PlannedPose((0.1, 0.3)), PlannedPose((0.2, 0.3)))),)))
    assert len(summary.samples) == 1
    assert journal.events[-1] == ("ended by a person", {"samples": 1})
