"""`calibeam demo`: the whole job on emulated devices, and then the truth that was concealed from it."""

import threading
from importlib import import_module
from pathlib import Path

from rich.console import Console

from acquisition.plan import PlanOptions
from acquisition.recording import RecordingError
from acquisition.recording.rig import load_rig, rig_text
from calibeam.emulation import Emulation
from calibeam.progress_bar import progress_bar
from calibeam.recorded import new_recording, record_session
from calibeam.reveal import print_revealed, reveal
from calibeam.site import addresses_of, check_session, connected
from drivers.clock import SystemClock

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
RECORDING, TRUTH = "recording.mcap", "truth.json"
RESULTS = (RECORDING, "model.json", "diagnosis.json", "report.html", TRUTH)


def demo(*, out: Path = Path("out/demo"), rig: Path = RIG, seed: int = 1, time_scale: float = 8.0) -> None:
    """Run a whole session on emulated devices and show the truth.

    Starts the emulators, records a session, identifies, diagnoses and reports; the truth is opened only after the
    fit. About a minute on two quiet cores.

    Example: calibeam demo --out out/demo

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
    console.print(f"starting the emulators of {rig.name} ({time_scale:g} x real time)")
    # two seconds of libraries that are wanted in the end, loaded while the emulators load theirs
    threading.Thread(target=import_module, args=("calibeam.conclude",), daemon=True).start()
    notes = {"emulation_seed": str(seed), "time_scale": f"{time_scale:g}"}
    with (
        Emulation(rig, seed=seed, time_scale=time_scale, truth=out / TRUTH) as emulation,
        new_recording(out / RECORDING, text, clock, notes) as writer,
        connected(
            loaded, addresses_of(loaded, emulation.address, time_scale), writer, clock, emulation.place_fixture
        ) as bench,
    ):
        summary = record_session(bench, loaded, writer, PlanOptions(), clock, progress_bar(console))
    console.print(f"{len(summary.samples)} samples, {summary.skipped} skipped; recording: {out / RECORDING}")
    from calibeam.conclude import conclude

    identified = conclude(out / RECORDING, console)
    print_revealed(console, reveal(identified.zeros, out / TRUTH))


def _clear(out: Path) -> None:
    """Make the folder, and take away the results of an earlier demo; RecordingError where they are no demo's."""
    if (out / RECORDING).exists() and not (out / TRUTH).exists():
        raise RecordingError(
            f"{out / RECORDING}: not of a demo (no {TRUTH} beside it); choose another folder with --out"
        )
    out.mkdir(parents=True, exist_ok=True)
    for name in RESULTS:
        (out / name).unlink(missing_ok=True)
