"""MJCF to an arm, through MuJoCo's own loader: the hinges between the world and a body or site.

Source of the form: MuJoCo documentation, XML reference, body and joint: position and orientation of a body in its
parent, then its joints in order, each about `axis` through `pos`, with angle zero at `ref`.
"""

import importlib
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.files import shown
from acquisition.recording.files.bounds import ANGLE_RAD, LENGTH_M
from calibeam.new_rig.drawn import ANY_TURN_RAD, DrawnArm, DrawnJoint, onto_axis
from calibeam.new_rig.from_urdf import urdf_root, xml_root
from calibrate.errors import DataError
from calibrate.model.rigid import inverse, transform

Floats = NDArray[np.float64]

WORLD = 0
MOST_PARTS = 20_000  # elements of a file, each as often as it is replicated
MOST_NUMBERS = 10_000_000  # of a field of heights, and elements that a file asks for by its sizes
MOST_PIXELS = 8192**2
MOST_MEMORY = 4 * 1024**3  # bytes of a simulation's working memory, which loading a model does not take
DEEPEST = 8  # files within files
SIZES = {  # numbers of which the product is made
    "hfield": ("nrow", "ncol"), "texture": ("width", "height"), "replicate": ("count",), "flexcomp": ("count",),
    "composite": ("count",),
}  # fmt: skip
REPEATING = ("replicate", "flexcomp", "composite")
_SIZE = re.compile(r"\+?([0-9]{1,18})\.?0*([KMGTPEkmgtpe]?)|-1", re.ASCII)


def mjcf_arm(path: Path, base_body: str | None = None, tip: str | None = None) -> DrawnArm:
    """The arm of an MJCF file. DataError naming file and remedy."""
    mujoco, model = mjcf_model(path)
    base = WORLD if base_body is None else _body(mujoco, model, path, base_body)
    end, T_end = _end(mujoco, model, path, tip)
    bodies = _way(model, path, base, end)
    drawn: list[DrawnJoint] = []
    behind = np.eye(4)  # what stands behind the last turn
    free: list[str] = []
    for body in bodies:
        behind = behind @ _frame(model.body_pos[body], model.body_quat[body])
        first = model.body_jntadr[body]
        for joint in range(first, first + model.body_jntnum[body]):
            name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, joint) or f"number {joint + 1}"
            if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
                raise DataError(
                    f"{path}: joint {shown(name)} is no hinge, and a rig file has turning joints only; name the part "
                    "of the arm that turns with --base-link and --tip-link"
                )
            turn = onto_axis(model.jnt_axis[joint])
            turn[:3, 3] = model.jnt_pos[joint]
            ref_rad = float(model.qpos0[model.jnt_qposadr[joint]])
            behind = behind @ turn @ transform((0.0, 0.0, 0.0), (0.0, 0.0, -ref_rad))
            lower, upper = (-ANY_TURN_RAD, ANY_TURN_RAD)
            if model.jnt_limited[joint]:
                lower, upper = model.jnt_range[joint].tolist()
            else:
                free.append(name)
            drawn.append(DrawnJoint(behind, lower, upper))
            behind = inverse(turn)
        if drawn:
            drawn[-1] = _laden(model, drawn[-1], behind, body, bodies)
    if not drawn:
        raise DataError(f"{path}: no hinge on the way to the tip; name other ends with --base-link and --tip-link")
    notes = [f"From {path.name} (MJCF)."]
    if free:
        notes.append(f"Joints without limits there, taken as one turn either way: {', '.join(free)}.")
    return DrawnArm(path.stem, tuple(drawn), behind @ T_end, tuple(notes))


def mjcf_model(path: Path) -> tuple[Any, Any]:
    """MuJoCo, and the model that it makes of an MJCF file. DataError naming file and remedy."""
    if not path.is_file():
        raise DataError(f"{path}: no such file; give an MJCF file")
    _check_sizes(path)
    return _loaded(path, lambda mujoco: mujoco.MjModel.from_xml_path(str(path)))


def urdf_model(path: Path) -> tuple[Any, Any]:
    """The same of a URDF file, without its shapes: its masses are stated, and its meshes are seldom beside it."""
    root = urdf_root(path)
    _check_element(path, root, 1, [MOST_PARTS])
    for link in root.findall("link"):
        for shape in (*link.findall("visual"), *link.findall("collision")):
            link.remove(shape)
    text = ElementTree.tostring(root, encoding="unicode")
    return _loaded(path, lambda mujoco: mujoco.MjModel.from_xml_string(text))


def _loaded(path: Path, load: Callable[[Any], Any]) -> tuple[Any, Any]:
    mujoco: Any = importlib.import_module("mujoco")  # its stubs lack most names
    try:
        model = load(mujoco)
    except (ValueError, mujoco.FatalError) as error:
        raise DataError(f"{path}: MuJoCo cannot load it: {' '.join(str(error).split())}; correct the file") from error
    _check_bounds(path, model)
    return mujoco, model


def _check_sizes(path: Path, depth: int = 0) -> None:
    """DataError for what would make MuJoCo ask for memory without end; files that it includes are read, too."""
    root = xml_root(path, "MJCF file")
    _check_element(path, root, 1, [MOST_PARTS])
    for element in root.iter():
        name = element.get("file", "")
        if element.tag not in ("include", "model") or not name:
            continue
        if depth == DEEPEST:
            raise DataError(f"{path}: files include each other more than {DEEPEST} deep; write one file")
        if (other := path.parent / name).is_file():
            _check_sizes(other, depth + 1)


def _check_element(path: Path, element: Element, times: int, left: list[int]) -> None:
    """`times`: how often it is made; `left`: how many parts may still be made."""
    counts = [_size(path, element, name) for name in SIZES.get(element.tag, ())]
    if element.tag == "size":
        counts = [sum(_size(path, element, name) for name in element.attrib if name != "memory")]
        if _size(path, element, "memory") > MOST_MEMORY:
            raise DataError(f"{path}: <size memory>: more than {MOST_MEMORY >> 30} GB; make it smaller")
    most = {"texture": MOST_PIXELS, **dict.fromkeys(REPEATING, MOST_PARTS)}.get(element.tag, MOST_NUMBERS)
    if (count := math.prod(counts)) > most:
        said = " ".join(f'{name}="{shown(value, 20)}"' for name, value in element.attrib.items() if name != "name")
        raise DataError(f"{path}: <{element.tag} {shown(said, 80)}>: at most {most} are read; make it smaller")
    times *= count if element.tag in REPEATING else 1
    left[0] -= times
    if left[0] < 0:
        raise DataError(f"{path}: more than {MOST_PARTS} parts, replicated ones counted; give the arm alone")
    for child in element:
        _check_element(path, child, times, left)


def _size(path: Path, element: Element, name: str) -> int:
    """The product of an attribute's whole numbers, with units of memory as MuJoCo has them; 1 where there is none."""
    out = 1
    for word in element.get(name, "").split():
        if (match := _SIZE.fullmatch(word)) is None:
            raise DataError(f"{path}: <{element.tag} {name}={shown(word, 20)}>: no whole number; correct it")
        out *= max(1, int(match[1] or 1)) * 1024 ** " KMGTPE".index((match[2] or " ").upper())
    return out


def _check_bounds(path: Path, model: Any) -> None:
    """DataError for numbers of which no rig file could be made; MuJoCo itself takes any."""
    lengths = (model.body_pos, model.body_ipos, model.jnt_pos, model.site_pos)
    for all_of, most, unit in ((lengths, LENGTH_M, "m"), ((model.qpos0, model.jnt_range), ANGLE_RAD, "rad")):
        worst = np.abs(np.concatenate([np.ravel(one) for one in all_of])).max(initial=0.0)
        if not worst <= most:
            raise DataError(f"{path}: {worst:g} {unit} stands in it, which no arm has; correct the number")
    for units in (model.body_quat, model.site_quat, model.jnt_axis):
        if not np.all(np.abs(np.linalg.norm(units, axis=1) - 1.0) < 1e-6):
            raise DataError(f"{path}: a quaternion or an axis in it has no direction; correct it")


def _laden(model: Any, joint: DrawnJoint, T: Floats, body: int, bodies: list[int]) -> DrawnJoint:
    """The joint with the mass of a body, and of those that are fixed to it; T is the body behind the turn."""
    mass_kg, moment = _carried(model, body, T, bodies)
    before = np.zeros(3) if joint.com_m is None else joint.mass_kg * joint.com_m
    whole = joint.mass_kg + mass_kg
    com_m = (before + moment) / whole if whole > 0.0 else None
    return DrawnJoint(joint.T, joint.lower_rad, joint.upper_rad, whole, com_m)


def _carried(model: Any, body: int, T: Floats, bodies: list[int]) -> tuple[float, Floats]:
    mass_kg = float(model.body_mass[body])
    moment = mass_kg * (T[:3, :3] @ model.body_ipos[body] + T[:3, 3])
    for child in range(1, model.nbody):
        if model.body_parentid[child] == body and model.body_jntnum[child] == 0 and child not in bodies:
            more_kg, more = _carried(model, child, T @ _frame(model.body_pos[child], model.body_quat[child]), bodies)
            mass_kg, moment = mass_kg + more_kg, moment + more
    return mass_kg, moment


def _end(mujoco: Any, model: Any, path: Path, tip: str | None) -> tuple[int, Floats]:
    """The last body, and the tip in it; without a name the body with the most hinges in front."""
    if tip is None:
        counts = {body: _hinges(model, body) for body in range(1, model.nbody)}
        if not counts:
            raise DataError(f"{path}: there is no body in it; give an arm")
        most = max(counts.values())
        parents = set(model.body_parentid.tolist())
        ends = [body for body, count in counts.items() if count == most and body not in parents]
        if len(ends) != 1:
            names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body) or str(body) for body in ends]
            raise DataError(f"{path}: the arm ends in {shown(', '.join(names))}; name one with --tip-link")
        return ends[0], np.eye(4)
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, tip)
    if site >= 0:
        return int(model.site_bodyid[site]), _frame(model.site_pos[site], model.site_quat[site])
    return _body(mujoco, model, path, tip), np.eye(4)


def _hinges(model: Any, body: int) -> int:
    count = 0
    while body != WORLD:
        count += int(model.body_jntnum[body])
        body = int(model.body_parentid[body])
    return count


def _body(mujoco: Any, model: Any, path: Path, name: str) -> int:
    found = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    if found < 0:
        raise DataError(f"{path}: no body or site {shown(name)}; name one of the file")
    return int(found)


def _way(model: Any, path: Path, base: int, end: int) -> list[int]:
    out: list[int] = []
    while end != base:
        if end == WORLD:
            raise DataError(f"{path}: the tip does not hang on the base; exchange --base-link and --tip-link")
        out.append(end)
        end = int(model.body_parentid[end])
    return out[::-1]


def _frame(position_m: Floats, quaternion: Floats) -> Floats:
    out = np.eye(4)
    out[:3, :3] = Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
    out[:3, 3] = position_m
    return out
