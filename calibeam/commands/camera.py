"""`calibeam camera`: lens, mount and beam of the camera on the flange, from a short tour round the board."""

from pathlib import Path

from acquisition.recording import RigFileError
from acquisition.recording.rig import load_rig, rig_text
from calibeam.asking import YES, at_terminal, someone
from calibeam.console import Console
from calibeam.devices.recorder import new_recording
from calibeam.devices.site import addresses_of, check_session, connected
from calibeam.outcome import CheckFailed
from calibeam.overwriting import writes
from calibeam.site_log import SITE_LOG, logged
from drivers.clock import SystemClock


@writes("out")
@logged
def camera_command(
    rig: Path, *, out: Path = Path("camera"), placement: int | None = None, time_scale: float = 1.0, yes: bool = False
) -> None:
    """Calibrate the camera with a tour of the arm round a board.

    The arm goes round the board, then into the light in both beam orders. Clear the cell first.

    For example:

    ```
    calibeam camera rigs/ur5e-dual-psd-camera.toml --out out/camera
    ```

    The tour begins where the arm stands, if the camera sees the board from there, else in front of where the rig file
    has the fixture. Name the file camera.json in [camera] calibration: sessions then aim by it.

    Parameters
    ----------
    rig
        The rig file; [camera] holds how it is reached and roughly how it is mounted.
    out
        Folder for camera.json, recording.mcap and camera.log; nothing in it is overwritten.
    placement
        Where the fixture stands now; default: the first one of the rig file.
    time_scale
        Of the emulators, if it is not 1.
    yes
        Do not ask before moving.

    """
    loaded, text, clock, console = load_rig(rig), rig_text(rig), SystemClock(), Console()
    check_session(loaded)
    if loaded.camera is None:
        raise RigFileError(
            f"rig {loaded.name}: no [camera]; add how it is reached and [camera.board], the board on the fixture"
        )
    if not yes:
        someone(at_terminal(), "whether the arm may move", YES).may_move()
    from acquisition.centring.camera.measuring import CameraMeasuring
    from acquisition.centring.camera.model import write_model
    from calibeam.devices.instruments import open_camera
    from calibeam.devices.recorder import RecordingJournal
    from calibeam.learner import FittedLearner
    from calibeam.software import SOFTWARE

    out.mkdir(parents=True, exist_ok=True)
    SITE_LOG.begin(out / "camera.log")
    with (
        open_camera(loaded.camera, clock) as eye,
        new_recording(out / "recording.mcap", text, clock, {"purpose": "camera"}) as writer,
        connected(loaded, addresses_of(loaded, hurry=time_scale), writer, clock, lambda _: None) as bench,
    ):
        journal = RecordingJournal(writer, clock)
        measuring = CameraMeasuring(bench, FittedLearner(loaded), eye, loaded.camera, journal)
        measured = measuring.run(next(iter(loaded.placements)) if placement is None else placement)
    if measured.model is None or measured.fit is None:
        raise CheckFailed(f"{measured.views} of {measured.stops} views: {measured.says}; nothing was written")
    write_model(out / "camera.json", measured.model, measured.fit, loaded.name, SOFTWARE)
    console.print(f"{measured.says}; written to {out / 'camera.json'}", soft_wrap=True)
