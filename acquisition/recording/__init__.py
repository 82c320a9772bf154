"""The recording: what a session measured, as one self-describing file; the only thing that a fit and a session share.

`read` opens a file, a session of several files or a session folder; `RecordingWriter` writes one; `check` reports what
is wrong with one; `recover` saves what a damaged one holds. Below are `rig` (the rig file), `mcap` (the file itself),
`session_folder` (rig.toml with tables) and `files` (TOML and JSON to records). A new kind of content is a topic or a
metadata record in `mcap.layout`; what an older program does not know, it leaves alone.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from acquisition.recording.check_recording import Finding, check
    from acquisition.recording.errors import RecordingError, RigFileError, SamplesError
    from acquisition.recording.mcap.read import read
    from acquisition.recording.mcap.recover import recover
    from acquisition.recording.mcap.writer import RecordingWriter
    from acquisition.recording.recording import Channel, Event, Gap, Recording, Stream
    from acquisition.recording.samples import Samples, readings_sha256

__all__ = [
    "Channel",
    "Event",
    "Finding",
    "Gap",
    "Recording",
    "RecordingError",
    "RecordingWriter",
    "RigFileError",
    "Samples",
    "SamplesError",
    "Stream",
    "check",
    "read",
    "readings_sha256",
    "recover",
]

_NAMES_IN = {
    "recording": ("Channel", "Event", "Gap", "Recording", "Stream"),
    "check_recording": ("Finding", "check"),
    "errors": ("RecordingError", "RigFileError", "SamplesError"),
    "mcap.writer": ("RecordingWriter",),
    "samples": ("Samples", "readings_sha256"),
    "mcap.read": ("read",),
    "mcap.recover": ("recover",),
}
_MODULE_OF = {name: module for module, names in _NAMES_IN.items() for name in names}


def __getattr__(name: str) -> object:
    """The name, from its module, loaded only now: who reads a rig needs no MCAP, who reads a recording no sockets."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_MODULE_OF[name]}"), name)
