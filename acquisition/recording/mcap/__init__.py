"""The recording's file: MCAP with embedded protobuf descriptions, whole at any instant while it is written.

`RecordingWriter` and `read` (both in `acquisition.recording`) are what most need. Here is the rest: long recordings in
segments, sessions of several parts. A new kind of message is a `MessageType` in `layout`, an encoder in `write_thread`
and a `_take_...` in `read`.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from acquisition.recording.mcap.log_segments import Rotation, SegmentedRecording, SegmentStream, segments
    from acquisition.recording.mcap.session_parts import differs, next_part, parts

__all__ = [
    "Rotation",
    "SegmentStream",
    "SegmentedRecording",
    "differs",
    "next_part",
    "parts",
    "segments",
]

_NAMES_IN = {
    "log_segments": ("Rotation", "SegmentStream", "SegmentedRecording", "segments"),
    "session_parts": ("differs", "next_part", "parts"),
}
_MODULE_OF = {name: module for module, names in _NAMES_IN.items() for name in names}


def __getattr__(name: str) -> object:
    """The name, from its module, loaded only now: reading must not load what only writing needs."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
