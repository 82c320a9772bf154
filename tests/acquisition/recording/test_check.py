"""The check of a recording tells every problem it has, and nothing when all is well."""

from collections.abc import Callable

import numpy as np
import pytest

from acquisition.recording.check_recording import Problem, check
from acquisition.recording.mcap.read import read
from acquisition.recording.mcap.writer import RecordingWriter
from acquisition.recording.recording import Channel

Open = Callable[..., RecordingWriter]
SPOT = Channel("spot_x_m", "m")


def record(
    open_writer: Open, device_s: list[float], sequence: list[int], t_s: list[float], complete: bool = True
) -> set:
    writer = open_writer()
    if device_s:
        host_s = 1000.0 + np.arange(len(device_s))
        writer.stream("psd", (SPOT,)).append(host_s, device_s, sequence, {"spot_x_m": np.zeros(len(device_s))})
    else:
        writer.stream("psd", (SPOT,))
    for time_s in t_s:
        writer.sample({"t_s": time_s, "q1_rad": 0.0, "q2_rad": 0.0})
    writer.close(complete=complete)
    return {(finding.problem, finding.where) for finding in check(read(writer.path))}


@pytest.mark.parametrize(
    ("device_s", "sequence", "t_s", "found"),
    [
        ([0.0, 1.0, 2.0], [0, 1, 2], [0.0, 1.0], set()),
        ([0.0, 1.0, 2.0], [0, 1, 3], [0.0], {(Problem.GAP, "stream psd")}),
        ([0.0, 2.0, 1.0], [0, 1, 2], [0.0], {(Problem.TIME_ORDER, "stream psd")}),
        ([0.0, 1.0, 1.0], [0, 1, 2], [0.0], {(Problem.DUPLICATE_TIME, "stream psd")}),
        ([], [], [0.0], {(Problem.SILENT, "stream psd")}),
        ([0.0], [0], [1.0, 0.5], {(Problem.TIME_ORDER, "samples")}),
        ([0.0], [0], [1.0, 1.0], {(Problem.DUPLICATE_TIME, "samples")}),
        ([0.0], [0], [], {(Problem.NO_SAMPLES, "samples")}),
    ],
)
def test_each_problem_is_found_where_it_is(
    open_writer: Open, device_s: list[float], sequence: list[int], t_s: list[float], found: set
) -> None:
    assert record(open_writer, device_s, sequence, t_s) == found


def test_a_session_cut_short_is_reported(open_writer: Open) -> None:
    assert record(open_writer, [0.0], [0], [0.0], complete=False) == {(Problem.INCOMPLETE, "file")}


def test_a_torn_file_is_reported_as_damaged_and_incomplete(open_writer: Open) -> None:
    with open_writer() as writer:
        writer.sample({"t_s": 0.0, "q1_rad": 0.0, "q2_rad": 0.0})
    writer.path.write_bytes(writer.path.read_bytes()[:-20])
    assert {finding.problem for finding in check(read(writer.path))} == {Problem.DAMAGED, Problem.INCOMPLETE}
