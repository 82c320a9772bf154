"""`calibeam session`: the whole job on site, or on emulators that were started beside it."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress
from rich.prompt import Prompt

from acquisition.errors import AcquisitionError
from acquisition.guided.plan import GuidedOptions, planned_visits
from acquisition.plan import PlanOptions
from acquisition.planned_session import check_planned
from acquisition.recording.pose_plan import read_pose_plan
from acquisition.recording.rig import load_rig, rig_text
from acquisition.recording.rig_schema import Rig
from calibeam.camera import camera_sight
from calibeam.conclude import conclude
from calibeam.emulation import ask_emulators
from calibeam.guided.recorded import encoder_address, is_guided
from calibeam.guided.run import plan_of, run_guided
from calibeam.recorded import new_recording, progress_bar, record_session
from calibeam.site import addresses_of, check_session, connected
from drivers.clock import SystemClock


def session(
    rig: Path,
    *,
    out: Path = Path("session"),
    plan: Path | None = None,
    seed: int = 1,
    control: str | None = None,
    time_scale: float = 1.0,
    postures: int = GuidedOptions.postures,
    lengths: int = GuidedOptions.lengths,
    verify: bool = False,
) -> None:
    """Connect, aim, centre, collect, record, identify, diagnose, report. The arm moves: clear the cell first.

    Example: calibeam session rigs/ur5e-dual-psd.toml --out session-1
    Of a measuring arm a person moves the probe, and is guided: rigs/arm-cmm-reference.toml.

    Parameters
    ----------
    rig
        The rig file; [devices] says how each device is reached.
    out
        Folder for recording.mcap, model.json, diagnosis.json and report.html; nothing in it is overwritten.
    plan
        A plan of joint poses, as `calibeam diagnose --plan-out` writes it: these are taken, and no others.
    seed
        Of the poses of a session without a plan.
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
    console, clock = Console(), SystemClock()
    loaded, text = load_rig(rig), rig_text(rig)
    if is_guided(loaded):
        options = GuidedOptions(postures, lengths, seed)
        return _guided(loaded, text, out, plan, options, control, time_scale, console, verify=verify)
    check_session(loaded)
    poses = None if plan is None else read_pose_plan(plan, loaded)
    if poses is not None:
        check_planned(poses)
    addresses, recording = addresses_of(loaded, hurry=time_scale), out / "recording.mcap"
    out.mkdir(parents=True, exist_ok=True)
    bar = progress_bar(console)
    place = _asking(loaded, bar) if control is None else _through(*_host_and_port(control))
    with (
        new_recording(recording, text, clock, {"plan_seed": str(seed)}) as writer,
        camera_sight(loaded, clock) as sight,
        connected(loaded, addresses, writer, clock, place) as bench,
    ):
        summary = record_session(bench, loaded, writer, PlanOptions(seed=seed), clock, bar, poses, sight)
    console.print(f"{len(summary.samples)} samples, {summary.skipped} skipped; recording: {recording}")
    conclude(recording, console)
    return None


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


def _asked(host: str, port: int, verb: str, /, **arguments: Any) -> Any:
    return ask_emulators(host, port, verb, arguments)


def _asking(rig: Rig, bar: Progress) -> Callable[[int], None]:
    """Has a person place the fixture; the bar, which would write over the question, waits."""

    def ask_for(placement: int) -> None:
        where = ", ".join(f"{value:.3f}" for value in rig.placements[placement].psd1_in_base.origin_m)
        bar.stop()
        try:
            Prompt.ask(f"put the fixture at place {placement} (PSD 1 near {where} m in the base), then press Enter")
        except EOFError as end:
            raise AcquisitionError(
                f"place {placement}: nobody can be asked to put the fixture there, standard input is closed; "
                "run the session in a terminal"
            ) from end
        finally:
            bar.start()

    return ask_for


def _through(host: str, port: int) -> Callable[[int], None]:
    """Has the emulated fixture stand at the place."""
    return lambda placement: ask_emulators(host, port, "fixture.place", {"id": placement})


def _host_and_port(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit():
        raise AcquisitionError(f"--control {text}: give HOST:PORT as `calibeam emulate` prints it, 127.0.0.1:40001")
    return host, int(port)
