"""A hidden column: what was found to change with time, against the column that was kept back."""

from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import Samples
from benchmarks.hidden_columns import against_hidden, real_sets
from calibrate.diagnose.record.schema import CurveRecord, DiagnosisFile, FindingRecord
from calibrate.errors import DataError

T_S = np.arange(0.0, 3600.0, 30.0)
ROOM_DEGC = 21.0 + 2.0 * np.sin(T_S / 700.0)


def _samples() -> Samples:
    return Samples({"t_s": T_S, "q1_rad": np.zeros_like(T_S), "temp_room_degC": ROOM_DEGC}, 1)


def _file(depends_on: str, course: np.ndarray) -> DiagnosisFile:
    curve = CurveRecord("t", "m", tuple(T_S.tolist()), tuple(course.tolist()), tuple(course.tolist()))
    finding = FindingRecord(
        "link2.length", depends_on, "smooth", None, "unknown", {}, 1.0, 0.9, "", (), 1e-3, 20.0, 20.0, curve=curve
    )
    return DiagnosisFile(1, "mismatch", 1e-5, 2e-5, 1e-5, (finding,), None, ())


def test_a_course_that_follows_the_hidden_column_agrees() -> None:
    [found] = against_hidden(_file("t", 1e-5 * (ROOM_DEGC - 21.0)), _samples(), "temp_room_degC")
    assert found.correlation == pytest.approx(1.0, abs=1e-9)


def test_a_course_of_its_own_does_not() -> None:
    other = np.cos(T_S / 700.0 * 5.0)
    [found] = against_hidden(_file("t", other), _samples(), "temp_room_degC")
    assert abs(found.correlation) < 0.3


def test_what_depends_on_poses_says_nothing_of_it() -> None:
    assert against_hidden(_file("q2", ROOM_DEGC), _samples(), "temp_room_degC") == ()


def test_a_folder_without_sessions_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no session folder"):
        real_sets(tmp_path)
