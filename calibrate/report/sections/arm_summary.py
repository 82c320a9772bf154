"""The first page of a session's report: verdict, what to do, figures, joint zeros."""

import numpy as np

from calibrate.report.answers import Answers, Number, first_screen
from calibrate.report.anywhere import anywhere
from calibrate.report.elements import Html, figure, panels, tag
from calibrate.report.error_figures import by_sample, errors
from calibrate.report.model_tests import proofs
from calibrate.report.quantities import DASH, length, significant
from calibrate.report.sections.zeros import determined, limits_of_zeros, zeros_part
from calibrate.report.session_evidence import Readings, SessionEvidence
from calibrate.report.session_verdict import session_verdict
from calibrate.report.workspace.room import Room
from calibrate.sensors.catalogue import kind_of


def masthead(evidence: SessionEvidence) -> Html:
    """Title, when and with what."""
    recording, model = evidence.recording, evidence.model
    when = recording.started_utc.partition(".")[0].replace("T", " ")
    seen = ", ".join(kind_of(name).title.lower() for name in model.instruments)
    said = [f"{when} UTC"] if when else []
    said += [f"{model.poses} samples", seen, model.software]
    return tag(
        "header",
        tag("p", "Identification of an arm", cls="kicker"),
        tag("h1", recording.rig.name),
        tag("p", " · ".join(said), cls="byline"),
    )


def summary(said: Answers, evidence: SessionEvidence) -> Html:
    """What a person must know before anything else."""
    first = evidence.readings[0]
    pictures = panels(
        figure(errors(first), "Every reading, before and after, on a logarithmic axis."),
        figure(by_sample(first), "The same in the order of the file: a drift or a knock would show here."),
    )
    return tag("div", first_screen(said), pictures, *zeros_part(evidence), id="summary")


def answers(evidence: SessionEvidence, room: Room | str) -> Answers:
    """How good, whether to trust it, what to do; first of all the error of the tool over the workspace."""
    model, first = evidence.model, evidence.readings[0]
    known = sum(p.value is not None for p in model.parameters)
    rest = ", the others only in combinations" if known < len(model.parameters) else ""
    limits = tuple(limits_of_zeros(evidence))
    also = (
        f"{model.poses} samples used of {len(evidence.recording.samples)}; {evidence.left_out} left out as faulty",
        f"{known} of {len(model.parameters)} parameters determined{rest}",
        *([determined(evidence)] if limits else []),
        f"rows of the fit: {first.says(_rms(first.error_after))} rms distance",
    )
    numbers = (*_tool(room), *_errors(evidence), anywhere(model.free_space))
    return Answers(session_verdict(evidence), numbers, limits, also)


def _tool(room: Room | str) -> tuple[Number, Number]:
    """Over the workspace, where the data support a statement: nominal arm, and calibrated."""
    if isinstance(room, str):
        why = f"not determined: {room}"
        return (
            Number("tool_nominal", TOOL_NOMINAL, None, "m", DASH, why),
            Number("tool_calibrated", TOOL_CALIBRATED, None, "m", DASH, why),
        )
    nominal, calibrated = _rms(room.drawn_m[room.supported]), _rms(room.found_m[room.supported])
    where = "rms between the joint angles of the session"
    return (
        Number(
            "tool_nominal", TOOL_NOMINAL, nominal, "m", length(nominal), f"{where}; the base put where it fits best"
        ),
        Number(
            "tool_calibrated", TOOL_CALIBRATED, calibrated, "m", length(calibrated), f"{where}; one sigma, predicted"
        ),
    )


TOOL_NOMINAL, TOOL_CALIBRATED = "Tool error, nominal", "Tool error, calibrated"


def _errors(evidence: SessionEvidence) -> tuple[Number, Number]:
    """As drawn and now: on unseen rows where there are any, else on those of the fit."""
    first, proof = evidence.readings[0], next(iter(proofs(evidence.model)), None)
    if proof is None:
        before, after = _rms(first.error_before), _rms(first.error_after)
        on = f"rms distance of {_what(first)}, those of the fit itself"
    else:
        before, after = proof.rms_distance_before_m, proof.rms_distance_after_m
        on = f"rms distance of {proof.observations} {_what(first)} that the fit has not seen"
    gain = f"; {significant(before / after)} times better" if after > 0.0 else ""
    return (
        Number(
            "as_drawn",
            "Unseen readings, nominal",
            before,
            first.unit,
            first.says(before),
            f"{on}; nominal arm",
        ),
        Number("now", "Unseen readings, calibrated", after, first.unit, first.says(after), on + gain),
    )


def _what(readings: Readings) -> str:
    return readings.title[0].lower() + readings.title[1:]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
