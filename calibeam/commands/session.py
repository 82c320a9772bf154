"""`calibeam session`: the whole job on site, or on emulators that were started beside it."""

from importlib.metadata import version
from pathlib import Path

from rich.console import Console
from rich.prompt import Prompt

from acquisition.plan import PlanOptions
from acquisition.recording.read import read
from acquisition.recording.rig import load_rig, rig_text
from acquisition.recording.writer import RecordingWriter
from calibeam.identification import identify_recording, write_identified
from calibeam.recorded import record_session
from calibeam.site import addresses_of, connected
from calibeam.terminal import print_identified
from calibrate.report.zero_report import write_report
from drivers.clock import SystemClock


def session(rig: Path, *, out: Path = Path("session"), seed: int = 1) -> None:
    """Connect, aim, centre, collect, record, identify, report. The arm moves: clear the cell first.

    Example: calibeam session rigs/ur5e-dual-psd.toml --out session-1

    Parameters
    ----------
    rig
        The rig file; [devices] says how each device is reached.
    out
        Folder for recording.mcap, model.json and report.html; nothing in it is overwritten.
    seed
        Of the pose plan.

    """
    console, clock = Console(), SystemClock()
    loaded, text = load_rig(rig), rig_text(rig)
    out.mkdir(parents=True, exist_ok=True)

    def ask_for(placement: int) -> None:
        place = loaded.placements[placement].psd1_in_base
        where = ", ".join(f"{value:.3f}" for value in place.origin_m)
        Prompt.ask(f"put the fixture at place {placement} (PSD 1 near {where} m in the base), then press Enter")

    with (
        RecordingWriter(
            out / "recording.mcap",
            rig_text=text,
            software=f"calibeam {version('calibeam')}",
            clock=clock,
            notes={"plan_seed": str(seed)},
        ) as writer,
        connected(loaded, addresses_of(loaded), writer, clock, ask_for) as bench,
    ):
        summary = record_session(bench, loaded, writer, PlanOptions(seed=seed), clock, console)
    console.print(f"{len(summary.samples)} samples, {summary.skipped} skipped; recording: {out / 'recording.mcap'}")
    recording = read(out / "recording.mcap")
    identified = identify_recording(recording)
    write_identified(identified, recording, out / "model.json")
    write_report(out / "report.html", recording, identified.zeros, point_constraint=identified.four_poses)
    print_identified(console, identified)
    console.print(f"report: {out / 'report.html'}")
