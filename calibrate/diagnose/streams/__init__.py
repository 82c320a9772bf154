"""Clocks, gaps, late channels, ringing and slips in recorded streams, without any model of the arm."""

from calibrate.diagnose.streams.clock import ClockFit, ClockStatus, clock_between
from calibrate.diagnose.streams.examine import StreamReport
from calibrate.diagnose.streams.finding import Outcome, StreamFinding
from calibrate.diagnose.streams.from_recording import streams_of
from calibrate.diagnose.streams.recorded import Device, devices_of
from calibrate.diagnose.streams.sample_times import sample_windows
from calibrate.diagnose.streams.to_file import with_streams
from calibrate.diagnose.streams.track import Curve, Track, white_noise

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
