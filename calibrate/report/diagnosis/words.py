"""Words of a diagnosis for a person, the same in terminal and report, and the unit of a size as a person reads it."""

import re
from collections.abc import Iterator, Sequence

from acquisition.recording.examination import FOUND, all_examined, examined_names, not_examined
from acquisition.recording.recording_examinations import READINGS
from calibrate.diagnose.assess import Statement
from calibrate.diagnose.record.pose_examinations import PHYSICS
from calibrate.diagnose.record.schema import (
    ClockRecord,
    DiagnosisFile,
    FreeSpaceRecord,
    NameRecord,
    RivalRecord,
    SmallestRecord,
    SplitRecord,
    UnexplainedRecord,
    of_poses,
)
from calibrate.model.effects.term import UNITS
from calibrate.quantities import TIED, counted, length

# Of streams, beside those of the catalogue; the first ending that fits is taken.
OF_STREAMS = (("_s_per_s", 1e6, "µs per s"), ("_s2", 1e6, "ms²"), ("_hz", 1.0, "Hz"), ("_count", 1.0, ""))


def unit_of(name: str, value: float) -> tuple[float, str]:
    """Factor, and the unit with the space before it; one and nothing where the name has none."""
    for ending, factor, unit in OF_STREAMS:
        if name.endswith(ending):
            return factor, f"{TIED}{unit}" if unit else ""
    for ending, steps in UNITS:
        if name.endswith(ending):
            factor, unit = next((factor, unit) for least, factor, unit in steps if abs(value) >= least)
            return factor, f"{TIED}{unit}"
    return 1.0, ""


ABSENT, WRONG = Statement.ABSENT.value, Statement.WRONG.value
NOISE = 1.15  # times the floor: some dozen samples held out scatter by so much
SPLITS = {"random": "samples at random", "place": "each station in turn", "last block": "the end of the session"}
IN_SENTENCE = ("encoder-eccentricity", "joint-compliance", "backlash")  # in a sentence; all of them stand in the table


def verdict_words(file: DiagnosisFile) -> str:
    """What was found, what is left, and what the answer is worth."""
    if any(not gross_error.rows for gross_error in file.blunders):
        return "The file is wrong as a whole: nothing can be determined about the arm."
    if file.streams is not None and not file.samples:
        return _streams_verdict(file)
    match file.verdict:
        case "mismatch" if file.known is not None:
            found = counted(len(file.findings), "change")
            return f"Recording and model differ: {found} found{_how_far(file)}."
        case "consistent" if file.known is not None:
            return f"Nothing new: recording and model agree to within {_noise(file)}{_tested(file)}{_unexamined(file)}."
        case "mismatch":
            found = counted(len(of_poses(file)), "cause")
            return f"Recording and model disagree: {found} found{_how_far(file)}."
        case "consistent":
            return f"Recording and model agree: what remains is {_noise(file)}{_tested(file)}{_unexamined(file)}."
        case _ if file.incomplete and file.unexplained is None:
            stages = ", ".join(one.stage for one in file.incomplete)
            return f"Undecidable: the diagnosis was not completed ({stages})."
        case _:
            return f"Undecidable: {_something(file)}{_tested(file)}."


def _streams_verdict(file: DiagnosisFile) -> str:
    """Of a recording without settled samples: no fault only where all that it allows was examined."""
    poses = "; no settled poses were recorded" if any(one.what == PHYSICS.what for one in file.examinations) else ""
    if file.findings:
        return f"Streams only: {counted(len(file.findings), 'cause')} found{poses}."
    left_out = any(one.what == READINGS.what and one.outcome == FOUND for one in file.examinations)
    unexplained = file.unexplained is not None or left_out
    if all_examined(file.examinations) and not file.incomplete and not unexplained:
        return f"Streams only: no fault found{poses}."
    examined = ", ".join(examined_names(file.examinations))
    if not examined:
        return "Streams only: nothing was examined; the reasons are below."
    left = "no cause found" if left_out else "something unexplained is left" if unexplained else "nothing found"
    more = "; readings of the encoders were left out" if left_out else ""
    more += f"; not examined: {_left_out(file)}" if _left_out(file) else ""
    return f"Streams only: {left} in what was examined ({examined}){poses}{more}."


def _unexamined(file: DiagnosisFile) -> str:
    """What else the recording allows and what did not take place, for the end of a verdict."""
    left = _left_out(file)
    return f"; not examined: {left}" if left else ""


def _left_out(file: DiagnosisFile) -> str:
    expected = (one.what for one in not_examined(file.examinations) if one.expected)
    return ", ".join(dict.fromkeys((*expected, *(one.stage for one in file.incomplete))))


def _how_far(file: DiagnosisFile) -> str:
    left = [u for u in (file.unexplained, *file.also_unexplained) if u is not None]
    if left:
        share = max(u.share for u in left)
        size = f", up to {100.0 * share:.0f} % of what is left," if share > 0.0 else ""
        return f", but not the whole of it: something{size} stays without a name ({_places(left)})"
    if file.rms_after_m is None or not file.noise_floor_m:
        return ""
    ratio = max(_over_the_floor(file), default=file.rms_after_m / file.noise_floor_m)
    if _unstated(file):
        return f"; what remains is {ratio:.2g} times the floor, and no noise is stated to compare it with"
    if ratio <= NOISE:
        return f", and what remains is {_noise(file).removeprefix('the ')}"
    return f"; unseen samples are still missed by {ratio:.2g} times the noise"


def _over_the_floor(file: DiagnosisFile) -> Iterator[float]:
    """Error on unseen rows over the floor, in every split."""
    floors = {f.instrument: f.rms_m for f in file.floors}
    for split in file.splits:
        floor_m = floors.get(split.instrument)
        if floor_m and split.rms_after_m is not None:
            yield split.rms_after_m / floor_m


def _unstated(file: DiagnosisFile) -> bool:
    """Whether the rig file states no noise at all of what was read."""
    return bool(file.noise) and all(one.statement == ABSENT for one in file.noise)


def _noise(file: DiagnosisFile) -> str:
    """The noise, and whether it is that of the rig file."""
    wrong = [one.says for one in file.noise if one.statement == WRONG]
    if wrong:
        return f"the noise; the {'; the '.join(wrong)}"
    if _unstated(file):
        return "scatter of which no size is stated"
    return "the noise"


def _something(file: DiagnosisFile) -> str:
    left = [u for u in (file.unexplained, *file.also_unexplained) if u is not None]
    if not left:
        return "something is there that no recorded column explains"
    return f"something is there that no recorded column explains ({_places(left)})"


def _places(left: Sequence[UnexplainedRecord]) -> str:
    return ", ".join(dict.fromkeys(u.where or "at no one place" for u in left))


def _tested(file: DiagnosisFile) -> str:
    """What the answer is worth."""
    kinds = len({one.physics for one in file.smallest})
    return f". {kinds} {'kinds of physics were' if kinds > 1 else 'kind of physics was'} tested" if kinds else ""


def limit_words(file: DiagnosisFile) -> Iterator[str]:
    """Detection limits of the usual causes in one sentence; nothing where none was determined."""
    shown = [_limit(one) for one in hardest_to_see(file) if one.physics in IN_SENTENCE]
    if shown:
        yield f"detection limits: {'; '.join(shown)}"


def _limit(smallest: SmallestRecord) -> str:
    """'encoder eccentricity of joint 2, 12 µrad'."""
    where = re.sub(r"^(joint|link)(\d+)\..*$", r"\1 \2", smallest.where)
    return f"{smallest.physics.replace('-', ' ')} of {where}, {size_of(smallest.parameter, smallest.value)}"


def untested_physics(file: DiagnosisFile) -> tuple[str, ...]:
    """Kinds of physics of which no form was tested: a kind that another recorded column could show was."""
    tested = {one.physics for one in file.smallest}
    return tuple(dict.fromkeys(m.physics for m in file.not_recorded if m.physics not in tested))


def missing_lines(file: DiagnosisFile) -> list[str]:
    """What lacks a column, and was tested by other columns in part or not at all."""
    untested = untested_physics(file)
    each = [("not tested" if m.physics in untested else "tested in part", m) for m in file.not_recorded]
    lacking = [(how, m, "" if " in the rig" in m.column else "column ") for how, m in sorted(each, key=lambda e: e[0])]
    return [f"{how}: {m.physics.replace('-', ' ')} ({what}{m.column} is missing)" for how, m, what in lacking]


def confusable_causes(file: DiagnosisFile) -> tuple[tuple[NameRecord, NameRecord, float], ...]:
    """Pairs that the poses cannot separate, the most alike first; forms of one cause are no pair of causes."""
    pairs = (pair for pair in file.confusable if (pair[0].physics, pair[0].where) != (pair[1].physics, pair[1].where))
    return tuple(sorted(pairs, key=lambda pair: -pair[2]))


def size_of(parameter: str, value: float) -> str:
    """With the unit that stands in the parameter's name, else with the name."""
    factor, unit = unit_of(parameter, value)
    shown = factor * value
    digits = f"{shown:.3g}" if abs(shown) < 999.5 else f"{shown:.0f}"
    return f"{digits}{unit}" if unit else f"{digits} ({parameter})"


def hardest_to_see(file: DiagnosisFile) -> tuple[SmallestRecord, ...]:
    """Of every physics the place where most of it could stay unseen."""
    worst: dict[str, SmallestRecord] = {}
    for one in file.smallest:
        known = worst.get(one.physics)
        if known is None or (one.parameter == known.parameter and one.value > known.value):
            worst[one.physics] = one
    return tuple(worst.values())


def place_words(name: NameRecord) -> str:
    """'encoder-eccentricity at joint2.angle, harmonic 1 of q2'."""
    order = "" if name.order is None else f" {name.order}"
    return f"{name.physics} at {name.where}, {name.shape}{order} of {name.depends_on.replace(',', ', ')}"


def rival_words(rival: RivalRecord) -> str:
    """With how far behind it is."""
    size = "" if rival.plausible else "; it fits better, but only with a size that no machine has"
    return f"{place_words(rival)} (confidence {rival.confidence:.2g}, {_behind(rival.margin)}{size})"


def before_after(split: SplitRecord) -> tuple[str, str]:
    """In micrometres."""
    return micrometres(split.rms_before_m), micrometres(split.rms_after_m)


def micrometres(value_m: float | None) -> str:
    """'12.3 µm', or a dash."""
    return "-" if value_m is None else f"{1e6 * value_m:.3g} µm"


def free_space_words(change: FreeSpaceRecord) -> str:
    """One sentence."""
    return (
        "predicted tool error between the joint angles of this session, base and tool point fitted: "
        f"{length(change.rms_before_m)} with geometry alone, {length(change.rms_after_m)} with the physics "
        f"(rms, {change.poses} poses)"
    )


def stream_words(file: DiagnosisFile) -> Iterator[str]:
    """Clocks of the devices, what is usual in the streams, and what they cannot show; nothing without streams."""
    if file.streams is None:
        return
    for clock in file.streams.clocks:
        if clock.offset_s is not None:  # one that is not reported stands, with its reason, in what cannot be seen
            yield _clock_words(clock)
    for usual in file.streams.usual:
        yield f"usual: {usual.says}"


def _clock_words(clock: ClockRecord) -> str:
    if clock.offset_s is None or clock.offset_sigma_s is None:
        return f"clock of {clock.stream}: not determined ({clock.status})"
    said = f"clock of {clock.stream}: {1e3 * clock.offset_s:.3f} ± {1e3 * clock.offset_sigma_s:.3f} ms"
    if clock.drift is None or clock.drift_sigma is None:
        return said
    return f"{said}, drift {1e6 * clock.drift:.2g} ± {1e6 * clock.drift_sigma:.2g} ppm"


def _behind(margin: float) -> str:
    """An alternative's margin in words; what rounds to nothing is no margin."""
    words = f"{abs(margin):.1f} BIC"
    return "as good" if words == "0.0 BIC" else f"{words} {'behind' if margin > 0.0 else 'ahead'}"


def noise_words(file: DiagnosisFile) -> Iterator[str]:
    """Every stated noise that is wrong, with what supports it and what opposes it."""
    for one in file.noise:
        if one.statement == WRONG:
            evidence = [f"for it: {', '.join(one.supports)}"] if one.supports else []
            evidence += [f"against it: {', '.join(one.opposes)}"] if one.opposes else []
            yield "; ".join((one.says, *evidence))
