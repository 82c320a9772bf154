"""A concealed session that goes the whole way: emulated PSD box, CAN encoders and controller, recorded as on site.

The emulators get what is hidden over their standard input, never through a file; the recording holds the rig as it is
believed, and nothing of the world.
"""

from pathlib import Path

import numpy as np
from rich.console import Console

from acquisition.plan import PlanOptions
from acquisition.recording import Recording, read
from acquisition.recording.rig import parse_rig, plain_rig, rig_text
from calibeam.emulation import EmulationError
from calibeam.outcome import PartialResult
from calibeam.progress_bar import progress_bar
from calibeam.recorded import new_recording, record_session
from calibeam.site import addresses_of, connected
from calibrate.diagnose.streams.sample_times import sample_windows
from drivers.clock import SystemClock
from drivers.errors import DeviceError
from simulators.conceal.case import Case
from simulators.conceal.on_wire import Taken, Wired, draw_wired, taken_case
from simulators.conceal.toml_text import toml_text
from simulators.conceal.wanted import ConcealError, Wanted
from simulators.defects.written import written
from simulators.process import Emulators

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
PACE = 8.0  # emulated seconds in one of ours, as in `calibeam demo`
CENTRED, REPEATS = 2, 2  # a place and order
ORDERS = 2


def conceal_on_wires(wanted: Wanted, path: Path, pace: float = PACE) -> Case:
    """Runs the session; the recording is at `path`. ConcealError where it could not be had."""
    wired = draw_wired(wanted, plain_rig(rig_text(RIG), str(RIG)))
    try:
        _record(wired, path, pace)
    except (PartialResult, DeviceError, EmulationError) as reason:
        raise ConcealError(f"the session on the wires ended early: {reason}") from reason
    return taken_case(wired, _taken(read(path)))


def _record(wired: Wired, path: Path, pace: float) -> None:
    text, clock = toml_text(wired.site_rig), SystemClock()
    rig = parse_rig(text, "rig of the site")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)  # of an attempt that ended early
    block = wired.wanted.samples // (ORDERS * wired.wanted.places)
    each = max(block - 2 * REPEATS - CENTRED, REPEATS)
    options = PlanOptions(centred=CENTRED, off_centre=each, repeats=REPEATS, seed=wired.wanted.seed)
    hidden = written([one.defect for one in wired.hidden])
    with (
        Emulators(wired.emulated, seed=wired.wanted.seed, time_scale=pace, links=False, hidden=hidden) as emulators,
        new_recording(path, text, clock, {}) as writer,
    ):

        def place(placement: int) -> None:
            emulators.ask("fixture.place", id=placement)

        addresses = addresses_of(rig, emulators.address, pace)
        with connected(rig, addresses, writer, clock, place) as bench:
            record_session(bench, rig, writer, options, clock, progress_bar(Console(quiet=True)))


def _taken(recording: Recording) -> Taken:
    """ConcealError where the recording does not say when its samples were taken."""
    samples, windows = recording.samples, sample_windows(recording)
    if windows is None:
        raise ConcealError("the session on the wires took no sample, or does not say when")
    t_s = samples.column("t_s")
    n = range(1, samples.n_joints + 1)
    return Taken(
        t_s=t_s,
        power_on_s=float(np.median([0.5 * (w.from_s + w.to_s) for w in windows] - t_s)),
        reading_rad=samples.joints(),
        approach=np.stack([samples.column(f"approach{i}") for i in n], axis=1),
        placement=samples.integers("placement", 0),
        first_psd=samples.integers("first_psd", 0),
        repeat=samples.integers("repeat", 0),
        spots_m=np.stack([samples.column(f"psd{k}_{axis}_m") for k in (1, 2) for axis in "xy"], axis=1),
    )
