"""`calibeam report`: (re)write the report of a recording."""

from pathlib import Path

from acquisition.recording.read import read
from calibeam.identification import identify_recording
from calibrate.report.zero_report import write_report


def report_command(recording: Path, *, out: Path = Path("report.html")) -> None:
    """Write one self-contained HTML file: rig, spots, centring, residuals, zeros with sigma, what the data cannot see.

    Example: calibeam report out/demo/recording.mcap --out report.html

    Parameters
    ----------
    recording
        A recording, or a session folder.
    out
        The HTML file to write.

    """
    source = read(recording)
    identified = identify_recording(source)
    write_report(
        out,
        identified.used,
        identified.zeros,
        point_constraint=identified.four_poses,
        left_out=[blunder.says for blunder in identified.blunders],
    )
    print(f"report: {out}")
