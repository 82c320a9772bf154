"""DBC files whose messages are laid out wrongly are read, and name the message at fault."""

import logging
import math
from pathlib import Path

import pytest

from drivers.can_dbc.description import joint_signals
from drivers.cia406.codec import ContinuousAngle

GOOD = 'BO_ 5 AXIS: 8 one\n SG_ Angle : 0|16@1+ (0.1,0) [0|0] "deg" one\n\n'
HEAD = 'VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: one\n\n'


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ('BO_ 6 OVER: 8 one\n SG_ A : 0|32@1+ (1,0) [0|0] "" one\n SG_ B : 8|32@1+ (1,0) [0|0] "" one\n', "OVER"),
        ('BO_ 6 SHORT: 2 one\n SG_ A : 0|32@1+ (1,0) [0|0] "" one\n', "SHORT"),
    ],
)
def test_a_message_at_fault_is_named_and_the_others_are_read(
    bad: str, message: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "two.dbc"
    path.write_text(HEAD + GOOD + bad)
    with caplog.at_level(logging.WARNING):
        (joint,) = joint_signals(path, ["AXIS.Angle"], None)
    counts = joint.counts(bytes([100, 0, 0, 0, 0, 0, 0, 0]))
    assert isinstance(counts, int)
    assert ContinuousAngle(joint.scale).follow(counts, 0.0) == pytest.approx(math.radians(10.0))
    (line,) = (record.getMessage() for record in caplog.records)
    assert str(path) in line
    assert f"in message {message}" in line
    assert "correct the DBC file" in line


def test_a_file_without_a_fault_logs_nothing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = tmp_path / "one.dbc"
    path.write_text(HEAD + GOOD)
    with caplog.at_level(logging.WARNING):
        joint_signals(path, ["AXIS.Angle"], None)
    assert caplog.records == []
