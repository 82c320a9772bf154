"""An exciting motion at the gate of its rig: whether it is clear, its segments, and what refuses it before it is run.

Clear: above the table and away from keep-out boxes, as every pose that is drawn; no faster than slow areas allow; and
wrist, flange and tool away from the column and the upper arm. Other pairs of links are not compared.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import RefusedMotionError
from acquisition.motion.cell import Body, body_of, body_points
from acquisition.motion.paths.segments import By, Curve, Place, Segment
from acquisition.motion.plan import SAMPLE_S, Plan, plan
from acquisition.recording.motion_plan import MotionPlan
from acquisition.recording.rig import Rig
from calibeam.motion.gate_of_rig import cell_of, pace_of, solver_of
from calibeam.motion.reachable_poses import clear_for_device

Floats = NDArray[np.float64]

LINKS_APART = 2.0  # times the clearance, which is half the thickness of a link
ALONG = 6  # points on the column
TIP_FRAMES = 3  # those of the last two joints, and the flange
START, MOTION = "to the start", "exciting motion"
APPROACH_SLOWER = 4.0  # than the rig's speed: on the way to the start nobody has seen the arm move yet
FEWEST_CHECKED, CHECKED_A_WAVE = 1000, 16  # moments of a repeat: between them a wave rises by 2 % at most


def clear_motion(rig: Rig) -> Callable[[Floats, float], bool]:
    """Of readings (moment, joint) and the time between them (s)."""
    arm, cell = solver_of(rig).arm, cell_of(rig)

    def clear(q_rad: Floats, step_s: float) -> bool:
        frames = arm.frames(q_rad)
        tips = body_points(frames[:, -TIP_FRAMES:], cell.tool_m)
        apart_m = np.linalg.norm(tips[:, :, None] - _first_links(frames, cell.com_m)[:, None], axis=-1)
        if np.min(apart_m) < LINKS_APART * cell.clearance_m:
            return False
        speed_m_s = np.linalg.norm(np.gradient(tips, step_s, axis=0), axis=2)
        for area in cell.slow:
            inside = area.box.distance_m(tips) <= speed_m_s * step_s
            if np.any(speed_m_s[inside] > area.speed_m_s):
                return False
        return bool(np.all(clear_for_device(rig, q_rad)))

    return clear


def _first_links(frames: Floats, com_m: Sequence[tuple[float, float, float] | None]) -> Floats:
    """(moment, point, 3) on the column up to joint 2, on the upper arm, and beside it where its centre of mass is."""
    share = np.linspace(0.0, 1.0, ALONG)[:, None]
    column = frames[:, 0, None, :3, 3] + share * (frames[:, 1, None, :3, 3] - frames[:, 0, None, :3, 3])
    body = body_of(frames[0], (), com_m)
    upper = body.frame == 2
    return np.concatenate([column, Body(body.frame[upper], body.local_m[upper]).at(frames)], axis=1)


def segments_of(rig: Rig, motion: MotionPlan) -> list[Segment]:
    """To where the motion begins, slowly, then all of its repeats."""
    start_rad = motion.at(np.zeros(1))[0]
    place = Place(START, solver_of(rig).flange(start_rad), np.eye(4))
    curve = Curve(lambda t_s: motion.at(np.array([t_s]))[0], motion.total_s)
    return [
        Segment(START, By.JOINTS, place, slower=APPROACH_SLOWER, posture_rad=start_rad),
        Segment(MOTION, By.CURVE, place, curve=curve),
    ]


def check_motion(rig: Rig, motion: MotionPlan) -> None:
    """RefusedMotionError where the rig's gate would not run it as it is, begun where it begins, where it exceeds a
    limit between the samples of a plan, or comes near the arm itself. Nothing moves.
    """
    _check_rates(rig, motion)
    start_rad = motion.at(np.zeros(1))[0]
    made = plan(solver_of(rig), start_rad, segments_of(rig, motion)[1:], pace_of(rig), cell_of(rig))
    refuse_slowed(made.segments[-1])
    refuse_unclear(rig, made)


def refuse_unclear(rig: Rig, made: Plan) -> None:
    """RefusedMotionError where the way to the start or the motion comes near the table, a box or the arm itself."""
    clear = clear_motion(rig)
    for i, name in enumerate(segment.name for segment in made.segments):
        q_rad = made.q_rad[made.segment == i]
        if len(q_rad) > 1 and not clear(q_rad, SAMPLE_S):
            raise RefusedMotionError(
                f"'{name}' is not clear of the table, of a keep-out box, of a slow area or of the arm itself; "
                + ("jog the arm to home_rad first" if name == START else "design it again with calibeam excite")
            )


def _check_rates(rig: Rig, motion: MotionPlan) -> None:
    """By the series itself: samples of a plan are too far apart for its fast waves."""
    waves = len(motion.joint[0].sine_rad)
    t_s = np.linspace(0.0, motion.length_s, FEWEST_CHECKED + CHECKED_A_WAVE * waves)
    limits = ("speed", 1, rig.motion.speed_rad_s), ("acceleration", 2, rig.motion.acceleration_rad_s2)
    shares = [(np.max(np.abs(motion.at(t_s, k)), axis=0) / limit, what) for what, k, limit in limits]
    share, joint, what = max((float(each[j]), j + 1, what) for each, what in shares for j in range(len(each)))
    if share > 1.0:
        raise RefusedMotionError(
            f"joint {joint} of the motion has {share:.2f} times the {what} that [motion] of the rig file allows; "
            "design it again with calibeam excite"
        )


def refuse_slowed(segment: Segment) -> None:
    """RefusedMotionError where a planned motion had to be stretched: it is another one then."""
    if segment.slower > 1.0:
        raise RefusedMotionError(
            f"the motion is {segment.slower:.2f} times too fast for the [motion] of the rig file; design it again with "
            "calibeam excite"
        )
