"""A diagnosis with a rival, the poses that it asks for, a session of those poses, and the diagnosis with both.

The session is that of `calibeam session --plan` on the emulated world with a hidden mechanism, in this process; on
wires the same runs by `calibeam emulate` and `calibeam session RIG --plan next.toml --control HOST:PORT`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from acquisition.recording import Recording, RecordingWriter, Samples, read
from acquisition.recording.pose_plan import read_pose_plan
from acquisition.recording.rig import load_rig, plain_rig, rig_text
from acquisition.session.plan import PlanOptions
from acquisition.session.session import Session
from calibeam.devices.recorder import RecordingJournal
from calibeam.learner import FittedLearner
from calibeam.results.diagnosis import diagnose_recording, plan_next
from calibrate.diagnose.assess.diagnosis import Named
from calibrate.diagnose.new_poses.contests import rival_named
from calibrate.diagnose.search.bench import Bench
from calibrate.diagnose.search.line_search import refined
from calibrate.diagnose.state.fitted import Fitted, fit_geometry
from calibrate.diagnose.state.session import session_of
from simulators.conceal.case import conceal
from simulators.conceal.wanted import Wanted
from simulators.defects import Defect
from simulators.world.world import World
from tests.support.direct_bench import DirectBench

FIRST = PlanOptions(centred=1, off_centre=12, repeats=1)


@dataclass(frozen=True)
class Taken:
    """BIC by which the finding is better than its rival: with the first session, and with the planned poses, too."""

    finding: Named
    rival: Named
    planned: int
    before: float
    after: float


def taken(rig_file: Path, folder: Path, defect: Defect, seed: int) -> Taken | None:
    """None where the first session leaves no rival that more poses could tell apart."""
    world = _world(rig_file, defect, seed)
    first = _session(rig_file, folder / "first.mcap", world)
    found, _ = diagnose_recording(first)
    plan_next(found, folder / "next.toml")
    if found.physics is None or not (folder / "next.toml").exists():
        return None
    finding = next(f for f in found.physics.diagnosis.findings if f.rivals)
    names = finding.name, finding.rivals[0].name
    second = _planned(rig_file, folder / "second.mcap", world, folder / "next.toml")
    both = _together(first.samples, second.samples)
    return Taken(*names, len(second.samples), _margin(first, first.samples, names), _margin(first, both, names))


def _world(rig_file: Path, defect: Defect, seed: int) -> World:
    rig = load_rig(rig_file)
    plain = plain_rig(rig_text(rig_file), str(rig_file))
    return World.from_rig(plain, seed=seed, q_rad=rig.motion.home_rad, hidden=[defect])


@dataclass(frozen=True)
class _WorldClock:
    world: World

    def now_s(self) -> float:
        return self.world.time_s


def _session(rig_file: Path, path: Path, world: World) -> Recording:
    rig, clock = load_rig(rig_file), _WorldClock(world)
    with RecordingWriter(path, rig_text=rig_text(rig_file), software="benchmark", clock=clock) as writer:
        journal = RecordingJournal(writer, clock)
        session = Session(_bench(rig_file, world), FittedLearner(rig), journal, FIRST, np.array(rig.motion.home_rad))
        session.run(tuple(rig.placements)[:2])
    return read(path)


def _planned(rig_file: Path, path: Path, world: World, plan: Path) -> Recording:
    rig, clock = load_rig(rig_file), _WorldClock(world)
    with RecordingWriter(path, rig_text=rig_text(rig_file), software="benchmark", clock=clock) as writer:
        journal, home_rad = RecordingJournal(writer, clock), np.array(rig.motion.home_rad)
        session = Session(_bench(rig_file, world), FittedLearner(rig), journal, PlanOptions(), home_rad)
        session.take_planned(read_pose_plan(plan, rig))
    return read(path)


def _bench(rig_file: Path, world: World) -> DirectBench:
    rig = load_rig(rig_file)
    if rig.fixture is None:
        raise ValueError(f"rig {rig.name}: no [fixture]")
    return DirectBench(world, rig.fixture.half_size_m, rig.motion.speed_rad_s, rig.motion.acceleration_rad_s2)


def _together(first: Samples, second: Samples) -> Samples:
    """Rows of the plan behind; the fixture comes back to its places within nothing, as the emulated one does."""
    names = [name for name in first.columns if name in second]
    return Samples({n: np.concatenate([first.columns[n], second.columns[n]]) for n in names}, first.n_joints)


def _margin(recording: Recording, samples: Samples, names: tuple[Named, Named]) -> float:
    """Both refitted to all rows."""
    state = fit_geometry(session_of(recording.rig, samples))
    with_own = _with(state, names[0])
    rival = rival_named(with_own, 0, names[1])
    if rival is None:
        return float("inf")
    return Bench(state.refitted([rival])).bic - Bench(with_own).bic


def _with(state: Fitted, name: Named) -> Fitted:
    """The best term of a name in the model."""
    bench = Bench(state)
    gain, menu = bench.scores.gain, bench.menu
    mine = [
        e
        for e, entry in enumerate(menu.entries)
        if (menu.terms[entry.term].physics, menu.terms[entry.term].port.where) == (name.physics, name.where)
    ]
    best = menu.entries[max(mine, key=lambda e: float(gain[e]))]
    return state.refitted([refined(bench, menu.terms[best.term], best.inner)])


def drawn(kind: str, seed: int, enr: float) -> Defect:
    """A mechanism as the concealed bench draws it, for an arm of six joints."""
    return conceal(Wanted("dual-psd", seed, defects=(kind,), enr=enr, samples=80, arm="ur5")).hidden[0].defect


def lines(rig_file: Path, folder: Path, seeds: range) -> Iterator[str]:
    """One row a seed."""
    for seed in seeds:
        where = folder / str(seed)
        where.mkdir(parents=True)
        found = taken(rig_file, where, drawn("encoder-eccentricity", seed, 1.0), seed)
        if found is None:
            yield f"seed {seed}: no rival to be told apart"
        else:
            names = f"{found.finding.physics} at {found.finding.where} or {found.rival.physics} at {found.rival.where}"
            yield f"seed {seed}: {names}: {found.before:.1f} BIC apart; with {found.planned} poses {found.after:.1f}"
