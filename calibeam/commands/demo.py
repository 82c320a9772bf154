"""`calibeam demo`: the whole job on emulated devices, and then the truth that was concealed from it.

The truth is opened only after the fit.
"""

import threading
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated

import numpy as np
from cyclopts import Parameter
from rich.table import Table

from acquisition.recording import RecordingError
from acquisition.recording.rig import load_rig, rig_text
from acquisition.session.plan import PlanOptions
from calibeam.console import Console
from calibeam.devices.recorder import new_recording, record_session
from calibeam.devices.site import addresses_of, check_session, connected
from calibeam.emulation import Emulation
from calibeam.printing.progress import progress_bar
from calibeam.rig_files import RIGS
from calibeam.site_log import SESSION_LOG, SITE_LOG, logged
from calibrate.fit.identify.estimates import JointZero
from drivers.clock import SystemClock
from simulators.world.truth import read_truth


@dataclass(frozen=True)
class ZeroAgainstTruth:
    """One joint: what was reported, what is true. `deviation` is in stated sigmas, None where nothing was reported."""

    joint: int
    value_rad: float | None
    sigma_rad: float | None
    truth_rad: float
    why: str | None

    @property
    def deviation(self) -> float | None:
        if self.value_rad is None or self.sigma_rad is None:
            return None
        return (self.value_rad - self.truth_rad) / self.sigma_rad


def compare_with_truth(zeros: Iterable[JointZero], truth_path: Path) -> tuple[ZeroAgainstTruth, ...]:
    """Every joint zero against the truth file."""
    truth = read_truth(truth_path)
    return tuple(
        ZeroAgainstTruth(zero.joint, zero.value_rad, zero.sigma_rad, truth.joint_zero_rad[zero.joint - 1], zero.why)
        for zero in zeros
    )


def print_against_truth(console: Console, revealed: tuple[ZeroAgainstTruth, ...]) -> None:
    """Identified beside true zeros."""
    table = Table(title="concealed truth, opened after the fit", title_justify="left")
    for heading in ("joint", "identified (deg)", "sigma", "truth (deg)", "off by", "in sigma"):
        table.add_column(heading, justify="right")
    for one in revealed:
        if one.value_rad is None or one.sigma_rad is None or one.deviation is None:
            table.add_row(f"J{one.joint}", "-", "-", f"{np.degrees(one.truth_rad):+z.5f}", "-", "not determined")
            continue
        off_rad = one.value_rad - one.truth_rad
        table.add_row(
            f"J{one.joint}",
            f"{np.degrees(one.value_rad):+z.5f}",
            f"{np.degrees(one.sigma_rad):.5f}",
            f"{np.degrees(one.truth_rad):+z.5f}",
            f"{np.degrees(off_rad):+z.5f}",
            f"{one.deviation:+z.2f}",
        )
    console.print(table)


RIG = RIGS / "ur5e-dual-psd.toml"
ShippedRig = Annotated[Path, Parameter(show_default="rigs/ur5e-dual-psd.toml")]  # not where it is installed
RECORDING, TRUTH = "recording.mcap", "truth.json"
RESULTS = (RECORDING, "model.json", "diagnosis.json", "report.html", TRUTH)


@logged
def demo(*, out: Path = Path("out/demo"), rig: ShippedRig = RIG, seed: int = 1, time_scale: float = 8.0) -> None:
    """Run a whole session on emulated devices and show the truth.

    Starts the emulators, records a session, identifies, diagnoses and reports; the truth is opened only after the
    fit. About a minute on two quiet cores.

    For example:

    ```
    calibeam demo --out out/demo
    ```

    Parameters
    ----------
    out
        Folder for recording.mcap, model.json, diagnosis.json, report.html, and truth.json, which is opened only after
        the fit.
    rig
        The rig file.
    seed
        Which concealed truth the emulated world has.
    time_scale
        Emulated seconds per real second.

    """
    console, clock = Console(), SystemClock()
    loaded, text = load_rig(rig), rig_text(rig)
    check_session(loaded)
    _clear(out)
    SITE_LOG.begin(out / SESSION_LOG)
    console.print(f"starting the emulators of {rig.name} ({time_scale:g} x real time)")
    # two seconds of libraries that are wanted in the end, loaded while the emulators load theirs
    threading.Thread(target=import_module, args=("calibeam.results.session_results",), daemon=True).start()
    notes = {"emulation_seed": str(seed), "time_scale": f"{time_scale:g}"}
    with (
        Emulation(rig, seed=seed, time_scale=time_scale, truth=out / TRUTH) as emulation,
        new_recording(out / RECORDING, text, clock, notes) as writer,
        connected(
            loaded, addresses_of(loaded, emulation.address, time_scale), writer, clock, emulation.place_fixture
        ) as bench,
    ):
        summary = record_session(bench, loaded, writer, PlanOptions(), clock, progress_bar(console))
    console.print(f"samples {len(summary.samples)}, skipped {summary.skipped}; recording: {out / RECORDING}")
    from calibeam.results.session_results import write_session_results

    identified = write_session_results(out / RECORDING, console)
    print_against_truth(console, compare_with_truth(identified.zeros, out / TRUTH))


def _clear(out: Path) -> None:
    """Make the folder, and take away the results of an earlier demo; RecordingError where they are no demo's."""
    if (out / RECORDING).exists() and not (out / TRUTH).exists():
        raise RecordingError(
            f"{out / RECORDING}: not of a demo (no {TRUTH} beside it); choose another folder with --out"
        )
    out.mkdir(parents=True, exist_ok=True)
    for name in RESULTS:
        (out / name).unlink(missing_ok=True)
