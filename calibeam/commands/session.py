"""`calibeam session`: the whole job on site, or on emulators that were started beside it."""

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter
from rich.console import Console

from acquisition.errors import AcquisitionError
from acquisition.guided.plan import GuidedOptions, planned_visits
from acquisition.plan import PlanOptions
from acquisition.recording import RecordingError
from acquisition.recording.mcap import parts
from acquisition.recording.pose_plan import read_pose_plan
from acquisition.recording.rig import Rig, load_rig, rig_text
from calibeam.asking import at_terminal
from calibeam.emulation import ask_emulators, moves_nothing_real
from calibeam.guided.recorded import encoder_address, is_guided
from calibeam.guided.run import plan_of, run_guided
from calibeam.live.feed import SILENT, Feed
from calibeam.session.earlier import Earlier, earlier_of
from calibeam.session.job import Job, with_place
from calibeam.session.places import new_place, with_places
from calibeam.session.run import run_session
from calibeam.site import addresses_of, check_session
from drivers.clock import SystemClock

ACCURACY_UM = 20.0  # as Job.goal_m


@dataclass(frozen=True)
class PageAsked:
    """Whether there is a live page, and where."""

    wanted: bool = False
    host: str = "127.0.0.1"
    port: int = 8765
    token: str | None = None


def session(
    rig: Path,
    *,
    out: Path = Path("session"),
    plan: Path | None = None,
    seed: int = 1,
    continue_: Annotated[bool, Parameter(name="--continue")] = False,
    stands: bool = False,
    place: Annotated[tuple[float, float, float, float] | None, Parameter(negative="")] = None,
    accuracy_um: float = ACCURACY_UM,
    yes: bool = False,
    live: bool = False,
    live_host: str = PageAsked.host,
    live_port: int = PageAsked.port,
    live_token: str | None = PageAsked.token,
    control: str | None = None,
    time_scale: float = 1.0,
    postures: int = GuidedOptions.postures,
    lengths: int = GuidedOptions.lengths,
    verify: bool = False,
) -> None:
    """Run a session: check, plan, align, centre, measure, report.

    Checks the devices, shows the pose plan, asks for confirmation, then aligns, centres, measures, identifies,
    diagnoses and reports.

    Example: calibeam session rigs/ur5e-dual-psd.toml --out session-1
    The arm moves: clear the cell first. SPACE or Ctrl-C pauses, r resumes, s finishes, a aborts, h halts.
    Of a measuring arm a person moves the probe, and is guided: rigs/arm-cmm-reference.toml.

    Parameters
    ----------
    rig
        The rig file; [devices] says how each device is reached.
    out
        Folder for recording.mcap, session.log, the drawing of the plan, model.json, diagnosis.json and report.html;
        a recording in it is never written over, what was found from it is made anew.
    plan
        A plan of joint poses, as `calibeam diagnose --plan-out` writes it: these are taken, and no others.
    seed
        Of the poses of a session without a plan.
    continue_
        Go on with the session in this folder, in a further recording beside the first.
    stands
        With --continue: the fixture has not been touched since. Else it is asked, or counts as moved.
    place
        A further place of the fixture: X Y Z of PSD 1 in the base (m), and its turn about z (degrees).
    accuracy_um
        Predicted error of the beam in free space that is good enough: how many more poses it takes is told.
    yes
        Ask nothing: the cell is clear, the arm may move.
    live
        Also a page for browsers, with spots, arm, devices and a STOP (no safety stop).
    live_host
        Address of the page; anywhere but on loopback it wants a token.
    live_port
        Port of the page; 0 takes any that is free.
    live_token
        Word without which the page is not shown; made at random where one is needed.
    control
        Side channel of emulators, HOST:PORT as `calibeam emulate` prints it: the emulated fixture, or hand, is moved
        through it, instead of asking a person.
    time_scale
        Of the emulators, if it is not 1.
    postures
        Of a measuring arm: readings in each cone.
    lengths
        Of a measuring arm: how often each bar position is measured.
    verify
        Of a measuring arm: take what `calibeam verify` judges by, instead of what the arm is identified from.

    """
    console = Console()
    loaded, text = load_rig(rig), rig_text(rig)
    _check_verify(loaded, plan, verify=verify)
    page = PageAsked(live, live_host, live_port, live_token)
    _check_meant(
        loaded,
        of_robot={
            "--continue": continue_,
            "--stands": stands,
            "--place": place is not None,
            "--accuracy-um": accuracy_um != ACCURACY_UM,
            "--yes": yes,
            "--live": page != PageAsked(),
        },
        of_hand={"--postures": postures != GuidedOptions.postures, "--lengths": lengths != GuidedOptions.lengths},
    )
    if is_guided(loaded):
        options = GuidedOptions(postures, lengths, seed)
        return _guided(loaded, text, out, plan, options, control, time_scale, console, verify=verify)
    check_session(loaded)
    poses = None if plan is None else read_pose_plan(plan, loaded)
    asking = at_terminal()
    job = Job(
        loaded,
        text,
        out,
        addresses_of(loaded, hurry=time_scale),
        PlanOptions(seed=seed),
        poses,
        "" if plan is None else plan.read_text(encoding="utf-8"),
        accuracy_um * 1e-6,
        None if control is None else _through(*_host_and_port(control)),
    )
    earlier = _earlier(job, go_on=continue_, place=place)
    agrees = yes or (control is not None and asking is None and moves_nothing_real(job.addresses.robot))
    with _page(loaded, page, console) as feed:
        run_session(job, console, earlier, feed, asking=asking, agrees=agrees, stands=stands)
    return None


@contextmanager
def _page(rig: Rig, asked: PageAsked, console: Console) -> Generator[Feed]:
    if not asked.wanted:
        yield SILENT
        return
    from calibeam.live.page import PageAddress, live_page  # the server takes half a second to load

    with live_page(rig, SystemClock(), PageAddress(asked.host, asked.port, asked.token)) as page:
        console.print(f"live page: {page.url}", highlight=False, markup=False, soft_wrap=True)
        yield page.feed


def _earlier(job: Job, *, go_on: bool, place: tuple[float, float, float, float] | None) -> Earlier:
    """What was taken already. RecordingError where a session is in the folder and nobody wants to go on with it."""
    if not go_on and parts(job.out):
        raise RecordingError(
            f"{job.out}: holds a session already, and no recording is written over; go on with it by --continue, or "
            "choose another --out"
        )
    earlier = earlier_of(job.out, job.rig) if go_on else Earlier()
    if place is None:
        return earlier
    if job.plan is not None:
        raise AcquisitionError("--place with --plan: a plan names its places itself; give one of them")
    return with_place(earlier, new_place(with_places(job.rig, job.text, earlier.added)[0], place))


def _guided(
    rig: Rig,
    text: str,
    out: Path,
    plan: Path | None,
    options: GuidedOptions,
    control: str | None,
    time_scale: float,
    console: Console,
    *,
    verify: bool,
) -> None:
    """The session of a measuring arm: a person moves the probe, or an emulated hand."""
    poses = None if plan is None else read_pose_plan(plan, rig)
    visits = plan_of(rig, options, verify=verify) if poses is None else planned_visits(poses, rig)
    address = encoder_address(rig, hurry=time_scale, emulated=control is not None)
    ask = None if control is None else partial(_asked, *_host_and_port(control))
    run_guided(rig, text, out, address, visits, console, seed=options.seed, ask=ask, conclude=not verify)


def _check_verify(rig: Rig, plan: Path | None, *, verify: bool) -> None:
    """AcquisitionError where --verify cannot be meant."""
    if verify and not is_guided(rig):
        raise AcquisitionError(f"rig {rig.name}: --verify is of a measuring arm that a hand moves; leave it out")
    if verify and plan is not None:
        raise AcquisitionError(
            f"--plan {plan} with --verify: the standards say which readings a verification takes, a plan those that an "
            "arm is identified from; give one of them"
        )


def _check_meant(rig: Rig, of_robot: Mapping[str, bool], of_hand: Mapping[str, bool]) -> None:
    """AcquisitionError where an option was given that would be ignored for this kind of rig."""
    by_hand = is_guided(rig)
    given = [name for name, is_given in (of_robot if by_hand else of_hand).items() if is_given]
    if given:
        kind = "a rig that a controller moves, and a hand moves this one" if by_hand else "a measuring arm"
        raise AcquisitionError(f"rig {rig.name}: {', '.join(given)}: meant for {kind}; leave out what is named")


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
