"""Clocks, gaps, late channels, ringing and slips in recorded streams, without any model of the arm."""

from calibrate.diagnose.streams.clock import ClockFit, ClockStatus, clock_between
from calibrate.diagnose.streams.examine import StreamReport
from calibrate.diagnose.streams.recorded import Device, devices_of
from calibrate.diagnose.streams.stream_findings import StreamFinding
from calibrate.diagnose.streams.streams_of_recording import sample_windows, streams_of, with_streams
from calibrate.diagnose.streams.track import Curve, Outcome, Track, white_noise

__all__ = [
    "ClockFit",
    "ClockStatus",
    "Curve",
    "Device",
    "Outcome",
    "StreamFinding",
    "StreamReport",
    "Track",
    "clock_between",
    "devices_of",
    "sample_windows",
    "streams_of",
    "white_noise",
    "with_streams",
]
