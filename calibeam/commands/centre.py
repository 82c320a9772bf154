"""`calibeam centre`: one centring by hand, from where the arm stands."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from cyclopts import Parameter
from rich.table import Table

from acquisition.centring.strategies import CentringBy, CentringChoice
from acquisition.errors import AcquisitionError
from acquisition.recording.rig import Rig, load_rig, rig_text
from calibeam.asking import YES, at_terminal, someone
from calibeam.console import Console
from calibeam.devices.recorder import RecordingJournal, new_recording
from calibeam.devices.site import addresses_of, check_session, connected
from calibeam.outcome import CheckFailed, PartialResult, interruption
from calibeam.site_log import SITE_LOG, logged, site_log_of
from drivers.clock import SystemClock

if TYPE_CHECKING:
    from acquisition.centring.loop import Centring

SETTLE_S = 0.05


@logged
def centre_command(
    rig: Path,
    *,
    first: int = 1,
    spots_mm: Annotated[tuple[float, float, float, float], Parameter(negative="")] = (0.0, 0.0, 0.0, 0.0),
    tolerance_um: float = 5.0,
    centring: CentringBy = CentringBy.REGISTERED,
    gain: float = CentringChoice.gain,
    placement: int | None = None,
    aim: bool = False,
    out: Path = Path("out/centre.mcap"),
    time_scale: float = 1.0,
    yes: bool = False,
) -> None:
    """Centre the beam once, from where the arm stands.

    Where it is dark, the light is searched first: a spiral of some centimetres. Clear the cell first. Ctrl-C stops.

    For example:

    ```
    calibeam centre rigs/ur5e-dual-psd.toml --first 2 --centring measured
    ```

    Parameters
    ----------
    rig
        The rig file; [devices] holds how each device is reached.
    first
        Which detector the beam strikes first, 1 or 2.
    spots_mm
        Where the spots shall be: x and y on PSD 1, x and y on PSD 2.
    tolerance_um
        On each of the four coordinates.
    centring
        Law (8) with the fixture pose corrected from every reading, the Jacobian measured by four probing moves, or
        law (8) of the source with the fixture pose as guessed.
    gain
        Of law8: the share of the correction that each step takes, above 0 and up to 1.
    placement
        Where the fixture stands now; default: the first one of the rig file.
    aim
        First go before the fixture, as a session does: through the rig's home_rad.
    out
        The recording, with every step as an event; it is not written over. Its log stands beside it.
    time_scale
        Of the emulators, if it is not 1.
    yes
        Do not ask before moving.

    """
    loaded, clock, console = load_rig(rig), SystemClock(), Console()
    check_session(loaded)
    choice = CentringChoice.asked(centring, gain)
    place, spots_m = _checked(loaded, first, spots_mm, tolerance_um, placement)
    if not yes:
        someone(at_terminal(), "whether the arm may move", YES).may_move()
    from acquisition.centring.aim import BeamTarget
    from acquisition.centring.loop import Limits
    from acquisition.centring.navigator import FINDING_STAND_OFF_M, Navigator
    from calibeam.learner import FittedLearner

    out.parent.mkdir(parents=True, exist_ok=True)
    SITE_LOG.begin(site_log_of(out))
    try:
        with (
            new_recording(out, rig_text(rig), clock, {"purpose": "centring"}) as writer,
            connected(loaded, addresses_of(loaded, hurry=time_scale), writer, clock, lambda _: None) as bench,
        ):
            standing_rad = bench.look(SETTLE_S).q_rad
            journal = RecordingJournal(writer, clock)
            navigator = Navigator(bench, FittedLearner(loaded), journal, standing_rad, 1, centring=choice)
            if aim:
                navigator.move(np.array(loaded.motion.home_rad))
                navigator.find(place, first, 0.0)
            target = BeamTarget(first, spots_m, FINDING_STAND_OFF_M, 0.0)
            limits = Limits(tolerance_m=tolerance_um * 1e-6, step_rad=loaded.motion.step_limit_rad)
            run = navigator.centre_here(place, target, limits)
    except KeyboardInterrupt as why:
        raise PartialResult(f"{interruption(why)}; the arm stands, the steps until then are in {out}") from why
    _print_run(console, run)
    console.print(f"recording: {out}", soft_wrap=True, markup=False)
    if run.status.name != "CENTRED":
        raise CheckFailed(f"not centred: {run.status.value}")


def _checked(
    rig: Rig, first: int, spots_mm: tuple[float, float, float, float], tolerance_um: float, placement: int | None
) -> tuple[int, tuple[float, float, float, float]]:
    """The placement and the wanted spots (m). AcquisitionError for what no face or rig has."""
    if first not in (1, 2):
        raise AcquisitionError(f"--first {first}: the detector that the beam strikes first is 1 or 2")
    if not tolerance_um > 0.0:
        raise AcquisitionError(f"--tolerance-um {tolerance_um:g}: above 0")
    from calibrate.model.dual_psd_rig import fixture_of

    half_mm = 1e3 * fixture_of(rig).half_size_m
    outside = [value for value in spots_mm if not abs(value) < half_mm]
    if outside:
        raise AcquisitionError(f"--spots-mm {outside[0]:g}: outside the face, which is {half_mm:g} mm from its centre")
    place = next(iter(rig.placements)) if placement is None else placement
    if place not in rig.placements:
        raise AcquisitionError(f"--placement {place}: the rig has {', '.join(map(str, rig.placements))}")
    x1, y1, x2, y2 = (1e-3 * value for value in spots_mm)
    return place, (x1, y1, x2, y2)


def _print_run(console: Console, run: "Centring") -> None:
    """The outcome, then a line a step: what it was for, how far the joints went, where the spots are."""
    console.print(f"{run.strategy}: {run.status.value} ({run.steps} steps)", soft_wrap=True, markup=False)
    table = Table("step", "for", "largest joint step (mrad)", "PSD 1 x, y (µm)", "PSD 2 x, y (µm)", box=None)
    before = run.trace[0].q_rad
    for number, step in enumerate(run.trace):
        x1, y1, x2, y2 = (f"{1e6 * value:z.1f}" if np.isfinite(value) else "dark" for value in step.spots_m)
        moved = f"{1e3 * float(np.max(np.abs(step.q_rad - before))):.3f}"
        table.add_row(str(number), step.purpose, moved, f"{x1}, {y1}", f"{x2}, {y2}")
        before = step.q_rad
    console.print(table)
