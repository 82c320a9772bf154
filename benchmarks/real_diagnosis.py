"""What the diagnosis finds on real recordings, what remains, and whether unseen samples agree. No truth is known."""

import time
from collections.abc import Iterator
from pathlib import Path

from acquisition.recording import read
from calibeam.results.diagnosis import diagnose_recording
from calibrate.diagnose.schema import DiagnosisFile
from calibrate.report.diagnosis.words import before_after, free_space_words, micrometres, place_words, verdict_words


def lines(data: Path) -> Iterator[str]:
    """Of every session folder in `data`; one line that says so where there is none."""
    folders = sorted(path.parent for path in data.glob("*/rig.toml")) if data.is_dir() else []
    if not folders:
        yield f"skipped: no session folders in {data.name}; the real recordings are not part of the project"
    for folder in folders:
        recording, before = read(folder), time.process_time()
        _, file = diagnose_recording(recording)
        yield f"{folder.name}: {file.samples} samples, {time.process_time() - before:.0f} s of one core"
        yield from (f"  {line}" for line in said(file))


def said(file: DiagnosisFile) -> Iterator[str]:
    """Verdict, findings, proof, what remains."""
    yield verdict_words(file)
    for finding in file.findings:
        yield f"found: {finding.says} ({place_words(finding)}; {100.0 * (finding.share or 0.0):.0f} %)"
    for split in file.splits:
        before, after = before_after(split)
        yield f"held out ({split.split}), {split.instrument}, {split.observations} readings: {before} -> {after}"
    yield f"floor: {micrometres(file.noise_floor_m)} ({file.noise_floor_source})"
    if file.free_space is not None:
        yield free_space_words(file.free_space)
    for one in (file.unexplained, *file.also_unexplained):
        if one is not None:
            yield f"remains: {micrometres(one.rms_m)} at {one.where or 'no one place'}: {one.says}"
    for blunder in file.blunders:
        yield f"fault: {blunder.says}"
