"""Clocks, gaps, late channels, ringing and slips in recorded streams, without any model of the arm."""

from calibrate.diagnose.streams.clock import ClockFit, ClockStatus, clock_between
from calibrate.diagnose.streams.encoder_pairs import examine_encoders
from calibrate.diagnose.streams.examine import StreamReport
from calibrate.diagnose.streams.recorded import StreamDevice, devices_of
from calibrate.diagnose.streams.stream_examinations import STREAM_EXAMINATIONS
from calibrate.diagnose.streams.stream_findings import StreamFinding
from calibrate.diagnose.streams.streams_of_recording import sample_windows, streams_of, with_streams
from calibrate.diagnose.streams.track import Outcome, Track, white_noise

__all__ = [
    "STREAM_EXAMINATIONS",
    "ClockFit",
    "ClockStatus",
    "Outcome",
    "StreamDevice",
    "StreamFinding",
    "StreamReport",
    "Track",
    "clock_between",
    "devices_of",
    "examine_encoders",
    "sample_windows",
    "streams_of",
    "white_noise",
    "with_streams",
]
