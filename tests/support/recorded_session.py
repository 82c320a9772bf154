"""A dual-PSD session of the emulated bench in this process, recorded once for all processes of a test run."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import Recording, RecordingWriter, read
from acquisition.recording.rig import load_rig, plain_rig, rig_text
from acquisition.session.plan import PlanOptions
from acquisition.session.session import Session
from calibeam.devices.recorder import RecordingJournal
from calibeam.learner import FittedLearner
from drivers.clock import SystemClock
from tests.support.direct_bench import direct_bench

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"


def recorded_session(folders: pytest.TempPathFactory) -> Recording:
    """Three placements with two centred samples, four beside them and one repeat each; its notes have the seed."""
    own = folders.getbasetemp()
    shared = (own.parent if own.name.startswith("popen-") else own) / "recorded-session.mcap"  # of pytest-xdist
    if not shared.exists():
        made = folders.mktemp("recorded") / "r.mcap"
        _record(made)
        made.replace(shared)  # whole at once: another process may ask for it meanwhile
    return read(shared)


def _record(path: Path) -> None:
    clock, rig = SystemClock(), load_rig(RIG)
    bench = direct_bench(rig, plain_rig(rig_text(RIG), "rig"), seed=12)
    with RecordingWriter(
        path, rig_text=rig_text(RIG), software="calibeam", clock=clock, notes={"seed": "12"}
    ) as writer:
        options = PlanOptions(centred=2, off_centre=4, repeats=1)
        journal = RecordingJournal(writer, clock)
        Session(bench, FittedLearner(rig), journal, options, np.array(rig.motion.home_rad)).run((1, 2, 3))
