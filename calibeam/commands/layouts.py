"""`calibeam layouts`: layouts with which Foxglove and PlotJuggler open a recording, nothing to be set up by hand."""

from pathlib import Path

import msgspec

from calibeam.layouts.foxglove import foxglove_layout
from calibeam.layouts.plotjuggler import plotjuggler_layout
from calibeam.layouts.views import views_of

FOXGLOVE, PLOTJUGGLER = "foxglove.json", "plotjuggler.xml"


def layouts_command(recording: Path, *, out: Path = Path("layouts")) -> None:
    """Write Foxglove and PlotJuggler layouts for a recording.

    They show what this recording holds: detectors, spots, joints, encoders.

    Foxglove: open the recording, then Layouts, Import from file. PlotJuggler: Data, then Layout, Load. They fit every
    recording of the same rig.

    For example:

    ```
    calibeam layouts out/demo/recording.mcap --out out/layouts
    ```

    Parameters
    ----------
    recording
        A recording (.mcap).
    out
        The folder to write foxglove.json and plotjuggler.xml to.

    """
    views = views_of(recording)
    out.mkdir(parents=True, exist_ok=True)
    (out / FOXGLOVE).write_bytes(msgspec.json.format(msgspec.json.encode(foxglove_layout(views)), indent=1) + b"\n")
    (out / PLOTJUGGLER).write_text(plotjuggler_layout(views), encoding="utf-8")
    for name in (FOXGLOVE, PLOTJUGGLER):
        print(f"layout: {out / name}")
