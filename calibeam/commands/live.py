"""`calibeam live`: a rig's devices on a page in the browser."""

import json
import threading
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from acquisition.recording.rig import Rig, load_rig
from calibeam.geometry_only import read_geometry
from calibrate.errors import DataError
from calibrate.model.model_file import corrections
from drivers.clock import SystemClock


def live_command(
    rig: Path,
    *,
    model: Path | None = None,
    host: str = "127.0.0.1",
    port: int = 8765,
    token: str | None = None,
    foxglove: int | None = None,
    plotjuggler: int | None = None,
    for_s: float | None = None,
    json_: Annotated[bool, Parameter(name="--json")] = False,
) -> None:
    """Show a rig's devices live in the browser, with a STOP button.

    Detectors, robot with its beam, joints and the state of every device.

    For example:

    ```
    calibeam live rigs/ur5e-dual-psd.toml
    calibeam live rigs/ur5e-dual-psd.toml --host 0.0.0.0
    ```

    Nothing is moved or recorded. STOP ends the program that the controller runs; it is no safety stop. A session opens
    the same devices: watch it by `calibeam session RIG.toml --live` instead.

    Parameters
    ----------
    rig
        The rig file; [devices] holds how each device is reached.
    model
        The model.json of an identification, by which the robot and its beam are drawn; else as in the rig file.
    host
        Address to serve at. Any but this machine's own 127.0.0.1 asks for the token that is printed with the address.
    port
        Port to serve at; 0 takes any that is free.
    token
        What the address must hold, instead of one made at random.
    foxglove
        Serve the curves to Foxglove, too, on this port of this machine (8765 is the page's; 8766 is free).
    plotjuggler
        Send the curves to PlotJuggler's UDP Server, too, on this port of this machine (it offers 9870).
    for_s
        End by itself after so many seconds.
    json_
        Print one line of JSON, {"url": ...}, when the page is served.

    """
    from calibeam.live.devices import devices_of, reading
    from calibeam.live.outlets import LiveViews, outlets
    from calibeam.live.page import PageAddress, live_page  # the web server takes a while to load: only here

    loaded, clock = load_rig(rig, needs_arm=False), SystemClock()
    assumed = {} if model is None else _corrections(model, loaded)
    with (
        live_page(loaded, clock, PageAddress(host, port, token), "watch") as page,
        outlets(foxglove, plotjuggler, loaded.name) as (served, says),
    ):
        page.feed.believes(assumed)
        page.feed.also = LiveViews(served, lambda: page.feed.view).heard
        print(json.dumps({"url": page.url}) if json_ else f"live page: {page.url} (Ctrl-C ends it)", flush=True)
        for sentence in () if json_ else says:
            print(sentence, flush=True)
        with reading(devices_of(loaded, clock, page.feed), page.feed):
            threading.Event().wait(for_s)


def _corrections(model: Path, rig: Rig) -> dict[str, float]:
    identified = read_geometry(model)
    if identified.rig.name != rig.name:
        raise DataError(f"{model}: this model is of rig '{identified.rig.name}', not of '{rig.name}'; take its own")
    return corrections(identified)
