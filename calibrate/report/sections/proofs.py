"""The chapter on uncertainty: unseen rows, the error expected over the workspace, chi-square, noise, repeats."""

from collections.abc import Iterator, Sequence

from acquisition.recording.rig import Rig
from calibrate.fit.accuracy import Alarm
from calibrate.fit.weighting import JOINT
from calibrate.model.model_file import ModelFile, UnseenRows, WorkspaceErrorRecord
from calibrate.model.sensors.catalogue import SOURCES, kind_of
from calibrate.model.sensors.kind import NoiseSource
from calibrate.quantities import (
    DASH,
    angle,
    angle_with_sigma,
    fixed,
    length,
    length_with_sigma,
    significant,
)
from calibrate.report.elements.html import (
    Html,
    bullets,
    section,
    table,
    tag,
)
from calibrate.report.evidence.model_tests import (
    fit_end,
    proofs,
    repeated,
    scatter,
)
from calibrate.report.evidence.session_evidence import SessionEvidence


def free_space(found: WorkspaceErrorRecord | None) -> list[Html]:
    """A table; the reason where there is no prediction; nothing of a model from before there was one."""
    if found is None:
        return []
    if found.rms_m is None:
        return [
            tag("p", tag("b", "Tool error over the workspace: "), f"none is stated: {found.says}."),
            *_because(found),
        ]
    rows = [
        (
            "calibrated geometry alone",
            *_three(found.rms_m, found.p95_m, found.max_m),
            "what better data could still remove",
        ),
        ("a single pose", *_three(found.pose_rms_m, found.pose_p95_m, found.pose_max_m), f"with {found.scatter}"),
    ]
    caption = f"Predicted error of the target, one sigma, {found.poses} poses drawn evenly between the joint limits"
    head = ("Error of", "rms", "95 %", "largest", "holds")
    note = (
        "Valid if the model is complete: physics that it lacks shows in the unseen rows above, not here. Where base "
        "and device stand is not an error of the arm and is left out."
    )
    return [table(head, rows, numeric=(1, 2, 3), caption=caption), tag("p", note, cls="lead"), *_guessed(found)]


def _three(*values_m: float | None) -> tuple[str, ...]:
    return tuple(DASH if value is None else length(value) for value in values_m)


def _because(found: WorkspaceErrorRecord) -> list[Html]:
    return [bullets(found.undetermined)] if found.undetermined else []


def _guessed(found: WorkspaceErrorRecord) -> list[Html]:
    if not found.guessed:
        return []
    listed = "; ".join(found.guessed)
    return [tag("p", f"Not determined, and counted with their plausible size: {listed}.")]


def unseen_rows(found: Sequence[UnseenRows], unproven: Sequence[str]) -> list[Html]:
    """A table, or a sentence where nothing was kept out; then why a split proves nothing."""
    reasons = [tag("p", f"No proof by {why}.") for why in unproven]
    if not found:
        return [tag("p", "No rows were kept out of the fit: too few, or it was not asked for."), *reasons]
    head = (
        "Left out",
        "reading",
        "count",
        "nominal, rms distance",
        "calibrated, rms distance",
        "over the noise",
        "over noise and sigmas",
    )
    caption = "Rows that the fit has not seen, predicted from the others"
    return [table(head, (_proof(p) for p in found), numeric=(2, 3, 4, 5, 6), caption=caption), *reasons]


def _proof(proof: UnseenRows) -> tuple[str, ...]:
    kind = kind_of(proof.instrument)
    says = angle if kind.quantities[0].unit == "rad" else length
    return (
        proof.split,
        kind.title,
        str(proof.observations),
        says(proof.rms_distance_before_m),
        says(proof.rms_distance_after_m),
        fixed(proof.chi_after, 2),
        DASH if proof.chi_predicted is None else fixed(proof.chi_predicted, 2),
    )


TITLE = "Proof and uncertainty"
NONE = "too small to be separated from none"
OF_JOINTS = NoiseSource(JOINT, "rad", "joint_rad")


def proofs_chapter(evidence: SessionEvidence) -> Html:
    """Unseen rows, uncertainty, noise and tests of the fit."""
    lead = "The error on rows that the fit has not seen is the error to expect at work."
    return section(
        "proofs",
        TITLE,
        lead,
        *unseen_rows(proofs(evidence.model), evidence.model.unproven),
        *free_space(evidence.model.free_space),
        _noise(evidence.model, evidence.recording.rig),
        table(("Test", "value", "reads as"), _tests(evidence.model), numeric=(1,), caption="Noise against misfit"),
        *_drawn_rows(evidence.model),
    )


def _drawn_rows(model: ModelFile) -> list[Html]:
    if model.bootstrap is None:
        return []
    failed = f"; {model.bootstrap.failed} of them did not end" if model.bootstrap.failed else ""
    rounds = f"{model.bootstrap.rounds} refits to rows drawn at random{failed}"
    return [tag("p", f"Sigmas were also found by {rounds}: see the parameters.")]


def _noise(model: ModelFile, rig: Rig) -> Html:
    rows: list[tuple[str, ...]] = []
    for name in [n.removesuffix("_believed") for n in model.noise if n.endswith("_believed")]:
        assumed, found, sigma = (model.noise.get(f"{name}{tail}") for tail in ("_believed", "", "_sigma"))
        if not (isinstance(assumed, float) and isinstance(found, float) and isinstance(sigma, float)):
            continue
        source_of = {**SOURCES, JOINT: OF_JOINTS}.get(name, NoiseSource(name, "m"))
        says, with_sigma = (angle, angle_with_sigma) if source_of.unit == "rad" else (length, length_with_sigma)
        stated = getattr(rig.noise, source_of.key, None) is not None
        source = "rig file" if stated else "assumed: the rig file states none"
        if model.noise.get(f"{name}_at_zero"):
            rows.append((name, says(assumed), source, NONE, ""))
            continue
        rows.append((name, says(assumed), source, with_sigma(found, sigma), fixed(found / assumed, 2)))
    head = ("Noise of", "assumed", "by", "found in the residuals", "found / assumed")
    return table(head, rows, numeric=(1, 3, 4), caption="Noise, one sigma of one coordinate")


def _tests(model: ModelFile) -> Iterator[tuple[str, ...]]:
    found, repeats = scatter(model), repeated(model)
    if (end := fit_end(model)) is not None:
        yield f"Fit by {end[0]}", str(end[1]), f"iterations in all rounds; ended by {end[2]}"
    if found is not None:
        ratio = fixed(found.chi2 / found.dof, 2) if found.dof > 0 else DASH
        said = f"alarm: {found.alarm.value}" if found.alarm is not Alarm.NONE else found.alarm.value
        yield "chi²/dof, noise as assumed", ratio, f"{found.dof} degrees of freedom; {said}"
    if repeats is None:
        yield "Repeats", "none: no pose was repeated, so missing physics cannot be separated from noise"
        return
    yield (
        "Repeats, chi²/dof",
        fixed(repeats.chi2_per_dof, 2),
        f"{repeats.groups} groups, {repeats.dof} degrees of freedom; independent of the arm model",
    )
    if repeats.ratio is not None and repeats.p is not None:
        yield "Lack of fit, F", fixed(repeats.ratio, 2), f"p = {significant(repeats.p, 2)}: {repeats.alarm.value}"
