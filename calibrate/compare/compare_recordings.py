"""Two recordings of one plan, measured and simulated: what they differ by from the outside in, and whether they agree.

`compare` takes recordings to one frozen record, the content of compare.json, version 1, as in docs/formats.md.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from acquisition.recording import Recording, Samples
from calibrate.compare.chain import (
    READINGS,
    Pair,
    columns_of,
    differences,
)
from calibrate.compare.comparison_examinations import with_examinations
from calibrate.compare.comparison_file import (
    ComparisonFile,
    DroppedRecord,
    Level,
    Mismatch,
    difference_record,
    size_records,
)
from calibrate.compare.difference_explained import Explanation, explain, notes_of
from calibrate.compare.encoder_zeros import ZeroChange, joint_zeros, zero_mismatches_of
from calibrate.compare.fit_to_simulation import Constant
from calibrate.compare.link_differs import (
    ROUNDING,
    JudgedLink,
    judged,
)
from calibrate.compare.matched import (
    Key,
    Matched,
    match,
    zeros_between,
)
from calibrate.compare.mismatches import mismatches
from calibrate.compare.rig_and_streams import (
    SAYS,
    joint_mismatches,
    rig_mismatches,
    stream_mismatches,
    stream_records,
    stream_reports,
    zero_mismatches,
)
from calibrate.compare.rig_keys import rig_differences
from calibrate.compare.streams import stream_pairs
from calibrate.diagnose.assess import Verdict
from calibrate.diagnose.streams import devices_of
from calibrate.errors import DataError
from calibrate.fit.identify.wrong_file import wrong_file
from calibrate.model.model_file import ModelFile

Floats = NDArray[np.float64]
READING = tuple(reading.link for reading in READINGS)
EXPLAINED = (*READING, "encoders")  # links whose differences are asked of the model


def compare(
    measured: Recording,
    simulated: Recording,
    software: str,
    *,
    diagnosed: bool = True,
    made_of: ModelFile | None = None,
    structure: ModelFile | None = None,
) -> ComparisonFile:
    """DataError where the two are not of one arm and one plan.

    `diagnosed`: explain what differs. `made_of`: the model that has predicted the simulated readings, whose own
    uncertainty then counts as no difference. `structure`: the model whose values stand beside the differences.
    """
    for recording in (measured, simulated):
        _refuse_wrong(recording)
    rows = match(measured.samples, simulated.samples, _plans(measured, simulated))
    pair = measured.samples.take(rows.measured), simulated.samples.take(rows.simulated)
    zeros_rad = zeros_between(*pair)
    pair = _without_zeros(pair, zeros_rad), pair[1]
    asked, model, alike = explain(measured, simulated, pair, zeros_rad, made_of, diagnosed=diagnosed)
    links = differences(model, alike)
    judged_links = judged(links, model, alike)
    rig = rig_differences(measured.rig, simulated.rig)
    found = [*rig_mismatches(rig), *joint_mismatches(judged_links, links)]
    if asked.found is not None:
        found += mismatches(asked.found, zeros_rad)
    else:
        found += zero_mismatches(zeros_rad)
    found += asked.left
    streams = stream_pairs(devices_of(measured), devices_of(simulated))
    zeros = joint_zeros(*(reports := stream_reports(measured, simulated, asked.found)))
    found += stream_mismatches(measured, simulated, reports, streams) + _unseen_in_samples(zeros, found)
    found.sort(key=lambda one: one.order)
    explained = any(one.decides and one.level not in (Level.RIG, Level.STREAMS) for one in found)
    judged_links = tuple(_as_explained(one, asked, explained, pair[0]) for one in judged_links)
    verdict = _verdict(found, judged_links, asked)
    file = ComparisonFile(
        1,
        "calibeam-comparison",
        software,
        measured.path.name,
        simulated.path.name,
        len(rows.measured),
        *_unmatched(measured.samples, simulated.samples, rows),
        verdict.value,
        _says(verdict, found, asked),
        rig,
        tuple(difference_record(one, structure) for one in found),
        () if asked.found is None else tuple(_dropped(one) for one in asked.found.dropped),
        asked.readings,
        next((one.link for one in judged_links if one.parts), None),
        judged_links,
        stream_records(streams),
        tuple(notes_of(asked)),
        asked.diagnosis,
    )
    return with_examinations(file, measured, simulated, zeros)


def _unseen_in_samples(zeros: Sequence[ZeroChange], found: Sequence[Mismatch]) -> list[Mismatch]:
    """Zeros of second encoders that the samples have not shown already."""
    known = {one.where for one in found if one.level is Level.ENCODER_ZEROS}
    return [one for one in zero_mismatches_of(zeros) if one.where not in known]


def _refuse_wrong(recording: Recording) -> None:
    """DataError naming the recording whose file is written by another convention as a whole."""
    try:
        wrong = wrong_file(recording.rig, recording.samples)
    except (DataError, np.linalg.LinAlgError):
        return  # joints alone, or another arm: no reading shows which convention was meant
    if wrong:
        raise DataError(f"{recording.path}: {'; besides, '.join(gross_error.says for gross_error in wrong)}")


def _plans(measured: Recording, simulated: Recording) -> tuple[tuple[Key, ...], tuple[Key, ...]] | None:
    one, two = _plan(measured), _plan(simulated)
    return None if one is None or two is None else (one, two)


def _plan(recording: Recording) -> tuple[Key, ...] | None:
    """Of each sample its place in the plan, as the session has written it; None where it did not."""
    said = [event.detail.get("pose") for event in recording.events if event.kind == "sample"]
    poses = [pose for pose in said if isinstance(pose, Mapping)]
    if not poses or len(poses) != len(said) or len(said) != len(recording.samples):
        return None
    return tuple(tuple(sorted(pose.items())) for pose in poses)


def _without_zeros(pair: Pair, zeros_rad: Floats) -> Samples:
    """The measured table with joints that read as the simulated ones do, but for less than a servo moves."""
    if not np.any(zeros_rad):
        return pair[0]
    names = [f"q{j + 1}_rad" for j in range(pair[0].n_joints)]
    return columns_of(pair[0], {n: pair[0].column(n) - zeros_rad[j] for j, n in enumerate(names)})


def _as_explained(one: JudgedLink, asked: Explanation, explained: bool, measured: Samples) -> JudgedLink:
    """After a search a reading parts where it found something; noise is what it found, not what was assumed."""
    if asked.found is None or one.link not in EXPLAINED:
        return one
    if not explained:
        return replace(one, parts=False, first_t_s=None)
    first_t_s = float(measured.column("t_s")[0])
    return one if one.parts else replace(one, parts=one.largest_own > ROUNDING, first_t_s=first_t_s)


def _verdict(found: list[Mismatch], judged_links: tuple[JudgedLink, ...], asked: Explanation) -> Verdict:
    """No line above it may contradict it."""
    deciding = [one for one in found if one.decides]
    if any(one.level is not Level.UNEXPLAINED for one in deciding):
        return Verdict.MISMATCH
    if deciding:
        return Verdict.UNDECIDABLE
    if asked.found is None and any(one.parts for one in judged_links):
        return Verdict.MISMATCH
    return Verdict.CONSISTENT if asked.why is None else Verdict.UNDECIDABLE


def _says(verdict: Verdict, found: list[Mismatch], asked: Explanation) -> str:
    deciding = [one for one in found if one.decides]
    anew = "; what is set up again for every recording is taken into account" if len(deciding) < len(found) else ""
    if verdict is Verdict.CONSISTENT:
        return f"Measured and simulated agree to within the noise at every level that was examined{anew}."
    if verdict is Verdict.UNDECIDABLE:
        return f"{deciding[0].says if deciding else asked.why}."
    named = [one for one in deciding if one.level is not Level.UNEXPLAINED]
    if not named:
        return "Measured and simulated differ; the links below show where."
    levels = list(dict.fromkeys(one.level.value.replace("-", " ") for one in named))
    left = " Something is left over besides." if len(named) < len(deciding) else ""
    many = f"{len(named)} differences" if len(named) > 1 else "1 difference"
    return f"Measured and simulated differ: {many} ({', '.join(levels)}){_how_far(asked)}.{left}"


def _how_far(asked: Explanation) -> str:
    if not asked.readings:
        return ""
    first = asked.readings[0]
    says = SAYS[first.unit]
    noise = "" if first.noise is None else f", noise {says(first.noise)}"
    before, after = says(first.rms_coordinate_before), says(first.rms_coordinate_after)
    return f"; {first.instrument} {before} apart before, {after} after{noise} (rms of a coordinate)"


def _unmatched(measured: Samples, simulated: Samples, rows: Matched) -> tuple[tuple[float, ...], tuple[float, ...]]:
    one = measured.column("t_s")[rows.only_measured]
    two = simulated.column("t_s")[rows.only_simulated]
    return tuple(one.tolist()), tuple(two.tolist())


def _dropped(one: Constant) -> DroppedRecord:
    return DroppedRecord(one.where, one.physics, size_records(dict(zip(one.names, one.sizes, strict=True))))
