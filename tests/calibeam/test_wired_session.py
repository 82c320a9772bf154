"""Sessions over real wires: every way in which one can end early. Whole ones: test_same_on_wires.py."""

import os
import re
import signal
import threading
import tomllib
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import msgspec
import numpy as np
import pytest
from rich.console import Console

from acquisition.recording import Recording, RecordingWriter, read
from acquisition.recording.rig import Rig, load_rig, rig_text
from acquisition.session.plan import PlanOptions
from acquisition.session.stepping import Summary
from calibeam.cli import run
from calibeam.devices.recorder import record_session
from calibeam.devices.site import addresses_of, connected
from calibeam.emulation import Emulation
from calibeam.outcome import PartialResult
from calibeam.printing.progress import progress_bar
from calibrate.model.arms.rig_arm import RigArm
from drivers.clock import SystemClock
from drivers.ur.reader import UrReader
from simulators.ur.controller_kinematics import NominalArm

from .conftest import brisk

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"

SMALL = PlanOptions(centred=2, off_centre=2, repeats=1)  # about 8 s at the tests' pace


class Takes:
    """Runs a session over the wires of an emulation; `trouble` is called after so many samples."""

    def __init__(self, rig: Rig, emulation: Emulation, path: Path) -> None:
        self.rig, self.emulation, self.path = rig, emulation, path
        self.trouble: tuple[int, Callable[[], None]] | None = None

    def run(self) -> Summary:
        clock = SystemClock()
        emulated = addresses_of(self.rig, self.emulation.address, self.emulation.time_scale or 1.0)
        with (
            RecordingWriter(self.path, rig_text=rig_text(RIG), software="test", clock=clock) as writer,
            connected(self.rig, emulated, writer, clock, self.emulation.place_fixture) as bench,
        ):
            if self.trouble is not None:
                self._arrange(writer, *self.trouble)
            return record_session(bench, self.rig, writer, SMALL, clock, progress_bar(Console(quiet=True)))

    def recording(self) -> Recording:
        return read(self.path)

    def _arrange(self, writer: RecordingWriter, after: int, act: Callable[[], None]) -> None:
        plain, count = writer.sample, [0]

        def counted(*sample) -> None:
            plain(*sample)
            count[0] += 1
            if count[0] == after:
                act()

        writer.sample = counted


@pytest.fixture
def takes(rig: Rig, emulation: Emulation, tmp_path: Path) -> Takes:
    return Takes(brisk(rig), emulation, tmp_path / "recording.mcap")


def arm_speed_rad_s(emulation: Emulation) -> float:
    reader = UrReader(str(emulation.address["robot"]["host"]))
    reader.connect()
    try:
        return float(np.max(np.abs(reader.read(2.0).values["actual_qd_rad_s"][-1])))
    finally:
        reader.close()


@pytest.mark.endure  # daily: in process, tests/acquisition/session/test_session.py
def test_a_protective_stop_ends_the_session_and_keeps_the_samples(takes: Takes) -> None:
    takes.trouble = (2, lambda: takes.emulation.ask("robot.protective_stop"))
    with pytest.raises(PartialResult, match=r"PROTECTIVE_STOP; clear the cause.*samples kept in"):
        takes.run()
    assert not takes.recording().complete
    assert len(takes.recording().samples) >= 2


@pytest.mark.endure  # daily: every device of a motion, test_device_faults.py; of a tracker, test_wired_tracker.py
def test_a_silent_psd_box_stops_the_arm_and_is_named(takes: Takes) -> None:
    takes.trouble = (2, lambda: takes.emulation.ask("psd.silence", on=True))
    with pytest.raises(PartialResult, match="psd: no sample"):
        takes.run()
    assert arm_speed_rad_s(takes.emulation) < 1e-3
    assert any(event.kind == "device failed" for event in takes.recording().events)


@pytest.mark.endure  # daily: every device of a motion, test_device_faults.py
def test_a_silent_encoder_is_named(takes: Takes) -> None:
    takes.trouble = (2, lambda: takes.emulation.ask("encoders.silence", node=3))
    with pytest.raises(PartialResult, match="3"):
        takes.run()
    assert len(takes.recording().samples) >= 2


@pytest.mark.endure  # daily: every device of a motion, test_device_faults.py
def test_a_controller_that_goes_quiet_ends_the_session(takes: Takes) -> None:
    takes.trouble = (2, lambda: takes.emulation.ask("robot.silence", on=True))
    with pytest.raises(PartialResult, match="robot"):
        takes.run()
    assert len(takes.recording().samples) >= 2


@pytest.mark.endure  # half a minute of searching; in process: tests/acquisition/session/test_session.py
def test_a_light_that_is_gone_for_good_ends_the_session(takes: Takes) -> None:
    takes.emulation.place_fixture = lambda placement: takes.emulation.ask("fixture.place", id=0)
    with pytest.raises(PartialResult, match="check that the laser is on"):
        takes.run()
    assert len(takes.recording().events) > 0


def test_ctrl_c_in_mid_session_leaves_a_readable_recording_and_a_standing_arm(takes: Takes) -> None:
    takes.trouble = (2, lambda: os.kill(os.getpid(), signal.SIGINT))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job inherits it ignored
    try:
        with pytest.raises(PartialResult, match="Ctrl-C"):
            takes.run()
    finally:
        signal.signal(signal.SIGINT, before)
    assert arm_speed_rad_s(takes.emulation) < 1e-3
    assert not takes.recording().complete
    assert len(takes.recording().samples) == 2


@pytest.mark.endure  # a quarter of a minute
def test_a_box_at_its_slowest_rate_serves_a_session(takes: Takes) -> None:
    """At 100 Hz every frame holds one sample, and a glance few."""
    psd = msgspec.structs.replace(takes.rig.devices.psd, rate_hz=100.0)
    takes.rig = msgspec.structs.replace(takes.rig, devices=msgspec.structs.replace(takes.rig.devices, psd=psd))
    assert len(takes.run().samples) == 12


def test_a_controller_that_computes_with_another_arm_is_named_and_its_arm_written(
    rig: Rig, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """RTDE poses of a controller whose link 2 is 0.5 mm longer than in the rig file of the recording."""
    emulated = tmp_path / "emulated.toml"
    emulated.write_text(rig_text(RIG).replace("[emulation]\n", "[emulation]\ncontroller_link2_length_m = 5e-4\n"))
    with Emulation(emulated, seed=5, time_scale=8.0) as running:
        takes = Takes(brisk(rig), running, tmp_path / "recording.mcap")
        takes.run()
    assert run(["check", str(takes.path), "--controller-arm", str(tmp_path / "arm.toml")]) == 0
    shown = capsys.readouterr().out
    assert "warning: controller-arm: stream robot: the controller computes with another arm than the rig file" in shown
    assert re.search(r"link2\.length [-−]500\.0", shown)
    q_rad = takes.recording().streams["robot"].values["actual_q_rad"][::200]
    true = NominalArm.from_rig(tomllib.loads(emulated.read_text()))
    true_m = np.array([true.forward(row)[0][9:] for row in q_rad.tolist()])
    written, nominal = (
        RigArm.of_rig(load_rig(path)).frames(q_rad)[:, -1, :3, 3] for path in (tmp_path / "arm.toml", RIG)
    )
    assert np.abs(written - true_m).max() < 1e-7
    assert np.abs(nominal - true_m).max() > 4e-4


def test_a_full_disk_stops_the_arm_and_keeps_what_was_written(takes: Takes, full_after: Callable) -> None:
    with full_after(2_000_000), pytest.raises(PartialResult, match="disk"):
        takes.run()
    assert arm_speed_rad_s(takes.emulation) < 1e-3
    assert takes.recording().streams["psd"].host_s.size > 1000


@pytest.fixture
def full_after() -> Callable[[int], AbstractContextManager]:
    """A limit on the size of files of this process: what a full disk looks like to it."""
    import resource
    from contextlib import contextmanager

    @contextmanager
    def limited(size_bytes: int):
        assert threading.current_thread() is threading.main_thread()
        before = resource.getrlimit(resource.RLIMIT_FSIZE)
        ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size_bytes, before[1]))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
            signal.signal(signal.SIGXFSZ, ignored)

    return limited
