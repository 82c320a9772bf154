"""`calibeam demo`: the whole job on emulated devices, and then the truth that was concealed from it."""

from importlib.metadata import version
from pathlib import Path

from rich.console import Console

from acquisition.plan import PlanOptions
from acquisition.recording.read import read
from acquisition.recording.rig import load_rig, rig_text
from acquisition.recording.writer import RecordingWriter
from calibeam.emulation import Emulation
from calibeam.identification import identify_recording, write_identified
from calibeam.recorded import fresh, record_session
from calibeam.reveal import reveal
from calibeam.site import addresses_of, connected
from calibeam.terminal import print_identified, print_revealed
from calibrate.report.zero_report import write_report
from drivers.clock import SystemClock

RIG = Path(__file__).parents[2] / "rigs" / "ur5e-dual-psd.toml"
RESULTS = ("recording.mcap", "model.json", "report.html", "truth.json")


def demo(*, out: Path = Path("out/demo"), rig: Path = RIG, seed: int = 1, time_scale: float = 8.0) -> None:
    """Emulated rig, whole session, report; then the concealed truth. Under a minute.

    Example: calibeam demo --out out/demo

    Parameters
    ----------
    out
        Folder for recording.mcap, model.json, report.html, and truth.json, which is opened only after the fit.
    rig
        The rig file.
    seed
        Which concealed truth the emulated world has.
    time_scale
        Emulated seconds per real second.

    """
    console, clock = Console(), SystemClock()
    fresh(out, RESULTS)
    loaded, text = load_rig(rig), rig_text(rig)
    console.print(f"starting the emulators of {rig.name} ({time_scale:g} x real time)")
    with (
        Emulation(rig, seed=seed, time_scale=time_scale, truth=out / "truth.json") as emulation,
        RecordingWriter(
            out / "recording.mcap",
            rig_text=text,
            software=f"calibeam {version('calibeam')}",
            clock=clock,
            notes={"emulation_seed": str(seed), "time_scale": f"{time_scale:g}"},
        ) as writer,
        connected(
            loaded, addresses_of(loaded, emulation.address, time_scale), writer, clock, emulation.place_fixture
        ) as bench,
    ):
        summary = record_session(bench, loaded, writer, PlanOptions(), clock, console)
    console.print(f"{len(summary.samples)} samples, {summary.skipped} skipped; recording: {out / 'recording.mcap'}")
    recording = read(out / "recording.mcap")
    identified = identify_recording(recording)
    write_identified(identified, recording, out / "model.json")
    print_identified(console, identified)
    write_report(out / "report.html", recording, identified.zeros, point_constraint=identified.four_poses)
    print_revealed(console, reveal(identified.zeros, out / "truth.json"))
    console.print(f"report: {out / 'report.html'}")
