"""Every examination of `check` of a recording itself, by each of its endings."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from acquisition.recording import Channel, RecordingWriter, check, read
from acquisition.recording.recording_examinations import (
    READINGS,
    RECORDING_EXAMINATIONS,
    reading_examinations,
    recording_examinations,
)
from acquisition.recording.rig import rig_text

RIGS = Path(__file__).parents[3] / "rigs"
ENCODERS, TRACKER = RIGS / "encoders.toml", RIGS / "ur5e-tracker.toml"
NOISE_S, ROWS, RATE_HZ = 1e-4, 600, 100.0
SAMPLES, STREAMS, STAMPS, OF_READINGS = (one.what for one, _ in RECORDING_EXAMINATIONS)


class Standing:
    def now_s(self) -> float:
        return 1000.0


@pytest.fixture
def log(tmp_path):
    """A log of encoders that turn, as it is written and read: `change` alters times, numbers and angles."""

    def made(change=lambda time_s, number, angle: (time_s, number, angle), rows=ROWS, rig=ENCODERS, samples=()):
        rng, number = np.random.default_rng(1), np.arange(rows)
        time_s = 1000.0 + number / RATE_HZ + rng.normal(0.0, NOISE_S, rows)
        channels = 3 if rig == ENCODERS else 6
        angle = np.sin(time_s)[:, None] + np.arange(channels) + rng.normal(0.0, 1e-5, (rows, channels))
        host_s, number, angle = change(time_s, number, angle)
        notes = {"segment": "1"} if rig == ENCODERS else {}
        path = tmp_path / f"log-{len(list(tmp_path.iterdir()))}.mcap"
        with RecordingWriter(path, rig_text=rig_text(rig), software="t", clock=Standing(), notes=notes) as writer:
            for row in samples:
                writer.sample(row)
            stream = writer.stream("encoders", (Channel("position_rad", "rad", (channels,)),))
            if rows:
                stream.append(host_s, host_s, number, {"position_rad": angle})
        return read(path)

    return made


def endings(recording):
    records = recording_examinations(recording, check(recording))
    assert {one.what for one in records} == {SAMPLES, STREAMS, STAMPS, OF_READINGS}
    return {one.what: one for one in records}


def without_rows(time_s, number, angle):
    kept = np.delete(np.arange(len(number)), np.arange(100, 160))
    return time_s[kept], number[kept], angle[kept]


def in_bursts(time_s, number, angle):
    last = time_s[np.minimum(16 * (number // 16) + 15, len(number) - 1)]
    return last + 1e-5 * (number % 16), number, angle


def test_a_good_log_has_nothing_and_states_what_would_have_been_found(log):
    said = endings(log())
    assert {what: one.outcome for what, one in said.items()} == {
        SAMPLES: "not examined",
        STREAMS: "nothing found",
        STAMPS: "nothing found",
        OF_READINGS: "nothing found",
    }
    assert not said[SAMPLES].expected  # nobody settles in a log
    assert 5.0 * NOISE_S < said[STAMPS].limit < 0.1
    assert (said[STREAMS].limit, said[STREAMS].unit, said[STREAMS].where) == (1.0, "missing row", "stream encoders")


def test_rows_that_are_missing_are_found(log):
    one = endings(log(without_rows))[STREAMS]
    assert (one.outcome, one.where) == ("found", "stream encoders")
    assert "60 samples missing" in one.says


def test_stamps_in_bursts_are_found(log):
    one = endings(log(in_bursts))[STAMPS]
    assert one.outcome == "found"
    assert "batches of 16" in one.says


def test_a_step_of_the_clock_beyond_the_limit_is_found_and_one_below_is_not(log):
    limit_s = endings(log())[STAMPS].limit

    def stepped(by_s):
        return lambda time_s, number, angle: (time_s + by_s * (number >= ROWS // 2), number, angle)

    assert endings(log(stepped(2.0 * limit_s)))[STAMPS].outcome == "found"
    assert endings(log(stepped(0.3 * limit_s)))[STAMPS].outcome == "nothing found"


def test_readings_that_are_missing_are_found_and_counted(log):
    def holes(time_s, number, angle):
        angle[::50, 1] = np.nan
        return time_s, number, angle

    one = endings(log(holes))[OF_READINGS]
    assert (one.outcome, one.says) == ("found", f"12 of {3 * ROWS} readings are missing")


@pytest.mark.parametrize(
    ("value", "reason"), [(np.nan, "not one valid reading came"), (1.0, "no reading ever changes")]
)
def test_encoders_that_do_not_answer_or_do_not_move_are_not_examined(log, value, reason):
    one = endings(log(lambda time_s, number, angle: (time_s, number, np.full_like(angle, value))))[OF_READINGS]
    assert (one.outcome, one.reason, one.expected) == ("not examined", reason, True)
    assert "wiring" in one.remedy


def test_two_rows_show_nothing(log):
    for what, one in endings(log(rows=2)).items():
        assert one.outcome == "not examined", what
        assert one.expected == (what != SAMPLES)
        assert one.reason
        assert one.remedy


def test_a_stream_without_one_row_is_found_silent(log):
    said = endings(log(rows=0))
    assert (said[STREAMS].outcome, said[STREAMS].says) == ("found", "declared, but not one sample came")
    assert said[OF_READINGS].outcome == "not examined"


def test_rows_without_a_counter_are_not_examined_for_gaps_and_the_counter_is_named(log):
    one = endings(log(lambda time_s, number, angle: (time_s, 0 * number, angle)))[STREAMS]
    assert (one.outcome, one.where) == ("not examined", "stream encoders")
    assert one.reason == "its counter does not rise"


def test_a_recording_without_streams_expects_them_only_of_a_log(log):
    for notes, expected in (({"segment": "1"}, True), ({}, False)):
        recording = replace(log(rig=TRACKER), streams={}, notes=notes)
        said = endings(recording)
        assert (said[STREAMS].outcome, said[STREAMS].expected) == ("not examined", expected)
        assert not said[STAMPS].expected
        assert said[SAMPLES].outcome == ("not examined" if expected else "found")  # a session without one sample


@pytest.mark.parametrize(("times_s", "outcome"), [((0.0, 1.0, 2.0), "nothing found"), ((0.0, 2.0, 1.0), "found")])
def test_samples_are_judged_by_the_order_of_their_times(log, times_s, outcome):
    rows = [{"t_s": t} | {f"q{j + 1}_rad": 0.1 * j + t for j in range(6)} for t in times_s]
    one = endings(log(rig=TRACKER, samples=rows))[SAMPLES]
    assert one.outcome == outcome
    assert one.says if outcome == "found" else one.limit == 1.0


def test_readings_alone_leave_no_record_where_none_were_recorded(log):
    recording = log()
    (one,) = reading_examinations(recording, check(recording))
    assert (one.what, one.where) == (READINGS.what, "stream encoders")
    assert reading_examinations(replace(recording, streams={}), ()) == ()
