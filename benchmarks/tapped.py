"""A whole session on the emulated world with every device's stream recorded, without wires: the same on any machine.

The session, its settling rule and the recorder are those of a site; devices read a disturbed world at their own rates,
by clocks of their own, and what they sent may be lost. Real wires: benchmarks/wired_streams.py, on a quiet machine.
"""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.bench import Look
from acquisition.recording import Channel, Recording, RecordingWriter, read
from acquisition.recording.rig import load_rig, plain_rig, rig_text
from acquisition.session.plan import PlanOptions
from acquisition.session.session import Session
from benchmarks.disturbed import DisturbedWorld, Trouble
from calibeam.devices.recorder import RecordingJournal
from calibeam.learner import FittedLearner
from tests.support.direct_bench import DirectBench

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

HOST_S, ROBOT_S, PSD_S = 1000.0, 20.0, 40.0  # what the clocks say when the world begins
LINE_S, SYNC_S = 2e-4, 3e-5  # that a line delays, at least and usually; by which a SYNC is stamped early or late
COUNT_RAD = 2.0 * math.pi / (1 << 20)
EVERY = 5  # ticks of 2 ms from SYNC to SYNC
SHORT = PlanOptions(centred=1, off_centre=7, repeats=1)


@dataclass(frozen=True)
class Clocks:
    """The PSD box's clock, and what is lost of its stream."""

    drift: float = 0.0
    step_s: float = 0.0
    step_at_s: float = math.inf  # of the world
    lost_at_s: float = math.inf
    lost_samples: int = 0
    doubled_at_s: float = math.inf

    def tells(self, t_s: Floats) -> Floats:
        """Stamps of the box."""
        return PSD_S + (1.0 + self.drift) * t_s + self.step_s * (t_s > self.step_at_s)


@dataclass
class Tape:
    """What devices sent: true time and values, in their order."""

    time_s: list[Floats] = field(default_factory=list)
    values: list[Floats] = field(default_factory=list)

    def take(self, time_s: Floats, values: Floats) -> None:
        self.time_s.append(time_s)
        self.values.append(values)

    def whole(self) -> tuple[Floats, Floats]:
        return np.concatenate(self.time_s), np.concatenate(self.values)


class TappedWorld(DisturbedWorld):
    """Every tick of 2 ms is read by controller and PSD box, every fifth by the encoders."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(*arguments, **named)
        self.robot, self.encoders, self.psd = Tape(), Tape(), Tape()
        self._ticks, self._goal_rad = 0, self.joints().q_rad
        self._seen: tuple[Floats, Floats] = (np.empty(0), np.empty((0, 8)))

    def command(self, q_rad: Any) -> None:
        super().command(q_rad)
        self._goal_rad = np.asarray(q_rad, dtype=float)

    def advance(self, until_s: float) -> None:
        before_s = self.time_s
        super().advance(until_s)
        now = np.array([self.time_s])
        self.robot.take(now, np.stack([self._goal_rad, self.joints().q_rad])[None])
        if self._ticks % EVERY == 0:
            self.encoders.take(now, np.round(self.link_encoders_rad() / COUNT_RAD)[None] * COUNT_RAD)
        self._ticks += 1
        t = np.linspace(before_s, self.time_s, max(1, round(1e3 * (self.time_s - before_s))) + 1)[1:]
        self._seen = t, super().photocurrents_a(t)
        self.psd.take(*self._seen)

    def photocurrents_a(self, times_s: Any) -> Floats:
        """What the box has read already."""
        t, currents = self._seen
        return currents[np.searchsorted(t, np.asarray(times_s, dtype=float) - 1e-6)]


@dataclass
class TappedBench(DirectBench):
    """Tells when it averaged, by the box's clock."""

    clocks: Clocks = field(default_factory=Clocks)

    def look(self, dwell_s: float) -> Look:
        seen = super().look(dwell_s)
        half_s = max(dwell_s, self.rule.window_s) / 2.0
        from_s, to_s = self.clocks.tells(np.array([seen.t_s - half_s, seen.t_s + half_s])).tolist()
        return replace(seen, window_s=(from_s, to_s))


def recorded(rig_file: Path, path: Path, trouble: Trouble, clocks: Clocks, seed: int = 1) -> Recording:
    """One place, both orders; some sixteen samples, half a minute of the world."""
    rig, plain = load_rig(rig_file), plain_rig(rig_text(rig_file), str(rig_file))
    TappedWorld.trouble = trouble
    world = TappedWorld.from_rig(plain, seed=seed, q_rad=rig.motion.home_rad)
    assert rig.fixture is not None
    assert rig.motion.home_rad is not None
    motion = rig.motion
    bench = TappedBench(world, rig.fixture.half_size_m, motion.speed_rad_s, motion.acceleration_rad_s2, clocks=clocks)
    clock = _WorldClock(world)
    with RecordingWriter(path, rig_text=rig_text(rig_file), software="benchmark", clock=clock) as writer:
        journal, home_rad = RecordingJournal(writer, clock), np.array(rig.motion.home_rad)
        Session(bench, FittedLearner(rig), journal, SHORT, home_rad).run((next(iter(rig.placements)),))
        _written(writer, world, clocks, np.random.default_rng([seed, 7]))
    return read(path)


@dataclass(frozen=True)
class _WorldClock:
    """The host's."""

    world: TappedWorld

    def now_s(self) -> float:
        return HOST_S + self.world.time_s


def _written(writer: RecordingWriter, world: TappedWorld, clocks: Clocks, rng: np.random.Generator) -> None:
    def arrived(t_s: Floats) -> Floats:
        return np.maximum.accumulate(HOST_S + t_s + LINE_S + rng.exponential(LINE_S, len(t_s)))

    t, values = world.robot.whole()
    channels = tuple(Channel(name, "rad", (6,)) for name in ("target_q_rad", "actual_q_rad"))
    robot = {"target_q_rad": values[:, 0], "actual_q_rad": values[:, 1]}
    writer.stream("robot", channels).append(arrived(t), ROBOT_S + t, np.arange(len(t)), robot)
    t, values = world.encoders.whole()
    sent_s = HOST_S + t + rng.normal(0.0, SYNC_S, len(t))  # no clock of their own: the host's, when SYNC was sent
    stream = writer.stream("encoders", (Channel("position_rad", "rad", (6,)),))
    stream.append(np.maximum.accumulate(sent_s + 1e-3), sent_s, np.arange(len(t)), {"position_rad": values})
    t, values = world.psd.whole()
    kept = _kept(t, clocks)
    stream = writer.stream("psd", (Channel("photocurrent_a", "A", (8,)),))
    stream.append(arrived(t)[kept], clocks.tells(t)[kept], kept, {"photocurrent_a": values[kept]})


def _kept(t_s: Floats, clocks: Clocks) -> Ints:
    """Rows that arrive, in order: some never, one twice."""
    rows = np.arange(len(t_s))
    lost = (rows >= np.searchsorted(t_s, clocks.lost_at_s)) & (
        rows < np.searchsorted(t_s, clocks.lost_at_s) + clocks.lost_samples
    )
    again = np.flatnonzero(t_s > clocks.doubled_at_s)[:1]
    return np.sort(np.concatenate([rows[~lost], again]), kind="stable")
