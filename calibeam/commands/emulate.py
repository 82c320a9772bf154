"""`calibeam emulate`: the rig's devices as emulators on real wires, until stopped."""

import json
import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from acquisition.recording.output import text_output
from acquisition.recording.rig import Rig, load_rig, plain_rig, rig_text
from calibeam.overwriting import writes
from calibeam.rig_files import rig_path

if TYPE_CHECKING:
    from simulators.defects import Defect
    from simulators.world.truth import Given


@writes(truth=text_output('"joint_zero_rad"', "truth file"))
def emulate(
    rig: Path,
    *,
    json_: Annotated[bool, Parameter(name="--json")] = False,
    robot_host: str | None = None,
    seed: int | None = None,
    time_scale: float | None = None,
    truth: Path | None = None,
    links: bool = True,
    expose: bool = False,
    control_host: str = "127.0.0.1",
    model: Path | None = None,
    hide: Annotated[tuple[str, ...], Parameter(show_default=False)] = (),
    end_with_stdin: Annotated[bool, Parameter(show=False)] = False,
) -> None:
    """Emulate every device of a rig on real wires until Ctrl-C.

    For example:

    ```
    calibeam emulate rigs/ur5e-dual-psd.toml
    calibeam emulate ur5e
    ```

    It prints where each device listens. Send a line of JSON to the address "control" to inject a fault, for example
    with nc 127.0.0.1 PORT. The kinds of faults are listed in docs/protocols/faults.md:

    {"do": "fault.inject", "with": {"device": "psd", "kind": "silence", "count": 100}}

    With the geometry and the physics of a model, or with mechanisms that you name:

    ```
    calibeam emulate rigs/ur5e-dual-psd.toml --model model.json
    calibeam emulate rigs/ur5e-dual-psd.toml --hide "soft-joint joint2 8e-6" --hide "slack-drive joint5 1e-4"
    ```

    Parameters
    ----------
    rig
        The rig file, or the name of a shipped one; devices without a section in [devices] are not emulated.
    json_
        Print one line of JSON when all are ready: where each device listens.
    robot_host
        Address of the controller, 127.0.0.x; "auto" takes the first that is free. Default: as in the rig file.
    seed
        Which concealed truth is drawn. Default: as in the rig file.
    time_scale
        Emulated seconds per real second. Default: as in the rig file.
    truth
        Write the concealed truth to this file.
    end_with_stdin
        End when standard input closes.
    links
        Make the symbolic links to the pseudo-terminals that the rig file names as ports.
    expose
        Let devices listen on addresses that other machines reach. Device protocols know no password.
    control_host
        Address of the side channel. Other than loopback it needs the token that is announced with it.
    model
        A model.json: the emulated rig has its geometry, and a mechanism for each effect that holds on any day.
    hide
        A mechanism to put in: its name, its place (joint2, link3, psd1) and its size in SI units (Nm, rad/Nm, m,
        rad, 1/K); further quantities as key=value. A wrong name lists all of them with their units. May be given
        several times.

    """
    from simulators.serve import ServeOptions, serve  # the physics takes a second to load: only here

    rig = rig_path(rig)
    loaded = load_rig(rig, needs_arm=False)  # reports what is wrong with the file in its own words
    plain = plain_rig(rig_text(rig), str(rig))
    given, mechanisms = _simulated(rig, plain, model, hide)
    options = ServeOptions(
        mechanisms=mechanisms,
        given=given,
        robot_host=robot_host,
        truth_path=truth,
        seed=seed,
        time_scale=time_scale,
        expose=expose,
        control_host=control_host,
        links=links,
        end_with_stdin=end_with_stdin,
    )
    show = _print_json if json_ else partial(_print_table, rig, loaded)
    serve(plain, options, show)


def _simulated(
    rig: Path, plain: Mapping[str, Any], model: Path | None, hide: tuple[str, ...]
) -> tuple["Given | None", "tuple[Defect, ...]"]:
    """Geometry and mechanisms of a model, and those put in by hand. What is left out goes to standard error."""
    if model is None and not hide:
        return None, ()
    from calibeam.simulation.emulated import emulated
    from calibeam.simulation.mechanism_by_hand import (
        by_hand,  # the physics of a model loads the whole catalogue: only here
    )
    from calibrate.errors import DataError
    from calibrate.model.model_file import read_model
    from simulators.defects import WrittenError

    given, found, notes = (
        (None, (), ()) if model is None else emulated(read_model(model), load_rig(rig, needs_arm=False))
    )
    for note in notes:
        print(note, file=sys.stderr, flush=True)
    try:
        return given, (*found, *(by_hand(text, plain) for text in hide))
    except WrittenError as wrong:
        says, _, listed = str(wrong).partition("\n")  # a list of all mechanisms is longer than an error may be
        print(listed, end="\n" * bool(listed), file=sys.stderr, flush=True)
        raise DataError(says) from wrong


def _print_json(where: dict[str, dict[str, Any]]) -> None:
    print(json.dumps(where), flush=True)


def _print_table(rig: Path, loaded: Rig, where: dict[str, dict[str, Any]]) -> None:
    for device, address in where.items():
        print(f"{device:8s}", "  ".join(f"{key} {_words(value)}" for key, value in address.items()), flush=True)
    print("ready; Ctrl-C ends the emulators", flush=True)
    host = None if loaded.devices.robot is None else loaded.devices.robot.host
    standing = where.get("robot", {}).get("host", host)
    if standing != host:
        print(f'first write host = "{standing}" under [devices.robot] of the rig file that clients read', flush=True)
    if loaded.n_joints == 0:
        print(f"a log of them: calibeam log encoders {rig}", flush=True)
    elif "control" in where:
        control = f"{where['control']['host']}:{where['control']['port']}"
        print(f"a session on them: calibeam session {rig} --control {control} --out session-1", flush=True)


def _words(value: Any) -> str:
    return " and ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
