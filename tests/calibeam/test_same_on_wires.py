"""A whole session over wires: what the recording holds, and that at any pace the wires show what the world shows."""

import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from acquisition.recording import Recording, RecordingWriter, read
from acquisition.recording.rig import load_rig, rig_text
from acquisition.session.plan import PlanOptions
from acquisition.session.records import Sample
from acquisition.session.session import Session
from calibeam.devices.recorder import RecordingJournal, record_session
from calibeam.devices.site import addresses_of, connected
from calibeam.emulation import Emulation
from calibeam.learner import FittedLearner
from calibeam.printing.progress import progress_bar
from drivers.clock import SystemClock
from simulators.world.world import World
from tests.support.direct_bench import direct_bench

from .conftest import brisk

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
SEED = 9
TINY = PlanOptions(centred=1, off_centre=2, repeats=1)


def on_wires(time_scale: float, folder: Path) -> Sequence[Sample]:
    rig, clock = load_rig(RIG), SystemClock()
    with (
        Emulation(RIG, seed=SEED, time_scale=time_scale) as emulation,
        RecordingWriter(folder / "r.mcap", rig_text=rig_text(RIG), software="test", clock=clock) as writer,
        connected(
            rig, addresses_of(rig, emulation.address, time_scale), writer, clock, emulation.place_fixture
        ) as bench,
    ):
        return record_session(bench, brisk(rig), writer, TINY, clock, progress_bar(Console(quiet=True))).samples


def in_process(folder: Path) -> Sequence[Sample]:
    rig, clock = load_rig(RIG), SystemClock()
    bench = direct_bench(rig, tomllib.loads(RIG.read_text()), seed=SEED)
    with RecordingWriter(folder / "r.mcap", rig_text=rig_text(RIG), software="test", clock=clock) as writer:
        journal = RecordingJournal(writer, clock)
        return Session(bench, FittedLearner(rig), journal, TINY, np.array(rig.motion.home_rad)).run((1,)).samples


def off_the_world_m(samples: Sequence[Sample]) -> np.ndarray:
    """Measured spots less those of the same world standing exactly at the reported joints, (sample, 4)."""
    plain = tomllib.loads(RIG.read_text())
    plain["emulation"]["joint_repeatability_rad"] = 0.0  # drawn from a stream of its own: the rest stays as it was
    rows = []
    for sample in samples:
        world = World.from_rig(plain, seed=SEED, q_rad=sample.look.q_rad)
        world.place_fixture(sample.placement)
        spots = world.spots()
        rows.append(sample.look.spots_m() - np.array([spots.psd1.x_m, spots.psd1.y_m, spots.psd2.x_m, spots.psd2.y_m]))
    return np.array(rows)


def all_is_recorded(recording: Recording) -> None:
    assert recording.complete
    assert len(recording.samples) == 10
    assert set(recording.streams) == {"psd", "spots", "robot", "encoders"}
    assert recording.streams["psd"].gaps == ()
    assert recording.streams["robot"].gaps == ()
    q_rad, link_rad = recording.samples.joints(), recording.samples.encoders()
    # Link-side encoders stand off by a constant each: zero, mounting and repeatability; they count 6 urad.
    assert np.max(np.abs((link_rad - q_rad) - np.median(link_rad - q_rad, axis=0))) < 3e-5
    assert {"placement", "centring", "end"} <= {event.kind for event in recording.events}


@pytest.mark.parametrize("path", ["in process", pytest.param("wires at 3 x", marks=pytest.mark.endure), "wires at 8 x"])
def test_a_whole_session_is_recorded_and_its_spots_are_those_of_the_world(path: str, tmp_path: Path) -> None:
    samples = in_process(tmp_path) if path == "in process" else on_wires(float(path.split()[2]), tmp_path)
    assert len(samples) == 10
    if path != "in process":
        all_is_recorded(read(tmp_path / "r.mcap"))
    off_m = off_the_world_m(samples)
    # 3 urad of every joint is 1 to 2 um at the faces; the average of 200 readings adds 0.14 um.
    assert 0.5e-6 < np.sqrt(np.mean(off_m**2)) < 4e-6
    assert np.max(np.abs(off_m)) < 12e-6


@pytest.fixture
def eight_busy_loops() -> Iterator[None]:
    loops = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(8)]
    yield
    for loop in loops:
        loop.kill()
        loop.wait()


@pytest.mark.endure  # minutes: the session has a fraction of the machine
@pytest.mark.usefixtures("eight_busy_loops")
def test_a_session_next_to_eight_busy_loops_is_completed(tmp_path: Path) -> None:
    assert len(on_wires(1.0, tmp_path)) == 10
