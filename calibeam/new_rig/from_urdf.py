"""URDF to an arm: the chain of turning joints between two links, with limits, masses and centres of mass.

Source of the form: ROS wiki, urdf/XML/joint and urdf/XML/link: origin first (xyz in m, rpy in rad about fixed axes),
then the turn about `axis`, in the joint's own frame. Read with ElementTree; a document type or an entity is refused.

The kinematics YAML of a UR holds the origins of the six joints of its URDF, as the factory calibrated that one robot.
Source: ur_calibration, calibration_correction, and ur_macro.xacro (UniversalRobots, Universal_Robots_ROS2_Driver and
..._Description): each joint turns about its z; the first origin is in base_link_inertia, the controller's base.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree  # the text is checked below: no document type, no entities

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from acquisition.recording.files import read_text, shown
from acquisition.recording.files.bounds import FEW
from calibeam.new_rig.drawn import ANY_TURN_RAD, DrawnArm, DrawnJoint, onto_axis, poe_text
from calibrate.apply.export import BODIES
from calibrate.errors import DataError
from calibrate.model.rigid import inverse

Floats = NDArray[np.float64]

TURNING = ("revolute", "continuous")
FLANGES = ("tool0", "flange", "ee_link", "tool_link", "link_ee")  # usual names, where a robot ends in several links
SHORTEST_AXIS = 1e-6
FLANGE = "calibeam_flange"  # of our own export, beside the bodies of UR


@dataclass(frozen=True, eq=False)
class _Joint:
    name: str
    kind: str
    parent: str
    child: str
    T: Floats  # (4, 4)
    axis: Floats  # (3,) unit
    range_rad: tuple[float, float]
    mimics: bool


@dataclass(frozen=True, eq=False)
class _Link:
    mass_kg: float
    com_m: Floats  # (3,)


def urdf_arm(path: Path, base_link: str | None = None, tip_link: str | None = None) -> DrawnArm:
    """The arm of a URDF file. DataError naming file, element and remedy."""
    root = urdf_root(path)
    links = {_name(path, link): _link(path, link) for link in root.findall("link")}
    if (count := len(root.findall("joint"))) > FEW:
        raise DataError(f"{path}: {count} joints; at most {FEW} are read, give the part of the robot with the arm")
    joints = [_joint(path, joint) for joint in root.findall("joint")]
    to_link = {joint.child: joint for joint in joints}
    if len(to_link) != len(joints):
        raise DataError(f"{path}: a link is the child of two joints; a robot with closed loops has no rig file")
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in links:
                raise DataError(f"{path}: joint {shown(joint.name)} names the link {shown(link)}, which is not there")
    base = _chosen_base(path, links, to_link, base_link)
    tip = _chosen_tip(path, links, to_link, base, tip_link)
    chain = _chain(path, to_link, base, tip)
    notes = [f"From {path.name} (URDF), {base} to {tip}."]
    free = [joint.name for joint in chain if joint.kind == "continuous"]
    if free:
        notes.append(f"Continuous joints have no limits there, taken as one turn either way: {', '.join(free)}.")
    return _arm(root.get("name") or path.stem, chain, joints, links, tuple(notes))


def ur_kinematics_rig(path: Path) -> str:
    """The rig file of the UR that a kinematics YAML describes. DataError naming file, body, key and remedy."""
    text, body = read_text(path, "UR kinematics", DataError), ""
    found = dict[str, dict[str, str]]()
    for line in re.split(r"[\n{},]", re.sub("#.*", "", text)):  # blocks, or braces
        key, _, value = (word.strip() for word in line.partition(":"))
        body = body if value or not key else key
        found.setdefault(body, {})[key] = value
    parts = [_ur_part(path, name, found) for name in BODIES]
    flange = _ur_part(path, FLANGE, found) if FLANGE in found else np.eye(4)
    turns = [ANY_TURN_RAD, ANY_TURN_RAD, math.pi, *(ANY_TURN_RAD,) * 3]  # joint_limits.yaml: the elbow half a turn
    says = found[BODIES[-1]].get("hash", "no hash")  # the last line
    notes = f"From {path.name}: a UR as its factory calibrated it ({says}).\nThe file has no masses."
    joints = tuple(DrawnJoint(T, -turn, turn) for T, turn in zip(parts, turns, strict=True))
    return poe_text(DrawnArm(path.stem, joints, flange, (notes,))).replace("[arm]\n", '[arm]\nmake = "ur"\n', 1)


def _ur_part(path: Path, body: str, found: Mapping[str, Mapping[str, str]]) -> Floats:
    keys = ("x", "y", "z", "roll", "pitch", "yaw")
    if missing := [key for key in keys if key not in found.get(body, {})]:
        raise DataError(
            f"{path}: {body}: {missing[0]} is missing; give the whole file that calibration_correction of "
            "ur_calibration writes: kinematics, six bodies with x, y, z, roll, pitch, yaw"
        )
    values = _numbers(f"{path}: {body}", " ".join(found[body][key] for key in keys), len(keys))
    return _turned(values[:3], values[3:])


def xml_root(path: Path, what: str) -> ElementTree.Element:
    """The outer element of a file of a kind such as "URDF file". DataError for what is no XML, or has entities."""
    text = read_text(path, what, DataError)
    for word in ("<!DOCTYPE", "<!ENTITY"):
        if word in text:
            raise DataError(f"{path}: {word} is refused: no {what} needs a document type or entities; remove it")
    try:
        return ElementTree.fromstring(text)  # noqa: S314
    except (ElementTree.ParseError, ValueError) as error:
        raise DataError(f"{path}: no XML: {error}; give a whole {what}") from error


def urdf_root(path: Path) -> ElementTree.Element:
    """The outer element. DataError for another file, and for xacro."""
    root = xml_root(path, "URDF file")
    if root.tag != "robot":
        raise DataError(f"{path}: the outer element is <{shown(root.tag)}>, not <robot>; give a URDF file")
    if any("xacro" in element.tag or "${" in "".join(element.attrib.values()) for element in root.iter()):
        raise DataError(f"{path}: this is a xacro file; expand it first: xacro {path.name} > arm.urdf")
    return root


def _name(path: Path, element: ElementTree.Element) -> str:
    name = element.get("name")
    if not name:
        raise DataError(f"{path}: a <{element.tag}> has no name; correct the file")
    return name


def _link(path: Path, element: ElementTree.Element) -> _Link:
    inertial = element.find("inertial")
    if inertial is None:
        return _Link(0.0, np.zeros(3))
    where = f"{path}: link {shown(_name(path, element))}"
    mass = inertial.find("mass")
    mass_kg = 0.0 if mass is None else _numbers(where, mass.get("value", "0"), 1)[0]
    if mass_kg < 0.0:
        raise DataError(f"{where}: mass {mass_kg:g} kg is negative; correct it")
    return _Link(float(mass_kg), _origin(where, inertial)[:3, 3])


def _joint(path: Path, element: ElementTree.Element) -> _Joint:
    name = _name(path, element)
    where = f"{path}: joint {shown(name)}"
    ends = [element.find(end) for end in ("parent", "child")]
    parent, child = ("" if end is None else end.get("link", "") for end in ends)
    if not parent or not child:
        raise DataError(f"{where} has no parent and child link; correct the file")
    stated = element.find("axis")
    axis = np.array([1.0, 0.0, 0.0]) if stated is None else _numbers(where, stated.get("xyz", "1 0 0"), 3)
    kind, length = element.get("type", ""), float(np.linalg.norm(axis))
    if kind in TURNING and length < SHORTEST_AXIS:
        raise DataError(f"{where}: axis of length {length:g}; give a direction")
    return _Joint(
        name,
        kind,
        parent,
        child,
        _origin(where, element),
        axis / max(length, SHORTEST_AXIS),
        _range(where, element, kind),
        element.find("mimic") is not None,
    )


def _range(where: str, element: ElementTree.Element, kind: str) -> tuple[float, float]:
    if kind != "revolute":
        return -ANY_TURN_RAD, ANY_TURN_RAD
    limit = element.find("limit")
    if limit is None:
        raise DataError(f"{where}: a revolute joint needs <limit lower=... upper=...>; add it")
    lower, upper = (float(_numbers(where, limit.get(end, "0"), 1)[0]) for end in ("lower", "upper"))
    if lower >= upper:
        raise DataError(f"{where}: limits {lower:g} to {upper:g} rad hold no angle; correct them")
    return lower, upper


def _origin(where: str, element: ElementTree.Element) -> Floats:
    """(4, 4) of the element's <origin>."""
    origin = element.find("origin")
    if origin is None:
        return np.eye(4)
    return _turned(*(_numbers(where, origin.get(key, "0 0 0"), 3) for key in ("xyz", "rpy")))


def _turned(origin_m: Floats, rpy_rad: Floats) -> Floats:
    """(4, 4) of an origin and angles about fixed axes."""
    out = np.eye(4)
    out[:3, 3], out[:3, :3] = origin_m, Rotation.from_euler("xyz", rpy_rad).as_matrix()
    return out


def _numbers(where: str, text: str, count: int) -> Floats:
    try:
        values = [float(word) for word in text.split()]
    except ValueError as error:
        raise DataError(f"{where}: {shown(text)} is not {count} numbers; correct it") from error
    if len(values) != count or not all(math.isfinite(value) for value in values):
        raise DataError(f"{where}: {shown(text)} is not {count} finite numbers; correct it")
    return np.array(values)


def _chosen_base(path: Path, links: Mapping[str, _Link], to_link: Mapping[str, _Joint], wanted: str | None) -> str:
    if wanted is not None:
        if wanted not in links:
            raise DataError(f"{path}: no link {shown(wanted)}; there are {shown(', '.join(links))}")
        return wanted
    roots = [name for name in links if name not in to_link]
    if len(roots) != 1:
        raise DataError(f"{path}: {len(roots)} links have no joint in front; name one with --base-link")
    return roots[0]


def _chosen_tip(
    path: Path, links: Mapping[str, _Link], to_link: Mapping[str, _Joint], base: str, wanted: str | None
) -> str:
    """The end with the most turning joints in front; among equal ones the one with a usual name."""
    if wanted is not None:
        if wanted not in links:
            raise DataError(f"{path}: no link {shown(wanted)}; there are {shown(', '.join(links))}")
        return wanted
    parents = {joint.parent for joint in to_link.values()}
    turning = {
        name: sum(joint.kind in TURNING for joint in way)
        for name in links
        if name not in parents and (way := _way(to_link, base, name)) is not None
    }
    most = max(turning.values(), default=0)
    if most == 0:
        raise DataError(f"{path}: no turning joint behind {shown(base)}; name the ends with --base-link and --tip-link")
    ends = [name for name, count in turning.items() if count == most]
    usual = [name for word in FLANGES for name in ends if name.endswith(word)]
    if len(ends) > 1 and not usual:
        raise DataError(f"{path}: the arm ends in {shown(', '.join(ends))}; name one with --tip-link")
    return ends[0] if len(ends) == 1 else usual[0]


def _way(to_link: Mapping[str, _Joint], base: str, tip: str) -> list[_Joint] | None:
    """Joints from base to tip; None where the tip does not hang on the base."""
    out: list[_Joint] = []
    while tip != base:
        if tip not in to_link or len(out) > len(to_link):
            return None
        out.append(to_link[tip])
        tip = out[-1].parent
    return out[::-1]


def _chain(path: Path, to_link: Mapping[str, _Joint], base: str, tip: str) -> list[_Joint]:
    chain = _way(to_link, base, tip)
    if chain is None:
        raise DataError(f"{path}: {shown(tip)} does not hang on {shown(base)}; exchange --base-link and --tip-link")
    for joint in chain:
        if joint.kind not in (*TURNING, "fixed"):
            raise DataError(
                f"{path}: joint {shown(joint.name)} is '{shown(joint.kind)}', and a rig file has turning joints only; "
                "name the part of the arm that turns with --base-link and --tip-link"
            )
        if joint.mimics:
            raise DataError(
                f"{path}: joint {shown(joint.name)} mimics another one; name the part of the arm in front of it with "
                "--tip-link"
            )
    if not any(joint.kind in TURNING for joint in chain):
        raise DataError(f"{path}: no turning joint between {shown(base)} and {shown(tip)}; name other ends")
    return chain


def _arm(
    name: str, chain: list[_Joint], joints: list[_Joint], links: Mapping[str, _Link], notes: tuple[str, ...]
) -> DrawnArm:
    """Fixed joints are taken into the parts; whatever is fixed to a link belongs to its mass."""
    drawn: list[DrawnJoint] = []
    behind = np.eye(4)  # what stands behind the last turn
    for joint in chain:
        behind = behind @ joint.T
        if joint.kind not in TURNING:
            continue
        turn = onto_axis(joint.axis)
        mass_kg, moment = _carried(joint.child, joints, links)
        com_m = turn[:3, :3].T @ (moment / mass_kg) if mass_kg > 0.0 else None
        drawn.append(DrawnJoint(behind @ turn, *joint.range_rad, mass_kg, com_m))
        behind = inverse(turn)
    return DrawnArm(name, tuple(drawn), behind, notes)


def _carried(link: str, joints: list[_Joint], links: Mapping[str, _Link]) -> tuple[float, Floats]:
    """Mass (kg) and mass times centre (3,) of a link and all that is fixed to it, in the link's frame."""
    mass_kg, moment = 0.0, np.zeros(3)
    open_links, seen = [(link, np.eye(4))], {link}
    while open_links:
        name, T = open_links.pop()
        own = links[name]
        mass_kg, moment = mass_kg + own.mass_kg, moment + own.mass_kg * (T[:3, :3] @ own.com_m + T[:3, 3])
        for joint in joints:
            if joint.parent == name and joint.kind == "fixed" and joint.child not in seen:
                seen.add(joint.child)
                open_links.append((joint.child, T @ joint.T))
    return mass_kg, moment
