"""One short in-process session, recorded and identified once: what a report is made of."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.plan import PlanOptions
from acquisition.recording.read import read
from acquisition.recording.recording import Recording
from acquisition.recording.rig import load_rig, plain_rig, rig_text
from acquisition.recording.writer import RecordingWriter
from acquisition.session import Session
from calibeam.direct import direct_bench
from calibeam.identification import Identified, identify_recording
from calibeam.journal import RecordingJournal
from calibeam.learner import FittedLearner
from drivers.clock import SystemClock

RIG = Path(__file__).parents[3] / "rigs" / "ur5e-dual-psd.toml"


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    path, clock, rig = tmp_path_factory.mktemp("report") / "r.mcap", SystemClock(), load_rig(RIG)
    bench = direct_bench(rig, plain_rig(rig_text(RIG), "rig"), seed=12)
    hostile = rig_text(RIG).replace('name = "ur5e-dual-psd"', 'name = "<script>alert(1)</script>"')
    with RecordingWriter(path, rig_text=hostile, software="calibeam", clock=clock, notes={"seed": "12"}) as writer:
        options = PlanOptions(centred=2, off_centre=4, repeats=1)
        journal = RecordingJournal(writer, clock)
        Session(bench, FittedLearner(rig), journal, options, np.array(rig.motion.home_rad)).run((1, 2, 3))
    return read(path)


@pytest.fixture(scope="session")
def identified(recorded: Recording) -> Identified:
    return identify_recording(recorded)
