"""What must hold between the keys of a rig file, beyond the type of each one.

Every rule yields faults as (key path, what is wrong and what to do); the reader adds file and line. First the arm, the
tool, the places and the artefacts, then [devices.psd] and [devices.encoders] for each driver, then [devices.robot]: a
UR controller has an address, a Modbus one a register map.
"""

import math
from collections.abc import Iterator

from acquisition.recording.files.bounds import ARM_M
from acquisition.recording.files.explain import KeyPath, in_metres, section
from acquisition.recording.rig.devices import (
    HARDWARE_STAMPS,
    STAMPS_WHEN_ASKED,
    EncoderDriver,
    EncodersDevice,
    PsdDevice,
    PsdDriver,
    PsdHead,
    RobotDevice,
    RobotDriver,
    TrackerDevice,
    TrackerDriver,
)
from acquisition.recording.rig.schema import ArmModel, Joint, Pose, Rig

Fault = tuple[KeyPath, str]

# Frames of what an arm or a fixture carries; those of what stands in the room may be farther away.
_CARRIED: tuple[KeyPath, ...] = (
    ("arm", "flange"),
    ("arm", "base"),
    ("fixture", "psd2_in_psd1"),
    ("camera", "in_flange"),
    ("camera", "board", "in_psd1"),
)

_DH_KEYS = ("a_m", "alpha_rad", "d_m", "theta_offset_rad")
_POE_KEYS = ("origin_m", "rotation_rad")

PSD: KeyPath = ("devices", "psd")
ENCODERS: KeyPath = ("devices", "encoders")
ROBOT: KeyPath = ("devices", "robot")
TRACKER: KeyPath = ("devices", "tracker")
KPA101_MOST_HZ = 400.0  # two units on lines of 115200 baud
DAQ_ONLY = ("port", "serial_number")
PAIR_ONLY = ("ports", "serial_numbers", "length_m")
CIA406_ONLY, DBC_ONLY = ("nodes",), ("dbc", "signals")
FASTEST_POLL_HZ = 500.0
OWN_NAMES = ("psd", "spots", "encoders", "robot", "tracker", "camera", "can", "control")  # streams and emulators
SLOWEST_TRACKER_HZ = 5.0  # a stream that pauses longer counts as silent
TRACKER_COLUMNS = ("x", "y", "z", "time", "status", "temperature")
SHORTEST = 1e-6  # feels right: no hand writes a direction so short
FLAT_RAD, RIGHT_RAD = 0.1, 1.5709  # a smaller angle of planes has no usable derivative; they have no sides


def faults(rig: Rig) -> Iterator[Fault]:
    """All that contradicts itself in a rig whose types are right, in the order of the file's sections."""
    if rig.n_joints == 0:
        yield from _no_arm_faults(rig)
    for index, joint in enumerate(rig.arm.joints):
        yield from _joint_faults(("arm", "joint", index), joint, rig.arm.model)
    yield from _sense_faults(rig)
    yield from _carried_faults(rig)
    yield from _laser_faults(rig)
    yield from _placement_faults(rig)
    yield from _artefact_faults(rig)
    yield from _tolerance_faults(rig)
    yield from _instrument_faults(rig)
    yield from _robot_faults(rig)
    yield from _motion_faults(rig)


def _no_arm_faults(rig: Rig) -> Iterator[Fault]:
    """Encoders are logged without an arm; nothing else is measured without one."""
    devices = rig.devices
    if devices.encoders is None:
        yield (), "the file needs the key 'arm'; add it (only a rig of [devices.encoders] does without)"
    on_arm = {"[devices.psd]": devices.psd, "[devices.robot]": devices.robot, "[devices.tracker]": devices.tracker}
    on_arm |= {"[fixture]": rig.fixture, "[camera]": rig.camera}
    for name in (name for name, there in on_arm.items() if there is not None):
        yield (), f"{name} needs an arm: add [arm], or delete {name} to log encoders alone"


def _sense_faults(rig: Rig) -> Iterator[Fault]:
    """A joint may follow one in front of it, one to one: then every set of reported angles is one posture."""
    for index, joint in enumerate(rig.arm.joints):
        path: KeyPath = ("arm", "joint", index, "follows")
        if joint.follows is None:
            continue
        if not joint.follows.joint <= index:
            yield (
                (*path, "joint"),
                f"joint {index + 1} cannot follow joint {joint.follows.joint}: give the number of a joint nearer to "
                "the base",
            )
        if abs(joint.follows.by) != 1.0:
            yield ((*path, "by"), f"by = {joint.follows.by!r}: controllers couple joints one to one; give 1.0 or -1.0")
    if rig.arm.model is ArmModel.LOCAL_POE and rig.arm.base != Pose():
        yield ("arm", "base"), "'base' belongs to a D-H table; write it into origin_m and rotation_rad of joint 1"


def _joint_faults(path: KeyPath, joint: Joint, model: ArmModel) -> Iterator[Fault]:
    own, other = (_POE_KEYS, _DH_KEYS) if model is ArmModel.LOCAL_POE else (_DH_KEYS, _POE_KEYS)
    for key in other:
        if getattr(joint, key) is not None:
            yield (
                (*path, key),
                f"'{key}' does not belong to an arm of model \"{model.value}\"; it takes {', '.join(own)}",
            )
    for key in own:
        if getattr(joint, key) is None and key != "theta_offset_rad":
            yield path, f"[[arm.joint]] needs the key '{key}' in an arm of model \"{model.value}\""
    if joint.lower_rad >= joint.upper_rad:
        yield (
            (*path, "lower_rad"),
            f"lower_rad = {joint.lower_rad!r} is not below upper_rad = {joint.upper_rad!r}; exchange or correct them",
        )


def _carried_faults(rig: Rig) -> Iterator[Fault]:
    """Origins too far away to be carried."""
    for path in _CARRIED:
        frame: object = rig
        for key in path:
            frame = getattr(frame, str(key), None)
        for index, value in enumerate(frame.origin_m if isinstance(frame, Pose) else ()):
            if abs(value) > ARM_M:
                says = f"origin_m = {value!r} in {section(path)}: expected at most {ARM_M:g} m"
                yield (*path, "origin_m", index), f"{says}{in_metres(value, ARM_M)}"


def _motion_faults(rig: Rig) -> Iterator[Fault]:
    for key in ("keep_out", "slow_area"):
        for index, box in enumerate(getattr(rig.motion, key)):
            if any(lower >= upper for lower, upper in zip(box.lower_m, box.upper_m, strict=True)):
                yield (
                    ("motion", key, index, "lower_m"),
                    f"box '{box.name}': lower_m is not below upper_m in all three; exchange or correct them",
                )
    home_rad = rig.motion.home_rad
    if home_rad is None:
        return
    if len(home_rad) != rig.n_joints:
        yield (
            ("motion", "home_rad"),
            f"home_rad has {len(home_rad)} joint readings, but the arm has {rig.n_joints} joints; give one for each",
        )
        return
    for index, (value, joint) in enumerate(zip(home_rad, rig.arm.joints, strict=True), start=1):
        if not joint.lower_rad <= value <= joint.upper_rad:
            yield (
                ("motion", "home_rad"),
                f"home_rad of joint {index} is {value!r}, outside its range {joint.lower_rad!r} to {joint.upper_rad!r}",
            )


def _laser_faults(rig: Rig) -> Iterator[Fault]:
    origin, direction = rig.tool.laser_origin_m, rig.tool.laser_direction
    if (origin is None) != (direction is None):
        missing = "laser_origin_m" if origin is None else "laser_direction"
        yield ("tool",), f"[tool] has half a laser: add '{missing}'"
    if direction is not None and math.hypot(*direction) < SHORTEST:
        yield (
            ("tool", "laser_direction"),
            f"laser_direction = {list(direction)} points nowhere; give the beam's direction",
        )


def _placement_faults(rig: Rig) -> Iterator[Fault]:
    if rig.camera is not None and rig.fixture is None:
        yield (("camera", "board"), "[camera.board] places the board on the fixture, but there is no [fixture]; add it")
    yield from _twice(("placement",), tuple(placement.id for placement in rig.placement_list))
    if rig.placement_list and rig.fixture is None:
        yield ("placement",), "[[placement]] places the fixture, but there is no [fixture]; add it"
    known = sorted(rig.placements)
    for index, distance in enumerate(rig.known_distances):
        path = ("known_distance", index)
        for key, number in (("from", distance.from_placement), ("to", distance.to_placement)):
            if distance.of == "placement" and number not in rig.placements:
                yield (*path, key), f"{key} = {number} is no placement of this rig (it has {known}); correct it"
        if distance.from_placement == distance.to_placement:
            yield (*path, "to"), f"from and to are the same {distance.of} {distance.to_placement}; a distance needs two"
    for index, angle in enumerate(rig.known_angles):
        path = ("known_angle", index)
        if angle.from_plane == angle.to_plane:
            yield (*path, "to"), f"from and to are the same plane {angle.to_plane}; an angle needs two"
        if not FLAT_RAD <= angle.angle_rad <= RIGHT_RAD:
            yield (
                (*path, "angle_rad"),
                f"angle_rad = {angle.angle_rad:g} is not between {FLAT_RAD} and a right angle (1.5708): planes have no "
                'sides; give the smaller angle, of parallel planes their distance ([[known_distance]] of = "plane")',
            )


def _twice(table: KeyPath, ids: tuple[int, ...]) -> Iterator[Fault]:
    for index, number in enumerate(ids):
        if number in ids[:index]:
            yield (*table, index, "id"), f"id = {number} is used twice in [[{table[0]}]]; give every one its own"


def _tolerance_faults(rig: Rig) -> Iterator[Fault]:
    if (tolerance := rig.tolerance) is None:
        return
    for what, owner in (("psd2", "fixture"), ("device", "device")):
        sizes = {key: getattr(tolerance, key) for key in (f"{what}_m", f"{what}_rad")}
        missing = [key for key, value in sizes.items() if value is None]
        if len(missing) == 1:
            yield ("tolerance",), f"[tolerance] gives only one of the two sigmas of {what}: add '{missing[0]}'"
        elif not missing and getattr(rig, owner) is None:
            yield ("tolerance", f"{what}_m"), f"{what}_m is there, but there is no [{owner}] that it is the sigma of"


def _artefact_faults(rig: Rig) -> Iterator[Fault]:
    yield from _twice(("target",), tuple(target.id for target in rig.target_list))
    yield from _twice(("bar",), tuple(bar.id for bar in rig.bar_list))
    yield from _twice(("bar_position",), tuple(position.id for position in rig.bar_position_list))
    yield from _twice(("seat",), tuple(seat.id for seat in rig.seat_list))
    yield from _twice(("sphere",), tuple(sphere.id for sphere in rig.sphere_list))
    for index, position in enumerate(rig.bar_position_list):
        path: KeyPath = ("bar_position", index)
        if position.bar not in rig.bars:
            known = ", ".join(map(str, rig.bars)) or "none"
            yield (*path, "bar"), f"bar = {position.bar} is no [[bar]] of this rig (known: {known}); add or correct it"
        if math.hypot(*position.direction) < SHORTEST:
            yield (
                (*path, "direction"),
                (f"direction = {list(position.direction)} is the zero vector; give the direction of the bar"),
            )
    if rig.sphere_list and rig.tool.probe_diameter_m is None:
        yield ("tool",), "[[sphere]] is touched from outside: add 'probe_diameter_m', the ball's, to [tool]"


def _instrument_faults(rig: Rig) -> Iterator[Fault]:
    names = [other.name for other in rig.devices.others]
    for index, name in enumerate(names):
        if name in OWN_NAMES or name in names[:index]:
            yield (
                ("devices", "other", index, "name"),
                f"name = '{name}' in [[devices.other]] is taken; give every instrument a name of its own",
            )
    if rig.devices.psd is not None:
        yield from _psd_faults(rig.devices.psd)
    if rig.devices.tracker is not None:
        yield from _tracker_faults(rig.devices.tracker)
        if rig.devices.psd is not None:
            yield TRACKER, "a session measures with [devices.psd] or with [devices.tracker]; write two rig files"
    if rig.devices.encoders is not None:
        yield from _bus_faults(rig.devices.encoders)
        yield from _encoder_faults(rig.devices.encoders, rig.n_joints)


def _psd_faults(psd: PsdDevice) -> Iterator[Fault]:
    pair = psd.driver is PsdDriver.KPA101
    yield from _strangers(PSD, psd, DAQ_ONLY if pair else PAIR_ONLY, psd.driver.value)
    if pair and (psd.ports is None) == (psd.serial_numbers is None):
        yield (PSD, "[devices.psd] needs either 'ports' (two paths) or 'serial_numbers' (of two units), and one only")
    if not pair and (psd.port is None) == (psd.serial_number is None):
        yield PSD, "[devices.psd] needs either 'port' (a path) or 'serial_number' (of its USB), and one only"
    if pair and psd.rate_hz > KPA101_MOST_HZ:
        yield (
            (*PSD, "rate_hz"),
            f"rate_hz = {psd.rate_hz:g}: a pair of KPA101 gives at most {KPA101_MOST_HZ:g}; write rate_hz = 200",
        )
    if pair and psd.head is PsdHead.QUADRANT and psd.spot_radius_m is None:
        yield (PSD, "[devices.psd] with head = \"quadrant\" needs 'spot_radius_m': its ratio alone gives no metres")


def _tracker_faults(tracker: TrackerDevice) -> Iterator[Fault]:
    yield from _tracker_line_faults(tracker)
    json = tracker.driver is TrackerDriver.JSON_LINES
    key, other = ("members", "columns") if json else ("columns", "members")
    if getattr(tracker, other):
        yield (*TRACKER, other), f"'{other}' does not belong to driver \"{tracker.driver.value}\"; delete it"
    names = [name for name in getattr(tracker, key) if name != "-"]
    if unknown := [name for name in names if name not in TRACKER_COLUMNS]:
        yield (*TRACKER, key), f"'{unknown[0]}' in {key} is not known; there are {', '.join(TRACKER_COLUMNS)}"
    if missing := [axis for axis in ("x", "y", "z") if axis not in names]:
        yield (*TRACKER, key) if names else TRACKER, f"{key} has no '{missing[0]}'; name where x, y and z stand"
    if len(set(names)) != len(names):
        yield (*TRACKER, key), f"{key} = {names} names one twice; keep one"
    if ("status" in names) != bool(tracker.good):
        yield (
            (*TRACKER, key if "status" in names else "good"),
            "a status column needs 'good', the words that mean a valid reading, and 'good' a status column",
        )
    if not json and tracker.separator in {tracker.decimal, *"+-.eE0123456789"}:
        yield (
            (*TRACKER, "separator"),
            f"separator = '{tracker.separator}' with decimal = '{tracker.decimal}' stands in numbers, too; check both",
        )
    if tracker.rate_hz < SLOWEST_TRACKER_HZ:
        yield (
            (*TRACKER, "rate_hz"),
            f"rate_hz = {tracker.rate_hz:g}: a stream below {SLOWEST_TRACKER_HZ:g} Hz counts as silent; have the "
            "instrument measure continuously",
        )


def _tracker_line_faults(tracker: TrackerDevice) -> Iterator[Fault]:
    udp = tracker.transport == "udp"
    where = [tracker.port, tracker.serial_port, tracker.serial_number]
    if where.count(None) != 2 or (tracker.port is not None and tracker.host is None and not udp):
        yield (
            TRACKER,
            "[devices.tracker] needs either 'host' and 'port', or 'port' with transport = \"udp\", or 'serial_port' or "
            "'serial_number', and one only",
        )
    if tracker.is_serial and (udp or tracker.host is not None):
        yield TRACKER, "[devices.tracker]: 'host' and 'transport' belong to a network, not to a serial line"
    if udp and (tracker.trigger or tracker.start or tracker.stop):
        yield (
            (*TRACKER, "transport"),
            'transport = "udp" only receives; an instrument with start, stop or trigger needs TCP or a serial line',
        )


def _bus_faults(encoders: EncodersDevice) -> Iterator[Fault]:
    if bool(encoders.channel) == (encoders.serial_number is not None):
        yield (
            ENCODERS,
            "[devices.encoders] needs either 'channel' or 'serial_number' (of a serial adapter's USB), and one only",
        )
    if encoders.serial_number is not None and encoders.interface != "slcan":
        yield (
            (*ENCODERS, "serial_number"),
            f'serial_number belongs to interface "slcan", here it is "{encoders.interface}"; name its channel, '
            "or give python-can's own word for a serial number in 'options'",
        )


def _encoder_faults(encoders: EncodersDevice, n_joints: int) -> Iterator[Fault]:
    plain = encoders.driver is EncoderDriver.CAN_DBC
    yield from _strangers(ENCODERS, encoders, CIA406_ONLY if plain else DBC_ONLY, encoders.driver.value)
    yield from _stamp_faults(encoders)
    if plain and encoders.dbc is None:
        yield ENCODERS, "[devices.encoders] of driver \"can-dbc\" needs 'dbc', the file that describes the encoders"
    units = encoders.units_per_turn
    if not plain and units is not None and (units < 2.0 or not units.is_integer()):
        why = f"units_per_turn = {units:g}: encoders of CiA 406 count a whole number a turn, from 2; correct it"
        yield (*ENCODERS, "units_per_turn"), why
    key = "signals" if plain else "nodes"
    named = encoders.named
    if n_joints == 0 and not named:
        yield ENCODERS, f"[devices.encoders] names no encoder; give '{key}'"
    elif n_joints not in (0, len(named)):
        yield (
            (*ENCODERS, key),
            f"{key} = {list(named)} names {len(named)} encoders, the arm has {n_joints} joints; name one per joint",
        )
    if len(set(named)) != len(named):
        yield (*ENCODERS, key), f"{key} = {list(named)} names one twice; every joint has its own"


def _stamp_faults(encoders: EncodersDevice) -> Iterator[Fault]:
    if encoders.stamp is None:
        return
    path, text = (*ENCODERS, "stamp"), f'stamp = "{encoders.stamp.value}"'
    stamped = (*HARDWARE_STAMPS, STAMPS_WHEN_ASKED)
    if encoders.driver is EncoderDriver.CIA406:
        yield path, f'{text} belongs to driver "can-dbc"; rows of "cia406" are stamped by the SYNC sent: delete it'
    elif encoders.stamped_by_adapter and encoders.interface not in stamped:
        yield (
            path,
            f'{text}: interface "{encoders.interface}" gives no stamps of the adapter; delete the key, or use an '
            f"adapter of {', '.join(sorted(stamped))}",
        )


def _strangers(
    path: KeyPath, section: PsdDevice | EncodersDevice, keys: tuple[str, ...], driver: str
) -> Iterator[Fault]:
    for key in keys:
        if getattr(section, key) not in (None, ()):
            yield (*path, key), f"'{key}' does not belong to driver \"{driver}\"; delete it"


def _robot_faults(rig: Rig) -> Iterator[Fault]:
    robot = rig.devices.robot
    if robot is None:
        return
    yield from _modbus_faults(robot) if robot.driver is RobotDriver.MODBUS else _ur_faults(robot)


def _ur_faults(robot: RobotDevice) -> Iterator[Fault]:
    if robot.host is None:
        yield ROBOT, "[devices.robot] needs the key 'host', the controller's address"
    for key in ("port", "serial_port", "serial_number", "register"):
        if getattr(robot, "registers" if key == "register" else key) not in (None, ()):
            yield (*ROBOT, key), f'\'{key}\' belongs to driver "modbus", the driver here is "ur-rtde"; delete it'


def _modbus_faults(robot: RobotDevice) -> Iterator[Fault]:
    if [robot.host, robot.serial_port, robot.serial_number].count(None) != 2:
        yield (
            ROBOT,
            "[devices.robot] needs either 'host' (Modbus TCP) or 'serial_port' or 'serial_number' (RTU, by path or by "
            "the adapter's USB), and one only",
        )
    if robot.is_rtu and robot.port is not None:
        yield (*ROBOT, "port"), "'port' is the number of a TCP port; a serial line has none: delete it"
    if not robot.registers:
        yield ROBOT, "[devices.robot] has no register map: add [[devices.robot.register]], see docs/protocols/modbus.md"
    if robot.rate_hz > FASTEST_POLL_HZ:
        yield (*ROBOT, "rate_hz"), f"rate_hz = {robot.rate_hz:g}: no controller serves so many polls; try 50"
    names = [register.name for register in robot.registers]
    for index, register in enumerate(robot.registers):
        path = (*ROBOT, "register", index)
        if register.name in names[:index]:
            yield (*path, "name"), f"register {register.name} stands twice in the map; keep one"
        if register.scale == 0.0:
            yield ((*path, "scale"), f"register {register.name}: scale 0 loses the value; give what one count is in SI")
