"""What a person reads after a dual-PSD session: the full model, the source's method beside it, the verdict last."""

from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from acquisition.plan import PlanOptions
from acquisition.recording.read import read
from acquisition.recording.rig import load_rig, plain_rig, rig_text
from acquisition.recording.writer import RecordingWriter
from acquisition.session import Session
from calibeam.direct import direct_bench
from calibeam.identification import identify_recording
from calibeam.journal import RecordingJournal
from calibeam.learner import FittedLearner
from calibeam.terminal import print_identified
from calibrate.report.evidence import evidence
from calibrate.report.verdict import verdict
from drivers.clock import SystemClock

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"


@pytest.fixture(scope="module")
def identified(tmp_path_factory):
    path, clock, rig = tmp_path_factory.mktemp("terminal") / "r.mcap", SystemClock(), load_rig(RIG)
    bench = direct_bench(rig, plain_rig(rig_text(RIG), "rig"), seed=12)
    with RecordingWriter(path, rig_text=rig_text(RIG), software="calibeam", clock=clock) as writer:
        options = PlanOptions(centred=2, off_centre=4, repeats=1)
        journal = RecordingJournal(writer, clock)
        Session(bench, FittedLearner(rig), journal, options, np.array(rig.motion.home_rad)).run((1, 2, 3))
    return identify_recording(read(path))


def test_the_last_word_is_the_report_s_verdict_and_no_alarming_status(identified):
    text = StringIO()
    print_identified(Console(file=text, width=400), identified)
    told = text.getvalue()
    judged = verdict(evidence(identified.used, identified.zeros, "reported"))
    last = [line.strip() for line in told.splitlines() if line.strip()][-1 - len(judged.reasons) :]
    assert last == [judged.sentence, *judged.reasons]
    assert "RANK_DEFICIENT" not in told


def test_the_source_s_method_comes_after_the_full_model_and_is_labelled(identified):
    text = StringIO()
    print_identified(Console(file=text, width=400), identified)
    told = text.getvalue()
    assert told.index("full dual-PSD model") < told.index("for comparison (source method)")
