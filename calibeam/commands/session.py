"""`calibeam session`: the whole job on site, or on emulators that were started beside it."""

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from acquisition.centring.strategies import CentringBy, CentringChoice
from acquisition.errors import AcquisitionError
from acquisition.guided.plan import GuidedOptions, planned_visits
from acquisition.guided.touch import TouchOptions, TouchPerson
from acquisition.recording import RecordingError
from acquisition.recording.mcap import parts
from acquisition.recording.motion_plan import read_motion_plan
from acquisition.recording.pose_plan import PosePlan, read_pose_plan
from acquisition.recording.rig import Rig, load_rig, rig_text
from acquisition.session.plan import PlanOptions
from acquisition.wires.streams import Supervisor
from calibeam.asking import at_terminal
from calibeam.console import Console
from calibeam.devices.site import addresses_of, check_session, check_tracked_session, is_tracked, tracker_addresses_of
from calibeam.emulation import ask_emulators, moves_nothing_real
from calibeam.guided.recorded import encoder_address, is_guided
from calibeam.guided.run import plan_of, run_guided
from calibeam.live.feed import SILENT, Feed
from calibeam.motion.robot import controller_of
from calibeam.sessions.job import EarlierParts, Job, new_place, read_earlier_parts, with_place, with_places
from calibeam.sessions.person import Person
from calibeam.sessions.reporter import StatusReporter
from calibeam.sessions.views import PlainView
from calibeam.sessions.with_detectors import WithDetectors
from calibeam.site_log import logged
from drivers.clock import SystemClock

ACCURACY_UM = 20.0  # as Job.goal_m
DRAWN_POSES = 40  # of a session with a tracker: twice the rows that 30 parameters of a 6-axis arm need at 3 a row


@dataclass(frozen=True)
class RobotOptions:
    """What is asked of a session on a robot.

    Parameters
    ----------
    continue_
        Go on with the session in this folder, in a further recording beside the first.
    stands
        With --continue: the fixture has not been touched since. Else it is asked, or counts as moved.
    place
        A further place of the fixture: X Y Z of PSD 1 in the base (m), and its turn about z (degrees).
    accuracy_um
        Error of the beam over the workspace that is good enough; the session forecasts the poses that it takes.
    yes
        Ask nothing: the cell is clear, the arm may move.
    centring
        How the beam is centred: law (8) with the fixture pose corrected from every reading, the Jacobian measured by
        four probing moves, or law (8) of the source with the fixture pose as guessed.
    gain
        Of law8: the share of the correction that each step takes, above 0 and up to 1.
    motion
        A motion of all joints, as `calibeam excite` writes it: it is run and recorded for `calibeam diagnose`, and
        nothing is measured on the way.

    """

    continue_: Annotated[bool, Parameter(name="--continue")] = False
    stands: bool = False
    place: Annotated[tuple[float, float, float, float] | None, Parameter(negative="")] = None
    accuracy_um: float = ACCURACY_UM
    yes: bool = False
    centring: CentringBy = CentringBy.REGISTERED
    gain: float = CentringChoice.gain
    motion: Path | None = None

    @property
    def given(self) -> dict[str, bool]:
        """Which of them were given."""
        return {
            "--continue": self.continue_,
            "--stands": self.stands,
            "--place": self.place is not None,
            "--accuracy-um": self.accuracy_um != ACCURACY_UM,
            "--yes": self.yes,
            "--centring": self.centring is not CentringBy.REGISTERED,
            "--gain": self.gain != CentringChoice.gain,
            "--motion": self.motion is not None,
        }


@dataclass(frozen=True)
class PageOptions:
    """Whether there is a live page, and where.

    Parameters
    ----------
    live
        Also a page for browsers, with spots, arm, devices and a STOP (no safety stop).
    live_host
        Address of the page; other than loopback it needs a token.
    live_port
        Port of the page; 0 takes any that is free.
    live_token
        Word without which the page is not shown; made at random where one is needed.

    """

    live: bool = False
    live_host: str = "127.0.0.1"
    live_port: int = 8765
    live_token: str | None = None


@dataclass(frozen=True)
class EmulatorOptions:
    """Where emulators are reached beside their wires.

    Parameters
    ----------
    control
        Side channel of emulators, HOST:PORT as `calibeam emulate` prints it: the emulated fixture, or hand, is moved
        through it, instead of asking a person.
    time_scale
        Of the emulators, if it is not 1.

    """

    control: str | None = None
    time_scale: float = 1.0

    def address(self) -> tuple[str, int] | None:
        """Host and port of the side channel. AcquisitionError for what is none."""
        return None if self.control is None else _host_and_port(self.control)


@dataclass(frozen=True)
class HandOptions:
    """What is asked of a session with a measuring arm.

    Parameters
    ----------
    postures
        Readings in each cone of a measuring arm (72), or with --touch in each socket and on each plane (30).
    lengths
        Of a measuring arm: how often each bar position is measured.
    verify
        Of a measuring arm: take what `calibeam verify` judges by, instead of what the arm is identified from.

    """

    postures: int | None = None
    lengths: int = GuidedOptions.lengths
    verify: bool = False

    @property
    def given(self) -> dict[str, bool]:
        """Which of them were given; --verify has a refusal of its own."""
        return {
            "--postures": self.postures is not None,
            "--lengths": self.lengths != GuidedOptions.lengths,
        }


@dataclass(frozen=True)
class TrackerOptions:
    """What is asked of a session with a tracker.

    Parameters
    ----------
    poses
        Of a tracker: how many poses are drawn, beside repeats.

    """

    poses: int = DRAWN_POSES

    @property
    def given(self) -> dict[str, bool]:
        """Which of them were given."""
        return {"--poses": self.poses != DRAWN_POSES}


@dataclass(frozen=True)
class ContactOptions:
    """What is asked of a session by contact, --touch.

    Parameters
    ----------
    touch
        Calibrate by contact: a person guides the robot, a ball at its flange in sockets; it is not moved from here.
    seats
        With --touch: sockets of the block.
    places
        With --touch: where the block stands, one after the other.
    planes
        With --touch: planes that the ball touches after the sockets.
    distance
        With --touch: distance of the two sockets as measured (m).
    distance_sigma
        With --touch: one sigma of --distance (m).
    seat_sigma
        With --touch: how well the ball sits, one sigma of a coordinate (m). Default: as in the rig file, else 0.0002.
    zero_sigma
        With --touch: one sigma of the joint zeros (rad) that is enough.
    freedrive
        With --touch, of a UR in remote control: freedrive is on while a person guides the arm, off while it is read.

    """

    touch: bool = False
    seats: int = TouchOptions.seats
    places: int = TouchOptions.places
    planes: int = TouchOptions.planes
    distance: float | None = None
    distance_sigma: float = 3e-5
    seat_sigma: float | None = None
    zero_sigma: float = 2e-4
    freedrive: bool = False

    @property
    def given(self) -> dict[str, bool]:
        """Which of them were given without --touch."""
        plain = ContactOptions()
        names = ("seats", "places", "planes", "distance", "distance_sigma", "seat_sigma", "zero_sigma", "freedrive")
        return {f"--{name.replace('_', '-')}": getattr(self, name) != getattr(plain, name) for name in names}


@dataclass(frozen=True)
class Wanted:
    """What every session is asked for, whoever moves the arm."""

    rig: Rig
    text: str
    out: Path
    plan: Path | None
    seed: int
    emulators: EmulatorOptions

    def poses(self) -> tuple[PosePlan | None, str]:
        """Of the plan, and its text."""
        if self.plan is None:
            return None, ""
        return read_pose_plan(self.plan, self.rig), self.plan.read_text(encoding="utf-8")


@logged
def session(
    rig: Path,
    *,
    out: Path = Path("session"),
    plan: Path | None = None,
    seed: int = 1,
    robot: Annotated[RobotOptions, Parameter(name="*")] = RobotOptions(),
    page: Annotated[PageOptions, Parameter(name="*")] = PageOptions(),
    emulators: Annotated[EmulatorOptions, Parameter(name="*")] = EmulatorOptions(),
    hand: Annotated[HandOptions, Parameter(name="*")] = HandOptions(),
    tracker: Annotated[TrackerOptions, Parameter(name="*")] = TrackerOptions(),
    contact: Annotated[ContactOptions, Parameter(name="*")] = ContactOptions(),
) -> None:
    """Run a session: check, plan, align, centre, measure, report.

    Checks the devices, shows the pose plan, asks for confirmation, then aligns, centres, measures, identifies,
    diagnoses and reports.

    For example:

    ```
    calibeam session rigs/ur5e-dual-psd.toml --out session-1
    ```

    The arm moves: clear the cell first. SPACE or Ctrl-C pauses, r resumes, s finishes, a aborts, h halts.
    Of a measuring arm a person moves the probe, and is guided: rigs/arm-cmm-reference.toml.
    With --touch a person guides the robot by hand, and no device measures: docs/without-a-measuring-device.md.

    Parameters
    ----------
    rig
        The rig file; [devices] holds how each device is reached.
    out
        Folder for recording.mcap, session.log, the picture of the plan, model.json, diagnosis.json and report.html;
        a recording in it is never written over, results are computed again.
    plan
        A plan of joint poses, as `calibeam diagnose --plan-out` writes it: these are taken, and no others.
    seed
        Of the poses of a session without a plan.
    robot
        Of an arm that a controller moves.
    page
        Of the live page.
    emulators
        Of emulated devices.
    hand
        Of a measuring arm.
    tracker
        Of a rig with a tracker.
    contact
        Of a session by contact.

    """
    wanted = Wanted(load_rig(rig), rig_text(rig), out, plan, seed, emulators)
    _check_verify(wanted.rig, plan, verify=hand.verify)
    if contact.touch:
        ignored = {name: given for name, given in robot.given.items() if name != "--continue"}
        ignored |= {**tracker.given, "--live": page != PageOptions(), "--plan": plan is not None}
        ignored |= {"--lengths": hand.given["--lengths"], "--verify": hand.verify}
        _refuse_ignored(wanted.rig, ignored, "a session without --touch")
        return _session_by_contact(wanted, contact, hand.postures, Console(), go_on=robot.continue_)
    _refuse_ignored(wanted.rig, contact.given, "a session by contact, --touch")
    of_robot = {**robot.given, "--live": page != PageOptions()}
    if robot.motion is not None:
        ignored = {name: given for name, given in of_robot.items() if name not in ("--yes", "--motion")}
        ignored |= {**hand.given, **tracker.given, "--verify": hand.verify, "--plan": plan is not None}
        _refuse_ignored(wanted.rig, ignored, "a session that measures, and --motion runs a motion")
        return _session_in_motion(wanted, robot.motion, agrees=robot.yes)
    if not is_tracked(wanted.rig):
        _refuse_ignored(wanted.rig, tracker.given, "a rig with a tracker")
    if is_guided(wanted.rig):
        _refuse_ignored(wanted.rig, of_robot, "a rig that a controller moves, and a hand moves this one")
        _session_by_hand(wanted, hand, Console())
    elif is_tracked(wanted.rig):
        of_light = {name: given for name, given in robot.given.items() if name not in ("--yes", "--continue")}
        _refuse_ignored(wanted.rig, {**of_light, **hand.given}, "detectors or a measuring arm; this rig has a tracker")
        _session_with_tracker(wanted, tracker, page, robot)
    else:
        _refuse_ignored(wanted.rig, hand.given, "a measuring arm")
        _session_of_robot(wanted, robot, page, Console())


def _session_of_robot(wanted: Wanted, robot: RobotOptions, page: PageOptions, console: Console) -> None:
    """The session of an arm that a controller moves."""
    check_session(wanted.rig)
    (poses, pose_text), asking = wanted.poses(), at_terminal()
    addresses = addresses_of(wanted.rig, hurry=wanted.emulators.time_scale)
    control = wanted.emulators.address()
    job = Job(
        wanted.rig,
        wanted.text,
        wanted.out,
        addresses,
        PlanOptions(seed=wanted.seed, centring=CentringChoice.asked(robot.centring, robot.gain)),
        poses,
        pose_text,
        robot.accuracy_um * 1e-6,
        None if control is None else _through(*control),
    )
    earlier = _earlier(job, go_on=robot.continue_, place=robot.place)
    agrees = robot.yes or (control is not None and asking is None and moves_nothing_real(addresses.robot))
    with _page(wanted.rig, page, console) as feed:
        WithDetectors(job, console, earlier, feed, asking=asking, agrees=agrees, stands=robot.stands).run()


def _session_with_tracker(wanted: Wanted, tracker: TrackerOptions, page: PageOptions, robot: RobotOptions) -> None:
    """The session of a driven arm whose target a tracker measures."""
    from calibeam.sessions.with_tracker import TrackedJob, WithTracker

    rig, console, control = wanted.rig, Console(), wanted.emulators.address()
    check_tracked_session(rig)
    addresses, asking = tracker_addresses_of(rig, hurry=wanted.emulators.time_scale), at_terminal()
    if not robot.continue_:
        _refuse_begun(wanted.out)
    plan, plan_text = wanted.poses()
    agreed = robot.yes or (control is not None and asking is None and moves_nothing_real(addresses.robot))
    job = TrackedJob(
        rig, wanted.text, wanted.out, addresses, plan, tracker.poses, wanted.seed, plan_text, robot.continue_
    )
    with _page(rig, page, console) as feed:
        WithTracker(job, console, feed, asking=asking, agrees=agreed).run()


def _session_in_motion(wanted: Wanted, motion: Path, *, agrees: bool) -> None:
    """The session that runs a motion and records it."""
    from calibeam.sessions.with_motion import MotionJob, run_motion

    rig, asking, console, clock = wanted.rig, at_terminal(), Console(), SystemClock()
    plan = read_motion_plan(motion, rig)
    _refuse_begun(wanted.out)
    agreed = agrees or (
        wanted.emulators.control is not None and asking is None and moves_nothing_real(controller_of(rig))
    )
    person = Person(console, StatusReporter(rig, clock, (PlainView(console),)), asking, agrees=agreed)
    text, hurry = motion.read_text(encoding="utf-8"), wanted.emulators.time_scale
    run_motion(MotionJob(rig, wanted.text, wanted.out, plan, text, hurry), person, console, clock)


def _session_by_hand(wanted: Wanted, hand: HandOptions, console: Console) -> None:
    """The session of a measuring arm: a person moves the probe, or an emulated hand."""
    rig, verify, (poses, _) = wanted.rig, hand.verify, wanted.poses()
    options = GuidedOptions(
        GuidedOptions.postures if hand.postures is None else hand.postures, hand.lengths, wanted.seed
    )
    visits = plan_of(rig, options, verify=verify) if poses is None else planned_visits(poses, rig)
    encoders = encoder_address(rig, hurry=wanted.emulators.time_scale)
    control = wanted.emulators.address()
    ask = None if control is None else partial(_asked, *control)
    run_guided(rig, wanted.text, wanted.out, encoders, visits, console, seed=wanted.seed, ask=ask, conclude=not verify)


def _session_by_contact(
    wanted: Wanted, contact: ContactOptions, postures: int | None, console: Console, *, go_on: bool
) -> None:
    """The session of a robot that a person guides into sockets; an emulated person where --control is given."""
    from calibeam.guided.touched import (  # the fit takes a second to load
        EmulatedPerson,
        KnownContacts,
        TerminalPerson,
        TouchFolder,
        run_touch,
        touch_rig_text,
    )

    rig, control, asking = wanted.rig, wanted.emulators.address(), at_terminal()
    options = TouchOptions(
        contact.seats, contact.places, contact.planes, TouchOptions.postures if postures is None else postures
    )
    known = KnownContacts(contact.distance, contact.distance_sigma, contact.seat_sigma, contact.zero_sigma)
    text = touch_rig_text(rig, wanted.text, options, known)

    def person(supervisor: Supervisor) -> TouchPerson:
        if control is None and asking is not None:
            return TerminalPerson(asking, console, supervisor)

        def shown(text: str) -> None:
            console.print(text, highlight=False, markup=False, soft_wrap=True)

        home_rad = rig.motion.home_rad or (0.0,) * rig.n_joints
        return EmulatedPerson(partial(_asked, *(control or ("", 0))), shown, home_rad, contact.distance or 0.05)

    if control is None and asking is None:
        raise AcquisitionError("--touch asks a person at the terminal; start it in one, or give --control")
    folder = TouchFolder(wanted.out, rig, text, go_on=go_on)
    hurry = wanted.emulators.time_scale
    run_touch(rig, folder, options, known, console, person, frees=contact.freedrive, hurry=hurry, seed=wanted.seed)


@contextmanager
def _page(rig: Rig, asked: PageOptions, console: Console) -> Generator[Feed]:
    if not asked.live:
        yield SILENT
        return
    from calibeam.live.page import PageAddress, live_page  # the server takes half a second to load

    with live_page(rig, SystemClock(), PageAddress(asked.live_host, asked.live_port, asked.live_token)) as page:
        console.print(f"live page: {page.url}", highlight=False, markup=False, soft_wrap=True)
        yield page.feed


def _earlier(job: Job, *, go_on: bool, place: tuple[float, float, float, float] | None) -> EarlierParts:
    """What was taken already. RecordingError where a session is in the folder and nobody wants to go on with it."""
    if not go_on:
        _refuse_begun(job.out)
    earlier = read_earlier_parts(job.out, job.rig) if go_on else EarlierParts()
    if place is None:
        return earlier
    if job.plan is not None:
        raise AcquisitionError("--place with --plan: a plan names its places itself; give one of them")
    return with_place(earlier, new_place(with_places(job.rig, job.text, earlier.added)[0], place))


def _refuse_begun(out: Path) -> None:
    """RecordingError where a session is in the folder."""
    if parts(out):
        raise RecordingError(
            f"{out}: holds a session already, and no recording is written over; go on with it by --continue, or choose "
            "another --out"
        )


def _check_verify(rig: Rig, plan: Path | None, *, verify: bool) -> None:
    """AcquisitionError where --verify cannot be meant."""
    if verify and not is_guided(rig):
        raise AcquisitionError(f"rig {rig.name}: --verify is of a measuring arm that a hand moves; leave it out")
    if verify and plan is not None:
        raise AcquisitionError(
            f"--plan {plan} with --verify: the standards fix the readings of a verification, a plan those that an "
            "arm is identified from; give one of them"
        )


def _refuse_ignored(rig: Rig, given: Mapping[str, bool], kind: str) -> None:
    """AcquisitionError where an option was given that would be ignored for this kind of rig."""
    names = [name for name, is_given in given.items() if is_given]
    if names:
        raise AcquisitionError(f"rig {rig.name}: {', '.join(names)}: meant for {kind}; leave these options out")


def _asked(host: str, port: int, verb: str, /, **arguments: Any) -> Any:
    return ask_emulators(host, port, verb, arguments)


def _through(host: str, port: int) -> Callable[[int], None]:
    """Has the emulated fixture stand at the place."""
    return lambda placement: ask_emulators(host, port, "fixture.place", {"id": placement})


def _host_and_port(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit():
        raise AcquisitionError(f"--control {text}: give HOST:PORT as `calibeam emulate` prints it, 127.0.0.1:40001")
    return host, int(port)
