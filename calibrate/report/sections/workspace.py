"""The chapter with the error over the workspace, before and after."""

from calibrate.report.elements import Html, figure, section, tag
from calibrate.report.workspace.pictures import Measured, before_and_after
from calibrate.report.workspace.room import Room

TITLE = "Error over the workspace"
LEAD = "How far the tool is from where the controller thinks it is, wherever the arm can go."


def workspace(room: Room | str, measured: Measured | None, why_not_measured: str) -> Html:
    """Pictures; or why there are none. `why_not_measured` is told where `measured` is None."""
    if isinstance(room, str):
        return section("workspace", TITLE, LEAD, tag("p", f"Not drawn: {room}."))
    share = float(room.supported.mean())
    caption = (
        "Left from the side, all directions together (radius: from the base's z axis); right from above, all heights "
        "together. Darker is worse: rms over the poses that bring the target there, one scale for all pictures. "
        "Hatched: the arm gets there, but only with a joint beyond the angles of the session, or where the prediction "
        "leans on the data harder than at the poses of it. Predicted: one sigma by the covariance of the fit and the "
        "scatter of a single pose, as far as the model is right; where base and device stand is left out."
    )
    told = (
        "Measured: distance of each reading from what is expected; for the identified arm each pose is expected from "
        "all other poses. Where measured is worse than predicted, the model lacks something there."
        if measured is not None
        else why_not_measured
    )
    pictures = tag("div", figure(before_and_after(room, measured), f"{caption} {told}"), cls="wide")
    within = f"Of the poses between the joint angles of the session, {share:.0%} are supported."
    return section("workspace", TITLE, LEAD, pictures, tag("p", within))
