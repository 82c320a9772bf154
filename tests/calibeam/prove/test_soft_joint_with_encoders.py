"""A soft joint in the moving world, whose links carry second encoders with arbitrary zeros: one finding, and sharp."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import RecordingWriter, read
from acquisition.recording.rig import load_rig, rig_text
from acquisition.session.plan import PlanOptions
from acquisition.session.session import Session
from calibeam.devices.recorder import RecordingJournal
from calibeam.learner import FittedLearner
from calibrate.diagnose.from_recording import diagnose_samples
from drivers.clock import SystemClock
from simulators.defects.drive import SoftJoint
from simulators.world.world import World
from tests.support.direct_bench import DirectBench

RIG = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"
COMPLIANCE_RAD_NM = 8e-6


@pytest.mark.endure  # daily: a soft joint on the fast path, and test_moving_world.py, in which both paths see the same
@pytest.mark.timeout(300)
def test_a_joint_soft_by_8_urad_per_nm_is_found_to_a_tenth(tmp_path: Path) -> None:
    rig, clock = load_rig(RIG), SystemClock()
    assert rig.fixture is not None
    hidden = [SoftJoint(2, COMPLIANCE_RAD_NM)]
    world = World.from_rig(tomllib.loads(RIG.read_text()), seed=31, q_rad=rig.motion.home_rad, hidden=hidden)
    with RecordingWriter(tmp_path / "r.mcap", rig_text=rig_text(RIG), software="test", clock=clock) as writer:
        bench = DirectBench(world, rig.fixture.half_size_m)
        plan, home_rad = PlanOptions(centred=1, off_centre=5, repeats=1), np.array(rig.motion.home_rad)
        Session(bench, FittedLearner(rig), RecordingJournal(writer, clock), plan, home_rad).run((1, 2, 3))
    recording = read(tmp_path / "r.mcap")
    found = diagnose_samples(recording.rig, recording.samples, np.random.default_rng(1))
    assert found.physics is not None
    (finding,) = found.physics.diagnosis.findings
    assert (finding.name.where, finding.name.physics) == ("joint2.angle", "joint-compliance")
    size = finding.parameters["compliance_rad_nm"]
    assert size.sigma <= 0.1e-6
    assert abs(size.value - COMPLIANCE_RAD_NM) <= 3.0 * size.sigma
