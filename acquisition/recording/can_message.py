"""Between python-can's message and a frame of the recording.

Apart from `can_frames`, because this loads python-can, and a fit reads recordings without it.
"""

import math
from operator import attrgetter

import can

from acquisition.recording.can_frames import Frame, FrameFlag

_FLAGS = (
    ("is_extended_id", int(FrameFlag.EXTENDED)),
    ("is_remote_frame", int(FrameFlag.REMOTE)),
    ("is_error_frame", int(FrameFlag.ERROR)),
    ("is_fd", int(FrameFlag.FD)),
    ("bitrate_switch", int(FrameFlag.BIT_RATE_SWITCH)),
    ("error_state_indicator", int(FrameFlag.ERROR_STATE)),
)
_SENT = int(FrameFlag.SENT)
_flagged = attrgetter(*(name for name, _ in _FLAGS))  # in one call: nearly all frames have none of them


def frame_of(message: can.Message, host_s: float, *, sent: bool) -> Frame:
    """A frame as it was heard, or sent, at host time `host_s`."""
    flags, data = _SENT if sent else 0, message.data
    if True in _flagged(message):
        flags |= sum(flag for name, flag in _FLAGS if getattr(message, name))
        data = b"" if message.is_remote_frame else data
    stamp_s = math.nan if sent or not message.timestamp else message.timestamp
    return Frame(host_s, stamp_s, message.arbitration_id, flags, message.dlc, bytes(data))


def message_of(frame: Frame, time_s: float, channel: int | str | None) -> can.Message:
    """A frame for python-can's files; `time_s` since 1970. ValueError for one that cannot be a CAN frame."""
    named = {name: bool(frame.flags & flag) for name, flag in _FLAGS}
    return can.Message(
        timestamp=time_s,
        arbitration_id=frame.can_id,
        dlc=frame.length,
        data=None if frame.flags & FrameFlag.REMOTE else frame.data,
        channel=channel,
        is_rx=not frame.flags & _SENT,
        check=True,
        **named,
    )
