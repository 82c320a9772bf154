"""What to expect of the arm anywhere in its workspace, as the covariance predicts it."""

from calibrate.model_file import FreeSpaceRecord
from calibrate.report.elements import Html, bullets, table, tag
from calibrate.report.quantities import DASH, length


def free_space(found: FreeSpaceRecord | None) -> list[Html]:
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
            "identified geometry alone",
            *_three(found.rms_m, found.p95_m, found.max_m),
            "what a better fit could still win",
        ),
        ("a single pose", *_three(found.pose_rms_m, found.pose_p95_m, found.pose_max_m), f"with {found.scatter}"),
    ]
    caption = f"Predicted error of the target, one sigma, {found.poses} poses drawn evenly between the joint limits"
    head = ("Error of", "rms", "95 %", "largest", "holds")
    note = (
        "As far as the model is right: what it lacks is not in these figures, but it is in those of unseen rows. "
        "Where base and device stand is no error of the arm and is left out."
    )
    return [table(head, rows, numeric=(1, 2, 3), caption=caption), tag("p", note, cls="lead"), *_guessed(found)]


def _three(*values_m: float | None) -> tuple[str, ...]:
    return tuple(DASH if value is None else length(value) for value in values_m)


def _because(found: FreeSpaceRecord) -> list[Html]:
    return [bullets(found.undetermined)] if found.undetermined else []


def _guessed(found: FreeSpaceRecord) -> list[Html]:
    if not found.guessed:
        return []
    listed = "; ".join(found.guessed)
    return [tag("p", f"Known no better than their plausible size, and counted as that: {listed}.")]
