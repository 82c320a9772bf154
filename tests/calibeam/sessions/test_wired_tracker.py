"""A tracker over real wires: a session is recorded and identified, and every way in which it can end early."""

import os
import signal
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from scipy.spatial.transform import Rotation

from acquisition.recording import RecordingWriter, read
from acquisition.recording.rig import load_rig, rig_text
from acquisition.session.tracked import TrackedOptions
from calibeam.devices.site import connected_tracker, tracker_addresses_of
from calibeam.emulation import Emulation
from calibeam.outcome import PartialResult
from calibeam.printing.progress import progress_bar
from calibeam.sessions.with_tracker import (
    TakenBefore,
    TrackedJob,
    WithTracker,
    drawn_plan,
    nominal_target,
    record_tracked,
    taken_before,
)
from calibeam.site_log import SITE_LOG
from drivers.clock import SystemClock
from drivers.ur.supervised import SupervisedChild
from simulators.world.truth import read_truth

RIG_FILE = Path(__file__).parents[3] / "rigs" / "ur5e-tracker.toml"
RIG = load_rig(RIG_FILE)
PACE = 8.0
PLAN = drawn_plan(RIG, 4, 1)
OPTIONS = TrackedOptions(dwell_s=0.2)
BEGINS = TakenBefore(PLAN, {"plan_seed": "1", "plan_poses": "4"})


def session(tmp_path: Path, emulation: Emulation, after: int = 0, trouble=lambda: None, before=BEGINS, name="r.mcap"):
    clock, count, quiet, rig = SystemClock(), [0], Console(quiet=True), RIG
    with (
        RecordingWriter(
            tmp_path / name, rig_text=rig_text(RIG_FILE), software="test", clock=clock, notes=before.notes
        ) as writer,
        connected_tracker(rig, tracker_addresses_of(rig, emulation.address, PACE), writer, clock) as bench,
    ):
        plain = writer.sample

        def counted(*sample) -> None:
            plain(*sample)
            count[0] += 1
            if count[0] == after:
                trouble()

        writer.sample = counted
        return record_tracked(bench, rig, writer, before, clock, progress_bar(quiet), OPTIONS)


def test_a_session_has_the_positions_that_are_true(tmp_path: Path) -> None:
    with Emulation(RIG_FILE, seed=5, time_scale=PACE, truth=tmp_path / "truth.json") as emulation:
        summary = session(tmp_path, emulation)
    recording = read(tmp_path / "r.mcap")
    samples = recording.samples
    assert recording.complete
    assert set(recording.streams) == {"tracker", "robot"}
    assert len(samples) == len(summary.samples) == 6
    assert samples.integers("repeat", 0).tolist()[:3] == [1, 1, 1]
    seen_m = np.column_stack([samples.column(name) for name in ("x_m", "y_m", "z_m")])
    # Three readings of one pose differ by noise (15 um over 20 samples) and repeatability (3 urad at 0.8 m).
    assert np.ptp(seen_m[:3], axis=0).max() < 5e-5
    # Seen from where the tracker truly is, they lie where the nominal arm has them, but for its errors: zeros within
    # 8 mrad, of which 20 mm come at a reach of 0.9 m.
    truth = read_truth(tmp_path / "truth.json")
    in_base_m = Rotation.from_rotvec(truth.device.rotation_rad).apply(seen_m) + truth.device.origin_m
    assert np.linalg.norm(in_base_m - nominal_target(RIG)(samples.joints()), axis=1).max() < 0.02
    q = samples.joints()
    assert np.abs(q - np.column_stack([samples.column(f"cmd{k}_rad") for k in range(1, 7)])).max() < 1e-4


def test_a_tracker_that_falls_silent_stops_the_arm_and_is_named(tmp_path: Path) -> None:
    with Emulation(RIG_FILE, seed=5, time_scale=PACE) as emulation:
        with pytest.raises(PartialResult, match=r"tracker: no (line|sample).*samples kept in .*: 2;"):
            session(tmp_path, emulation, 2, lambda: emulation.ask("tracker.silence"))
        assert emulation.ask("robot.standing")
    recording = read(tmp_path / "r.mcap")
    assert not recording.complete
    assert any(event.kind == "device failed" for event in recording.events)


@pytest.mark.endure  # 8 s; of the driver alone: tests/drivers/tracker/test_device.py
def test_a_closed_connection_is_reported(tmp_path: Path) -> None:
    says = r"tracker: 127.0.0.1:\d+: the instrument closed the connection.*samples kept in .*: 1;"
    with Emulation(RIG_FILE, seed=5, time_scale=PACE) as emulation, pytest.raises(PartialResult, match=says):
        session(tmp_path, emulation, 1, lambda: emulation.inject("tracker", "disconnect", count=1))
    assert len(read(tmp_path / "r.mcap").samples) == 1


@pytest.mark.endure  # daily: of a session with detectors, test_wired_pause.py
def test_paused_by_one_interrupt_ended_by_three_and_gone_on_with(tmp_path: Path, monkeypatch) -> None:
    """The pause ends by SIGCONT, for there is no keyboard; what is left is taken into a further recording."""
    states: list[str] = []

    def heard(kind: str, detail: dict) -> None:
        if kind == "run state":
            states.append(detail["state"])
            if detail["state"] == "paused, the arm stands" and len(states) < 4:
                os.kill(os.getpid(), signal.SIGCONT)

    plain = RecordingWriter.event
    monkeypatch.setattr(RecordingWriter, "event", lambda w, e: (plain(w, e), heard(e.kind, e.detail))[0])
    interrupts, concluded = [1, 3], list[Path]()
    monkeypatch.setattr(
        "calibeam.results.session_results.write_session_results", lambda path, console: concluded.append(path)
    )

    def interrupt() -> None:
        for _ in range(interrupts.pop(0)):
            os.kill(os.getpid(), signal.SIGINT)

    with Emulation(RIG_FILE, seed=5, time_scale=PACE) as emulation:
        whole = session(tmp_path, emulation, 1, interrupt, name="paused.mcap")
        assert states[:3] == ["measuring", "paused, the arm stands", "measuring"]
        assert len(whole.samples) == 6
        with pytest.raises(PartialResult, match=r"the session was aborted.*to go on, give the same command with --con"):
            session(tmp_path, emulation, 2, interrupt, name="recording.mcap")
        wires = tracker_addresses_of(RIG, emulation.address, PACE)
        job = TrackedJob(RIG, rig_text(RIG_FILE), tmp_path, wires, seed=9, go_on=True)
        before = taken_before(job)
        assert (before.plan, before.done) == (PLAN, frozenset({1, 2}))
        for _ in ("the rest", "nothing"):
            WithTracker(job, Console(quiet=True), asking=None, agrees=True).run()
    assert concluded == [tmp_path, tmp_path]
    assert taken_before(job).left == 0
    twice, once = (read(tmp_path / name).samples.joints() for name in ("paused.mcap", "recording-0002.mcap"))
    np.testing.assert_allclose(once, twice[2:], atol=1e-4)


class Person:
    """At the terminal: agrees to every motion, and goes on."""

    fd = None

    def __init__(self) -> None:
        self.asked: list[str] = []

    def may_move(self) -> None:
        self.asked.append("may it move")

    def choice(self, question: str, choices: dict[str, str], default: str) -> str:
        self.asked.append(question)
        return "g"


@pytest.mark.endure  # daily: test_wired_stops.py; of the driver: tests/drivers/ur/test_frozen.py
@pytest.mark.parametrize(
    ("number", "says"), [(signal.SIGKILL, "has gone (signal SIGKILL)"), (signal.SIGSTOP, "was frozen")]
)
def test_a_control_child_that_dies_or_freezes_is_reported_and_a_person_decides(
    tmp_path, monkeypatch, number, says
) -> None:
    children, person, plain = list[int](), Person(), RecordingWriter.sample
    started = SupervisedChild.__init__
    monkeypatch.setattr(
        SupervisedChild, "__init__", lambda child, *about: (started(child, *about), children.append(child.pid))[0]
    )

    def struck(writer: RecordingWriter, *sample) -> None:
        plain(writer, *sample)
        if len(children) == 1:
            os.kill(children[0], number)

    monkeypatch.setattr(RecordingWriter, "sample", struck)
    monkeypatch.setattr("calibeam.results.session_results.write_session_results", lambda path, console: None)
    with Emulation(RIG_FILE, seed=5, time_scale=PACE) as emulation:
        wires = tracker_addresses_of(RIG, emulation.address, PACE)
        job = TrackedJob(RIG, rig_text(RIG_FILE), tmp_path, wires, PLAN)
        with SITE_LOG.heard("info"):
            WithTracker(job, Console(quiet=True), asking=person, agrees=False).run()
    assert person.asked == ["may it move", "the arm was stopped, and the recording is closed:", "may it move"]
    log = (tmp_path / "session.log").read_text()
    assert f"of this program ({children[0]}) {says}" in log
    assert "THE ARM WAS STOPPED" in log
    assert "switched off" not in log
    recordings = [read(tmp_path / name) for name in ("recording.mcap", "recording-0002.mcap")]
    assert [(one.complete, len(one.samples)) for one in recordings] == [(False, 1), (True, 5)]
