"""What a person reads after a dual-PSD session: zeros first, all other parameters, the verdict last."""

from dataclasses import replace
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from acquisition.recording import Samples
from calibeam.printing.identification import print_identification
from calibeam.results.identification import Planned, identify_session, session_model
from calibrate.errors import DataError
from calibrate.fit.fit_plan import parse_plan
from calibrate.fit.identify.point_constraint import point_constraints
from calibrate.report.evidence.session_evidence import session_evidence
from calibrate.report.evidence.session_verdict import session_verdict
from tests.support.recorded_session import recorded_session

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return recorded_session(tmp_path_factory)


def printed(recording, plan=None):
    text = StringIO()
    planned = None if plan is None else Planned(parse_plan(plan, "fit.toml"), plan)
    result = identify_session(recording, planned)
    known = session_evidence(recording, session_model(result, recording, planned))
    print_identification(Console(file=text, width=400), result, known, verbose=True)
    return text.getvalue(), session_verdict(known)


def test_the_first_lines_are_the_report_s_verdict_and_no_name_of_a_status_is_printed(recording):
    lines, judged = printed(recording)
    first = [line.strip() for line in lines.splitlines()][: 3 + len(judged.reasons)]
    assert first[:-1] == [judged.sentence, f"trust: {judged.trust.value}", *judged.reasons]
    assert first[-1].startswith("tool error over the workspace: ")
    assert "RANK_DEFICIENT" not in lines


def test_zeros_stand_in_degrees_before_all_other_parameters_and_only_once(recording):
    lines, _ = printed(recording)
    assert lines.index("zero (deg)") < lines.index("link2.length")
    assert "J1 not determined: only in combination" in lines
    assert "joint2.zero" not in lines
    assert "point constraint" not in lines


def test_the_point_constraint_comes_after_the_zeros_of_the_fit_where_a_plan_names_it(recording):
    lines, _ = printed(recording, 'schema = 1\nmethod = "point-constraint"\nshare = 0\n')
    assert lines.index("link2.length") < lines.index("for comparison: point constraint") < lines.index("four poses at")


def test_a_plan_that_names_the_point_constraint_without_centred_poses_is_refused(recording):
    off = recording.samples.columns | {"psd1_x_m": recording.samples.column("psd1_x_m") + 2e-4}
    moved = replace(recording, samples=Samples(off, 6))
    with pytest.raises(DataError, match='method = "point-constraint" needs two different poses of each beam order'):
        point_constraints(moved.rig, moved.samples)
