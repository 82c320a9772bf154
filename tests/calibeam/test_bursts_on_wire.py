"""A tracker that sends in bursts over a real wire: recorded, named by `check`, restored by `import --restore-stamps`.

One clock, which only the test advances, is that of the emulator and of the driver, so that every stamp is determined.
"""

import threading
from pathlib import Path

import msgspec
import numpy as np

from acquisition.recording import Channel, RecordingWriter, read
from acquisition.recording.rig import load_rig, rig_text
from calibeam.cli import run
from calibeam.devices.instruments import tracker_driver
from drivers.device import stamps_of
from simulators.faults.injector import with_faults
from simulators.host.loop import Host
from simulators.tracker.emulator import build
from simulators.wire import TICK_S
from tests.drivers.tracker.test_device import ASCII, StandingWorld

RIG_FILE = Path(__file__).parents[2] / "rigs" / "ur5e-tracker.toml"
PAUSE_S, BURSTS, PERIOD_S = 0.3, 100, 0.01
COLUMNS = {"columns": ("x", "y", "z", "status"), "port": 0}  # no time: its stamps are those of arrival


class SteppedClock:
    time_s = 1000.0

    def now_s(self) -> float:
        return self.time_s

    def sleep_s(self, seconds: float) -> None:
        raise AssertionError("a stream is never waited for")


def record_bursts(path: Path) -> None:
    """BURSTS bursts of 30 lines each; every one is read at the moment when it was sent."""
    clock, world = SteppedClock(), StandingWorld()
    bench = build(world, {"devices": {"tracker": {**ASCII, **COLUMNS}}, "emulation": {"position_noise_m": 15e-6}})
    faulty, injector = with_faults("tracker", bench)
    injector.inject("bursts", None, 1, None, {"seconds": PAUSE_S})
    host = Host(faulty, world, now_s=clock.now_s)
    address = dict(zip(("host", "port"), host.tcp_address("tracker"), strict=True))
    device = msgspec.structs.replace(load_rig(RIG_FILE).devices.tracker, columns=COLUMNS["columns"], **address)
    tracker = tracker_driver(device, clock)
    connecting = threading.Thread(target=tracker.connect)
    try:
        connecting.start()
        while not bench.instruments[0].wires:
            host.turn(0.01)
        with RecordingWriter(path, rig_text=rig_text(RIG_FILE), software="test", clock=clock) as writer:
            stream = None
            for burst in range(1, BURSTS + 1):
                for _ in range(round(PAUSE_S / TICK_S)):
                    clock.time_s += TICK_S
                    host.turn(0.0)
                connecting.join()
                channels = tuple(Channel(c.name, c.unit, c.shape, c.full_scale) for c in tracker.describe())
                stream = stream or writer.stream("tracker", channels, stamps=stamps_of(tracker))
                last = -1
                while last < 30 * burst - 2:  # the first lines may have been measured before the client was there
                    block = tracker.read(1.0)
                    last = int(block.sequence[-1])
                    stream.append(block.host_s, block.device_s, block.sequence, block.values)
    finally:
        tracker.close()
        host.close()


def test_bursts_of_a_tracker_are_named_and_its_times_restored(tmp_path, capsys) -> None:
    path, made = tmp_path / "bursts.mcap", tmp_path / "restored.mcap"
    record_bursts(path)
    run(["check", str(path)])  # a recording without settled samples
    shown = capsys.readouterr().out
    assert "time stamp: arrived" in shown
    assert "bursts: stream tracker: samples arrive in batches of 30" in shown
    assert "no constant delay repairs this" in shown
    assert run(["import", str(path), "--restore-stamps", "--out", str(made)]) == 0
    tracker = read(made).streams["tracker"]
    assert tracker.stamps == "restored"
    assert np.ptp(tracker.device_s - PERIOD_S * tracker.sequence) < 0.5 * PERIOD_S
    assert np.array_equal(tracker.values["position_m"], read(path).streams["tracker"].values["position_m"])
