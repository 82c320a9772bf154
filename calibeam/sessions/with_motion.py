"""A session that runs a motion of all joints and records it, for the torques: nothing is measured on the way.

The arm goes to the start by a planned move, then along the motion, all of its repeats, through the gate that every
motion goes through. Whatever ends it, the arm stands and the recording is readable.
"""

from collections.abc import Callable, Generator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np

from acquisition.errors import InterruptedMotionError, RefusedMotionError
from acquisition.motion.gate import Gate
from acquisition.motion.paths.segments import Segment
from acquisition.motion.plan import Plan, plan
from acquisition.motion.states import MotionState
from acquisition.recording import Event, RecordingWriter, read
from acquisition.recording.mcap import next_part
from acquisition.recording.mcap.layout import MOTION_NOTE
from acquisition.recording.motion_plan import MOTION_EVENT, MotionPlan, no_torque
from acquisition.recording.rig import Rig
from acquisition.wires.streams import Supervisor
from calibeam.console import Console
from calibeam.devices.encoders import encoder_driver
from calibeam.devices.others import other_drivers
from calibeam.devices.recorder import Interrupted, new_recording, stopped
from calibeam.devices.robot import robot_of
from calibeam.devices.site import Kept, pumped, released
from calibeam.live.feed import SILENT
from calibeam.motion.by_hand import draw_plan_file, ending_words, keys_of, said
from calibeam.motion.exciting_motion import check_motion, refuse_slowed, refuse_unclear, segments_of
from calibeam.motion.gate_of_rig import cell_of, gate_of, pace_of, solver_of
from calibeam.motion.robot import StreamedRobot, Track, as_streamed, controller_of, watched_joints
from calibeam.outcome import INTERRUPTS, PartialResult
from calibeam.sessions.person import Person, devices_ready
from calibeam.site_log import SESSION_LOG, SITE_LOG
from calibrate.diagnose.motion import scatter_of_repeats
from drivers.clock import Clock
from drivers.errors import DeviceError

PLAN_PICTURE = "motion.svg"


@dataclass(frozen=True)
class MotionJob:
    """From the command line. `hurry`: device seconds in one of this program's; 1 on site."""

    rig: Rig
    text: str  # of the rig file
    out: Path
    motion: MotionPlan
    motion_text: str
    hurry: float = 1.0


def run_motion(job: MotionJob, person: Person, console: Console, clock: Clock) -> None:
    """Devices, plan, confirmation, motion, scatter of the repeats. PartialResult when it ended early: the arm stands,
    and what was recorded is readable. Before anything moves also what its steps raise.
    """
    job.out.mkdir(parents=True, exist_ok=True)
    SITE_LOG.begin(job.out / SESSION_LOG)
    rig, report = job.rig, person.reporter
    devices_ready(_taking_part(rig), job.hurry, clock, person)
    report.step("plan preview")
    check_motion(rig, job.motion)
    segments, picture = segments_of(rig, job.motion), job.out / PLAN_PICTURE
    with watched_joints(rig, clock) as joints:
        preview = plan(solver_of(rig), joints(), segments, pace_of(rig), cell_of(rig))
    _refuse(rig, preview)
    draw_plan_file(preview, cell_of(rig), picture)
    report.report(f"{job.motion.repeats} repeats of {job.motion.length_s:g} s; {said(preview, picture)}")
    if no_torque(rig):
        report.report(no_torque(rig))
    person.arm()
    report.step("measurement")
    path = next_part(job.out)
    _recorded(job, person, clock, segments, path)
    report.step("results")
    for line in _results(job, path):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
        report.report(line, on_screen=False)


def _taking_part(rig: Rig) -> Rig:
    """With the devices that are recorded."""
    devices = msgspec.structs.replace(rig.devices, psd=None, tracker=None)
    return msgspec.structs.replace(rig, devices=devices, camera=None)


def _recorded(job: MotionJob, person: Person, clock: Clock, segments: Sequence[Segment], path: Path) -> None:
    rig, moved = job.rig, False
    with new_recording(path, job.text, clock, {MOTION_NOTE: job.motion_text}) as writer:
        try:
            with recorded_robot(rig, writer, clock, job.hurry) as robot:
                gate = gate_of(rig, solver_of(rig), robot.arm, clock, hurry=job.hurry)
                made = _planned(job, gate, robot, segments, path)
                moved = True
                try:
                    _drive(job, gate, made, robot, writer, person.reporter.report)
                except Interrupted as why:
                    INTERRUPTS.close()
                    ended = PartialResult(f"{stopped(robot.arm, writer, clock, why)}; {kept_in(path)}")
                    person.reporter.ended_early(ended)
                    raise ended from why
        except DeviceError as why:  # also of a device that does not end as it should
            if moved:
                raise PartialResult(f"{why}; {kept_in(path)}") from why
            raise


def kept_in(path: Path) -> str:
    """Words of a motion that ended early."""
    return f"what was recorded is kept in {path}"


def _planned(job: MotionJob, gate: Gate, robot: StreamedRobot, segments: Sequence[Segment], path: Path) -> Plan:
    """From where the arm stands now. RefusedMotionError: nothing has moved, the next try has the folder for itself."""
    try:
        made = gate.plan(robot.joints(), segments)
        _refuse(job.rig, made)
    except RefusedMotionError:
        path.unlink()
        raise
    return made


def _refuse(rig: Rig, made: Plan) -> None:
    refuse_slowed(made.segments[-1])
    refuse_unclear(rig, made)


def _drive(
    job: MotionJob, gate: Gate, made: Plan, robot: StreamedRobot, writer: RecordingWriter, report: Callable[[str], None]
) -> None:
    """To the end of the plan, or to a stop that was asked for; the event holds when the set-points were where."""
    with keys_of(gate) as keys:
        followed = gate.run(made, robot.joints(), watch=keys.alongside(robot.supervisor.check))
    report(f"{followed.sent} set-points, {followed.missed} cycles missed")
    if gate.state is MotionState.DONE and not followed.cut_short:
        path_s = made.corners_s[1] + made.pace.tacc_s  # when the motion begins
        detail = {
            "length_s": job.motion.length_s,
            "repeats": job.motion.repeats,
            "host_s": [round(clock_s / job.hurry, 4) for clock_s, _ in followed.passed],
            "motion_s": [round(passed_s - path_s, 4) for _, passed_s in followed.passed],
        }
        writer.event(Event(robot.clock.now_s(), MOTION_EVENT, detail))
        return
    raise InterruptedMotionError(ending_words(gate.state, float(np.max(np.abs(robot.joints() - made.q_rad[-1])))))


def _results(job: MotionJob, path: Path) -> list[str]:
    found = scatter_of_repeats(read(path))
    if found is None:
        reason = no_torque(job.rig) or "fewer than two repeats are alike"
        scatter = f"scatter of the torque between repeats: not determined, because {reason}"
    else:
        each = ", ".join("–" if np.isnan(rms) else f"{rms:.2g}" for rms in found.rms_nm)
        scatter = (
            f"scatter of the torque between repeats, joint by joint: {each} Nm rms ({found.used} of {found.repeats} "
            "repeats); repeats give the noise: a model cannot come closer"
        )
    return [f"recording: {path}", scatter, f"next: calibeam diagnose {job.out}"]


@contextmanager
def recorded_robot(rig: Rig, writer: RecordingWriter, clock: Clock, hurry: float = 1.0) -> Generator[StreamedRobot]:
    """Ready for set-points; controller, encoders and other devices go into the recording. A PSD box and a tracker are
    not read: they see nothing while the arm passes. At the end the arm is stopped and every line released.
    RigFileError, DeviceRefused, and every DeviceError.
    """
    device = controller_of(rig)
    robot = robot_of(device, clock, hurry)
    arm = robot.arm()
    streamed = as_streamed(arm, device)
    supervisor = Supervisor(arm.hold, clock)
    kept = Kept(writer, clock, supervisor, SILENT)
    with ExitStack() as cleaning:
        for one in other_drivers(rig.devices.others, clock):
            cleaning.enter_context(pumped(one.device, kept, silence_s=one.silence_s))
        if rig.devices.encoders is not None:
            cleaning.enter_context(pumped(encoder_driver(rig.devices.encoders, clock, hurry=hurry), kept))
        pump = cleaning.enter_context(pumped(robot.reader, kept))
        cleaning.callback(released, arm)
        try:
            arm.connect()
        except DeviceError:
            supervisor.check()  # another device failed meanwhile, and its stop ended this too
            raise
        yield StreamedRobot(streamed, pump, Track(), supervisor, clock)
