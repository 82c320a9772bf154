"""`calibeam rig`: the rig file of a robot, from its URDF, MJCF or D-H table, or from a rig that is shipped."""

import importlib
import importlib.util
import re
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from acquisition.recording.files import shown
from acquisition.recording.output import toml_output, write_output
from acquisition.recording.rig import Rig, parse_rig, rig_text
from calibeam.new_rig.from_dh import dh_table_text
from calibrate.errors import DataError

SHIPPED = Path(__file__).parents[1] / "shipped_rigs"  # geometry and limits with their source, for a tracker
DESCRIPTIONS = "robot_descriptions"  # a package of others; it loads what it does not have from their repositories


def rig_command(
    action: Literal["list", "new"],
    *,
    from_name: Annotated[str | None, Parameter(name="--from")] = None,
    from_urdf: str | None = None,
    from_mjcf: str | None = None,
    from_dh: Path | None = None,
    from_ur_kinematics: Path | None = None,
    base_link: str | None = None,
    tip_link: str | None = None,
    out: Path = Path("rig.toml"),
) -> None:
    """Write the rig file of a robot, or list the robots that are shipped.

    A new rig file is never written over an old one. It has the arm's geometry, limits and, where the source has them,
    masses; target, instrument and signs of the joints are to be checked: docs/robots.md.

    For example:

    ```
    calibeam rig new --from-urdf arm.urdf --tip-link tool0 --out rig.toml
    ```

    Parameters
    ----------
    action
        `list`: the rigs that are shipped. `new`: write a rig file.
    from_name
        A shipped rig, to be copied and adapted.
    from_urdf
        A URDF file (of xacro: expanded), or a name of the package robot_descriptions where it is installed.
    from_mjcf
        A MuJoCo model, or a name of robot_descriptions.
    from_dh
        A D-H table as CSV: `standard; a [mm]; alpha [deg]; d [mm]; theta [deg]`, or `modified; ...`.
    from_ur_kinematics
        The YAML that calibration_correction of ur_calibration writes: the factory calibration of one UR.
    base_link
        Where the arm begins: a link of the URDF, a body of the MJCF; without it, where the file begins.
    tip_link
        Where the arm ends: a link, body or site; without it the end with the most joints in front.
    out
        The rig file to write.

    """
    if action == "list":
        for name in shipped_rigs():
            print(f"{name:24} {first_comment(shipped_text(name))}")
        return
    given = [one for one in (from_name, from_urdf, from_mjcf, from_dh, from_ur_kinematics) if one is not None]
    if len(given) != 1:
        raise DataError("rig new: give one of --from, --from-urdf, --from-mjcf, --from-dh, --from-ur-kinematics")
    if out.exists():
        raise DataError(f"{out} is there already and is not written over; choose another --out")
    if from_name is not None:
        text = shipped_text(from_name)
    elif from_dh is not None:
        text = dh_table_text(from_dh, from_dh.stem)
    elif from_ur_kinematics is not None:
        from calibeam.new_rig.from_urdf import ur_kinematics_rig

        text = ur_kinematics_rig(from_ur_kinematics)
    else:
        text = _of_model(from_urdf, from_mjcf, base_link, tip_link)
    rig = parse_rig(text, str(out))
    write_output(out, text, toml_output(("schema", "arm"), "rig file"))
    print(f"rig: {out} ({_in_words(rig)})")


def _of_model(from_urdf: str | None, from_mjcf: str | None, base_link: str | None, tip_link: str | None) -> str:
    from calibeam.new_rig.drawn import poe_text

    if from_urdf is not None:
        from calibeam.new_rig.from_urdf import urdf_arm

        return poe_text(urdf_arm(_file(from_urdf, "URDF_PATH"), base_link, tip_link))
    from calibeam.new_rig.from_mjcf import mjcf_arm

    return poe_text(mjcf_arm(_file(from_mjcf or "", "MJCF_PATH"), base_link, tip_link))


def _file(name: str, kind: str) -> Path:
    """The file of this name, or the one that robot_descriptions has under it."""
    path = Path(name)
    if path.exists() or not re.fullmatch(r"[a-z0-9_]{1,100}", name) or importlib.util.find_spec(DESCRIPTIONS) is None:
        return path
    try:
        return Path(getattr(importlib.import_module(f"{DESCRIPTIONS}.{name}"), kind))
    except (ImportError, AttributeError) as error:
        raise DataError(f"{shown(name)}: no file, and {DESCRIPTIONS} has no such {kind}: {error}") from error


def _in_words(rig: Rig) -> str:
    masses = sum(joint.mass_kg is not None for joint in rig.arm.joints)
    return f"{rig.n_joints} joints, {rig.arm.model.value}, {masses} with a mass"


def shipped_rigs() -> Mapping[str, Path]:
    """Files by name, in the order of the alphabet."""
    return {path.stem: path for path in sorted(SHIPPED.glob("*.toml"))}


def shipped_text(name: str) -> str:
    """The text of a shipped rig. DataError for an unknown name."""
    rigs = shipped_rigs()
    if name not in rigs:
        near = get_close_matches(name, rigs, 3, 0.4) or list(rigs)
        raise DataError(f"no shipped rig {shown(name)}; there is {', '.join(near)}: calibeam rig list shows all")
    return rig_text(rigs[name])


def first_comment(text: str) -> str:
    """The first line of a rig file, which describes it."""
    return text.splitlines()[0].removeprefix("#").strip()
