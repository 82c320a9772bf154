"""compare.json, version 1: what `calibeam compare` writes; docs/formats.md tells it to other programs."""

from pathlib import Path

import msgspec

from calibrate.diagnose.schema import DiagnosisFile


class LinkRecord(msgspec.Struct, frozen=True):
    """One link of the chain over the matched samples; `own`: without what the links in front of it explain."""

    link: str
    unit: str
    rows: int
    rms_raw: float
    rms_own: float
    largest_own: float
    largest_column: str
    largest_t_s: float
    noise: float | None
    noise_from: str
    p: float | None
    parts: bool
    first_t_s: float | None
    mean_own: tuple[float, ...]
    scatter: float  # from row to row: the noise that was found


class StreamRecord(msgspec.Struct, frozen=True):
    """One device's stream in both recordings."""

    stream: str
    unit: str
    status: str
    offset_s: float | None  # simulated clock less measured clock, at `middle_s` of the measured one
    offset_sigma_s: float | None
    drift: float | None
    drift_sigma: float | None
    middle_s: float
    samples: int
    level: tuple[float, ...] | None
    rms: float | None
    noise: float | None
    largest: float | None
    largest_s: float | None
    parts: bool | None
    later_than_joints_s: float | None
    later_than_joints_sigma_s: float | None


class ComparisonFile(msgspec.Struct, frozen=True):
    """Everything; `first_link` is None where nothing parts."""

    schema: int
    kind: str
    software: str
    measured: str
    simulated: str
    matched: int
    only_measured_t_s: tuple[float, ...]
    only_simulated_t_s: tuple[float, ...]
    first_link: str | None
    says: str
    links: tuple[LinkRecord, ...]
    streams: tuple[StreamRecord, ...]
    notes: tuple[str, ...]
    diagnosis: DiagnosisFile | None


def write_comparison(path: Path, file: ComparisonFile) -> None:
    """OSError where it cannot be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(msgspec.json.format(msgspec.json.encode(file), indent=2) + b"\n")
