"""Names inside the file: topics, metadata records, keys. docs/formats.md tells them to other readers."""

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
END_METADATA = "calibeam.end"  # complete: "true" or "false"


def log_ns(host_s: float) -> int:
    """Host time in the file's unit; MCAP has no negative times."""
    return max(0, round(host_s * 1e9))
