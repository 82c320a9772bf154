"""Names inside the file: topics, metadata records, keys. docs/formats.md tells them to other readers."""

import zlib
from collections.abc import Mapping

FORMAT_VERSION = "1"
PROFILE = "calibeam"

STREAM_TOPIC = "stream/"  # + name of the stream: batches of samples
VIEW_TOPIC = "view/"  # + name of the stream: single samples for viewers
SAMPLES_TOPIC = "samples"
EVENTS_TOPIC = "events"
GAPS_TOPIC = "gaps"

RECORDING_METADATA = "calibeam.recording"  # format_version, software, host, host_s0, started_utc
RIG_METADATA = "calibeam.rig"  # text, sha256
NOTES_METADATA = "calibeam.notes"  # whatever the caller wants kept: seeds, plan, operator
STREAM_METADATA = "calibeam.stream."  # + name of the stream: channels
RECOVERY_METADATA = "calibeam.recovery"  # source, damage (JSON list): of a file made by `recover`
END_METADATA = "calibeam.end"  # complete: "true" or "false"

SEGMENT_NOTE, BEFORE_NOTE = "segment", "segment_before"  # notes of a log: its number, the file that it goes on after
CHECKSUM = "crc32"  # key in every metadata record: of its other keys and values, eight hexadecimal digits


def checksum(values: Mapping[str, str]) -> str:
    """Of a metadata record: CRC-32 of "key=value" and a line feed each, sorted by key, UTF-8."""
    text = "".join(f"{key}={value}\n" for key, value in sorted(values.items()) if key != CHECKSUM)
    return f"{zlib.crc32(text.encode()):08x}"


def log_ns(host_s: float) -> int:
    """Host time in the file's unit; MCAP has no negative times."""
    return max(0, round(host_s * 1e9))
