"""`calibeam check`: every device of a rig, or what is in a recording."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from acquisition.recording.rig import load_rig
from calibeam.devices.check import check_devices
from calibeam.outcome import CheckFailed
from calibeam.recording_check import check_recording
from drivers.clock import SystemClock


def check_command(what: Path, *, json_: Annotated[bool, Parameter(name="--json")] = False) -> None:
    """Check every device of a rig, or check a recording; no motion.

    One line a device; the arm does not move. A recording is checked for missing samples, clocks and gross errors.

    Example: calibeam check rigs/ur5e-dual-psd.toml

    Example: calibeam check session-1/recording.mcap

    Each line says what the device is, its firmware, rate and noise, and else what is wrong and what to do. A recording
    is looked through for gaps, wrong order and saturation. Exit code 1 when something is wrong.

    Parameters
    ----------
    what
        A rig file (.toml), a recording (.mcap), or a folder of log segments.
    json_
        Print one line of JSON for each device or file.

    """
    if what.suffix != ".toml":
        if not check_recording(what, as_json=json_):
            raise CheckFailed(f"{what}: something is wrong with it, see above")
        return
    rig = load_rig(what)
    bad: list[str] = []
    for found in check_devices(rig, SystemClock()):
        print(json.dumps(asdict(found)) if json_ else found.line, flush=True)
        bad += [found.device] if found.wrong else []
    if bad:
        raise CheckFailed(f"{', '.join(bad)}: not fit for a session, see above")
