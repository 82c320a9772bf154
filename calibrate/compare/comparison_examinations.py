"""How the examinations of a comparison ended."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from msgspec import structs

from acquisition.recording import Recording
from acquisition.recording.examination import (
    Examination,
    ExaminationRecord,
    all_examined,
    examined_names,
    not_examined,
)
from calibrate.compare.comparison_file import ComparisonFile, DifferenceRecord, Level
from calibrate.compare.encoder_zeros import ZERO, ZeroChange
from calibrate.diagnose.assess import Verdict
from calibrate.diagnose.record.schema import TORQUES_IN_MOTION
from calibrate.diagnose.streams import devices_of

READINGS = Examination(
    "readings of the samples",
    ("q", "readings"),
    "give a recording of the simulation with the same poses, --simulator or --simulated-model",
)
CAUSES = Examination("causes of what differs", ("q", "readings"), "measure more poses, and leave --no-diagnose out")
STREAMS = Examination(
    "streams", ("device_s", "q", "enc", "cmd"), "give two recordings with streams (.mcap) of the same motion"
)
SECOND_ZEROS = Examination(
    "offset of the second encoders",
    ("enc", "q"),
    "give two recordings with both encoders of the joints over ten seconds or more of motion",
)
IN_SAMPLES = frozenset((Level.RIG, Level.JOINT_ZEROS, Level.LINKS, Level.ENCODER_ZEROS, Level.FRAMES, Level.JOINTS))
WITHOUT_STREAMS = "not both of the two have streams"
Records = Iterator[ExaminationRecord]
ANGLES = ("command", "joints", "encoders")  # links that are no reading of an instrument
DEVICES = ("command", "joints", "encoders", "spots")
IN_CAUSES = frozenset((Level.EFFECTS, Level.UNEXPLAINED))


@dataclass(frozen=True, eq=False)
class ComparedPair:
    """The file and what it was made of; `simulated` None: a description of torques alone."""

    file: ComparisonFile
    measured: Recording
    simulated: Recording | None
    zeros: Sequence[ZeroChange] = ()

    def differences(self, levels: frozenset[Level]) -> Sequence[DifferenceRecord]:
        values = {level.value for level in levels}
        return [one for one in self.file.differences if one.decides and one.level in values and one.physics != ZERO]

    def has(self, device: str) -> bool:
        return any(device in devices_of(one) for one in (self.measured, self.simulated) if one is not None)

    def both_have(self, device: str) -> bool:
        return self.simulated is not None and all(device in devices_of(r) for r in (self.measured, self.simulated))


def _readings(asked: ComparedPair) -> Records:
    links = [one for one in asked.file.links if one.link not in ANGLES]
    if not asked.file.matched or not links:
        held = len(asked.measured.samples) > 0
        why = "no rows of the two were compared" if held else "no settled samples were recorded"
        why = "the two share no reading of an instrument" if asked.file.matched else why
        yield READINGS.not_examined(why, expected=held and asked.simulated is not None)
        return
    found = [one.says for one in asked.differences(IN_SAMPLES)]
    found += [f"{one.link} differs by {one.rms_own:.3g} {one.unit} rms" for one in asked.file.links if one.parts]
    if found:
        yield READINGS.found("; ".join(found))
        return
    noise = [
        (one.instrument, one.noise if one.noise is not None else one.rms_coordinate_after, one.unit)
        for one in asked.file.readings
    ] or [(one.link, one.scatter, one.unit) for one in links]
    known = [(name, value, unit) for name, value, unit in noise if np.isfinite(value)]
    if not known:
        yield READINGS.not_examined("the two share no reading")
    elif len({unit for _, _, unit in known}) > 1:
        yield READINGS.nothing(None, "", says="; ".join(f"{name} {value:.3g} {unit}" for name, value, unit in known))
    else:
        yield READINGS.nothing(max(value for _, value, _ in known), known[0][2])


def _causes(asked: ComparedPair) -> Records:
    found = asked.differences(IN_CAUSES)
    if found:
        yield CAUSES.found("; ".join(one.says for one in found))
        return
    diagnosis = asked.file.diagnosis
    if diagnosis is None:
        undecided = asked.file.verdict == Verdict.UNDECIDABLE.value
        why = asked.file.says if asked.file.matched and undecided else "no cause was sought beside the samples"
        yield CAUSES.not_examined(why, expected=asked.file.matched > 0)
        return
    failed = "; ".join(f"{one.stage}: {one.reason}" for one in diagnosis.incomplete)
    if failed:
        yield CAUSES.not_examined(failed)
        return
    limits = "; ".join(f"{s.physics} at {s.where}: {s.parameter} {s.value:.3g}" for s in diagnosis.smallest[:3])
    if not limits:
        yield CAUSES.not_examined("these poses show no cause of the catalogue")
        return
    yield CAUSES.nothing(None, "", says=limits)


def _streams(asked: ComparedPair) -> Records:
    by_name = {one.stream: one for one in asked.file.streams}
    found = list(asked.differences(frozenset((Level.STREAMS,))))
    if found:
        yield STREAMS.found("; ".join(one.says for one in found))
    recorded = [name for name in DEVICES if asked.has(name)]
    if not recorded:
        yield STREAMS.not_examined(WITHOUT_STREAMS, expected=False)
    for name in recorded:
        one = by_name.get(name)
        if one is not None and one.noise is not None and one.parts is not None:
            yield STREAMS.nothing(one.noise, one.unit, name)
        elif not asked.both_have(name):
            yield STREAMS.not_examined("only one of the two has it", name)
        elif not found:
            why = "the two were not sent the same motion" if one is None or one.noise is not None else one.status
            yield STREAMS.not_examined(why, name)


def _second_zeros(asked: ComparedPair) -> Records:
    found = [one.says for one in asked.file.differences if one.physics == ZERO]
    if found:
        yield SECOND_ZEROS.found("; ".join(found))
        return
    if not asked.both_have("encoders"):
        yield SECOND_ZEROS.not_examined("not both of the two have second encoders", expected=asked.has("encoders"))
        return
    if not asked.zeros:
        yield SECOND_ZEROS.not_examined("in one of the two the offsets are not determined")
        return
    yield SECOND_ZEROS.nothing(max(one.limit_rad for one in asked.zeros), "rad")


def _torques(asked: ComparedPair) -> Records:
    compared = asked.file.torques
    if compared is None:
        held = "torque" in devices_of(asked.measured)
        why = "no description of the simulation's torques was given" if held else "no torques were recorded"
        remedy = "give --simulation FILE (URDF or MJCF)" if held else ""
        yield TORQUES_IN_MOTION.not_examined(why, expected=False, remedy=remedy)
        return
    if asked.file.verdict != Verdict.CONSISTENT.value:
        yield TORQUES_IN_MOTION.found(asked.file.says)
        return
    yield TORQUES_IN_MOTION.nothing(max(one.noise_nm for one in compared.joints), "Nm")


COMPARE_EXAMINATIONS: tuple[tuple[Examination, Callable[[ComparedPair], Records]], ...] = (
    (READINGS, _readings),
    (CAUSES, _causes),
    (STREAMS, _streams),
    (SECOND_ZEROS, _second_zeros),
    (TORQUES_IN_MOTION, _torques),
)


def with_examinations(
    file: ComparisonFile, measured: Recording, simulated: Recording | None, zeros: Sequence[ZeroChange] = ()
) -> ComparisonFile:
    """The comparison with how each examination ended; `zeros`: of the second encoders, between the two."""
    asked = ComparedPair(file, measured, simulated, zeros)
    records = tuple(record for _, examine in COMPARE_EXAMINATIONS for record in examine(asked))
    return _with_verdict(structs.replace(file, examinations=records))


def with_torque_examination(file: ComparisonFile, measured: Recording) -> ComparisonFile:
    """A comparison of torques, alone or beside the samples, whose examinations it keeps."""
    if not file.examinations:
        return with_examinations(file, measured, None)
    others = tuple(one for one in file.examinations if one.what != TORQUES_IN_MOTION.what)
    return structs.replace(file, examinations=(*others, *_torques(ComparedPair(file, measured, None))))


def _with_verdict(file: ComparisonFile) -> ComparisonFile:
    """The two agree only where all that both allow was examined; without readings or torques nothing is decided."""
    if file.verdict != Verdict.CONSISTENT.value or all_examined(file.examinations):
        return file
    deciding = (READINGS.what, TORQUES_IN_MOTION.what, SECOND_ZEROS.what, STREAMS.what)
    names = [one for one in examined_names(file.examinations) if one in deciding]
    missing = not_examined(file.examinations)
    left = ", ".join(dict.fromkeys(one.what for one in missing if one.expected or not names))
    if not names:
        return structs.replace(file, verdict=Verdict.UNDECIDABLE.value, says=f"Not examined: {left}.")
    says = f"No difference was found in what was examined ({', '.join(names)}); not examined: {left}."
    return structs.replace(file, says=says)
