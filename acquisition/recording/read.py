"""Opens a recording: one file, whole or torn off at any byte, a session of several parts, or a session folder."""

from collections.abc import Mapping
from pathlib import Path

import msgspec
from mcap.records import Header

from acquisition.recording.errors import RecordingError
from acquisition.recording.layout import (
    END_METADATA,
    FORMAT_VERSION,
    NOTES_METADATA,
    PROFILE,
    RECORDING_METADATA,
    RECOVERY_METADATA,
    RIG_METADATA,
)
from acquisition.recording.mcap.parts import joined, parts
from acquisition.recording.mcap.read import Content
from acquisition.recording.mcap.scan import Scan
from acquisition.recording.recording import Recording
from acquisition.recording.rig import parse_rig, rig_sha256
from acquisition.recording.rig.schema import Rig
from acquisition.recording.sample_rules import checked_samples, no_samples
from acquisition.recording.samples import Samples
from acquisition.recording.session_folder.folder import RIG, read_folder


def read(path: Path | str) -> Recording:
    """A recording or a session folder. Of a torn or damaged file every complete batch, with `complete` False.

    A folder with recording.mcap and no rig.toml is all parts of that session together (parts.py).

    RecordingError when it is neither, or torn before the rig; RigFileError and SamplesError for what a folder holds.
    """
    path = Path(path)
    if not path.is_dir():
        return _read_mcap(path)
    files = [] if (path / RIG).is_file() else parts(path)
    return joined([_read_mcap(file) for file in files], path) if files else read_folder(path)


def _read_mcap(path: Path) -> Recording:
    scan, content = Scan(path), Content()
    for record in scan.records():
        if isinstance(record, Header) and record.profile != PROFILE:
            raise RecordingError(
                f"{path}: an MCAP file of another program (profile '{record.profile}', library '{record.library}'); "
                "give a recording of calibeam"
            )
        content.take(record)
    about = _metadata(content, RECORDING_METADATA, path, scan)
    if about.get("format_version") != FORMAT_VERSION:
        raise RecordingError(
            f"{path}: format version {about.get('format_version')} is not known to this version, which reads "
            f"{FORMAT_VERSION}; use the calibeam that wrote it ({about.get('software')}) or a newer one"
        )
    rig_text = _rig_text(content, path, scan)
    rig = parse_rig(rig_text, f"{path} (rig)")
    damage = (*scan.damage, *_undecodable(content), *_before_recovery(content))
    ended = content.metadata.get(END_METADATA, {}).get("complete") == "true"
    return Recording(
        path=path,
        rig_text=rig_text,
        rig=rig,
        samples=_samples(content, rig, path),
        complete=ended and scan.whole and not damage,
        damage=damage,
        software=about.get("software", ""),
        host=about.get("host", ""),
        started_utc=about.get("started_utc", ""),
        host_s0=_host_s0(about, path),
        notes=dict(content.metadata.get(NOTES_METADATA, {})),
        streams=content.streams(),
        events=tuple(content.events),
    )


def _metadata(content: Content, name: str, path: Path, scan: Scan) -> Mapping[str, str]:
    if name not in content.metadata:
        why = scan.damage[0] if scan.damage else "the record was never written"
        raise RecordingError(
            f"{path}: '{name}' cannot be read ({why}), so nothing can be made of the rest; use a copy, "
            "or try `calibeam recover`"
        )
    return content.metadata[name]


def _host_s0(about: Mapping[str, str], path: Path) -> float:
    text = about.get("host_s0", "0")
    try:
        return float(text)
    except ValueError:
        raise RecordingError(f"{path}: host_s0 = '{text}' in the file is damaged; use a copy of the file") from None


def _rig_text(content: Content, path: Path, scan: Scan) -> str:
    record = _metadata(content, RIG_METADATA, path, scan)
    text = record.get("text", "")
    if rig_sha256(text) != record.get("sha256"):
        raise RecordingError(f"{path}: the rig in the file is damaged (its SHA-256 is another); use a copy of the file")
    return text


def _samples(content: Content, rig: Rig, path: Path) -> Samples:
    if not content.rows:
        return no_samples(rig)
    columns = {column: [row.get(column) for row in content.rows] for column in content.columns}
    return checked_samples(columns, rig, lambda row: str(path) if row is None else f"{path} sample {row + 1}")


def _before_recovery(content: Content) -> tuple[str, ...]:
    """What `recover` could not save, told by the file that it made."""
    told = content.metadata.get(RECOVERY_METADATA, {})
    lost = msgspec.json.decode(told.get("damage", "[]"), type=list[str])
    return tuple(f"before its recovery from {told.get('source')}: {says}" for says in lost)


def _undecodable(content: Content) -> tuple[str, ...]:
    count = content.undecodable
    return (f"{count} records do not fit their own description and were left out",) if count else ()
