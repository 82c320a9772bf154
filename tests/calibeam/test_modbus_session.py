"""A session with an IRB 120 class arm behind a PLC, over Modbus; with plain encoders on CAN, too."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from rich.console import Console

from acquisition.recording import RecordingWriter, read
from acquisition.recording.rig import load_rig, rig_text
from acquisition.session.plan import PlanOptions
from calibeam.devices.recorder import record_session
from calibeam.devices.site import addresses_of, check_session, connected
from calibeam.emulation import Emulation
from calibeam.printing.progress import progress_bar
from drivers.clock import SystemClock
from drivers.errors import DeviceRefused

RIG = Path(__file__).parents[2] / "rigs" / "irb120-modbus.toml"
SMALL = PlanOptions(centred=1, off_centre=1, repeats=1)
TAKEN = 2 * (1 + 1 + 2)  # two orders; the repeat is taken from either side


PLAIN_ENCODERS = f"""
[devices.encoders]
driver = "can-dbc"
interface = "slcan"
channel = "out/emulated/can"
bitrate = 1000000
sync_hz = 100.0
dbc = "{RIG.parent / "encoders-plain.dbc"}"
signals = [{", ".join(f'"ENCODER{number}.Angle"' for number in range(1, 7))}]
"""


@pytest.fixture
def encoder_rig(tmp_path) -> Path:
    """The shipped rig with six encoders that send by themselves, described by the shipped DBC file."""
    path = tmp_path / "rig.toml"
    path.write_text(RIG.read_text() + PLAIN_ENCODERS)
    return path


@pytest.fixture
def run_session(tmp_path):
    """A session at one place, four times real time."""

    def run(rig_file: Path = RIG):
        rig = load_rig(rig_file)
        check_session(rig)
        rig = msgspec.structs.replace(rig, placement_list=rig.placement_list[:1])
        path, clock = tmp_path / "recording.mcap", SystemClock()
        with (
            Emulation(rig_file, seed=5, time_scale=4.0) as emulation,
            RecordingWriter(path, rig_text=rig_text(rig_file), software="test", clock=clock) as writer,
            connected(rig, addresses_of(rig, emulation.address, 4.0), writer, clock, emulation.place_fixture) as bench,
        ):
            record_session(bench, rig, writer, SMALL, clock, progress_bar(Console(quiet=True)))
        return read(path)

    return run


def test_move_look_and_stop_on_the_bench(tmp_path) -> None:
    """What a session does again and again, without its search and its fits."""
    rig, clock = load_rig(RIG), SystemClock()
    with (
        Emulation(RIG, seed=5, time_scale=2.0) as emulation,
        RecordingWriter(tmp_path / "r.mcap", rig_text=rig_text(RIG), software="test", clock=clock) as writer,
        connected(rig, addresses_of(rig, emulation.address, 2.0), writer, clock, emulation.place_fixture) as bench,
    ):
        home_rad = np.array(rig.motion.home_rad)
        bench.move(home_rad + 0.1)
        look = bench.look(0.1)
        assert look.q_rad == pytest.approx(home_rad + 0.1, abs=1e-4)
        assert look.temperatures_degC["joint1"] > 10.0
        emulation.ask("robot.protective_stop")
        with pytest.raises(DeviceRefused, match="protective stop: clear the cause and unlock it at the controller"):
            bench.move(home_rad)
        bench.stop()
        assert emulation.ask("robot.standing")
    recording = read(tmp_path / "r.mcap")
    assert set(recording.streams) == {"psd", "spots", "robot"}
    assert np.all(np.diff(recording.streams["robot"].sequence) >= 1)


def test_plain_encoders_are_looked_at_with_the_spots(encoder_rig, tmp_path) -> None:
    rig, clock = load_rig(encoder_rig), SystemClock()
    with (
        Emulation(encoder_rig, seed=5, time_scale=2.0) as emulation,
        RecordingWriter(tmp_path / "r.mcap", rig_text=rig_text(encoder_rig), software="test", clock=clock) as writer,
        connected(rig, addresses_of(rig, emulation.address, 2.0), writer, clock, emulation.place_fixture) as bench,
    ):
        seen_rad: list[np.ndarray] = []
        for offset_rad in (0.0, 0.1):
            bench.move(np.array(rig.motion.home_rad) + offset_rad)
            look = bench.look(0.1)
            assert look.encoder_rad is not None
            seen_rad.append(look.encoder_rad)
    assert seen_rad[1] - seen_rad[0] == pytest.approx(np.full(6, 0.1), abs=1e-3)  # their zeros are anywhere
    encoders = read(tmp_path / "r.mcap").streams["encoders"]
    assert np.nanmax(encoders.values["age_s"]) < 0.1


@pytest.mark.endure
@pytest.mark.timeout(900)
def test_a_whole_session_with_plain_encoders(run_session, encoder_rig) -> None:
    recording = run_session(encoder_rig)
    assert recording.complete
    assert len(recording.samples) == TAKEN
    assert set(recording.streams) == {"psd", "spots", "robot", "encoders"}
    seen_rad = np.column_stack([recording.samples.column(f"enc{joint}_rad") for joint in range(1, 7)])
    assert np.isfinite(seen_rad).all()
    assert np.ptp(seen_rad - recording.samples.joints(), axis=0).max() < 1e-3  # their zeros are anywhere


@pytest.mark.endure
@pytest.mark.timeout(900)
def test_a_whole_session(run_session) -> None:
    recording = run_session()
    assert recording.complete
    assert len(recording.samples) == TAKEN
    assert set(recording.streams) == {"psd", "spots", "robot"}
    joints = recording.samples.joints()
    assert np.ptp(joints, axis=0).max() > 0.2  # it went places
    robot = recording.streams["robot"]
    assert np.all(np.diff(robot.sequence) >= 1)
