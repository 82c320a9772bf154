"""`calibeam check` of a rig: every device tried for a moment, and what it is, how it reads, what is wrong with it."""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import AcquisitionError
from acquisition.recording import RigFileError
from acquisition.recording.files import brief
from acquisition.recording.rig import Camera, Rig
from acquisition.recording.rig.devices import (
    EncoderDriver,
    EncodersDevice,
    OtherDevice,
    PsdDevice,
    RobotDevice,
    RobotDriver,
    TrackerDevice,
)
from acquisition.wires.attaching import one_error_tree
from acquisition.wires.psd_view import psd_window
from calibeam.devices.encoders import (
    bus_trouble,
    encoder_driver,
    identities_of,
    sample_noise,
    sample_rate,
    uneven_layers,
    unread,
)
from calibeam.devices.instruments import camera_sight, place_of, psd_driver, psd_view, tracker_driver
from calibeam.devices.others import other_drivers
from calibeam.devices.robot import robot_of
from drivers.clock import Clock
from drivers.device import Block, Device
from drivers.errors import DeviceError
from drivers.psd_daq.messages import Flag
from drivers.ur.dashboard import UrDashboard
from drivers.ur.reader import UrReader

PICTURES = 3  # of the camera
READ_S = 1.0  # host time that a device is listened to
FIRST_SAMPLE_S = 1.0


@dataclass(frozen=True)
class DeviceCheck:
    """One line. `wrong` is empty for a device that is fit for a session, else it names what is wrong and what to do."""

    device: str
    what: str = ""
    firmware: str = ""
    rate_hz: float = 0.0
    noise: str = ""
    wrong: str = ""

    @property
    def line(self) -> str:
        if self.wrong and not self.what:
            return brief(f"{self.device:9s} error  {self.wrong}")
        facts = [self.what, f"firmware {self.firmware}" if self.firmware else "", f"{self.rate_hz:.0f} Hz", self.noise]
        text = ", ".join(fact for fact in facts if fact)
        return brief(f"{self.device:9s} " + (f"error  {text}: {self.wrong}" if self.wrong else f"ok     {text}"))


def check_devices(rig: Rig, clock: Clock) -> Iterator[DeviceCheck]:
    """One after the other, the arm stands still; devices that the rig does not name are left out."""
    found, checks = rig.devices, list[tuple[str, Callable[[], DeviceCheck]]]()
    if found.psd is not None:
        checks.append(("psd", partial(_psd, found.psd, rig, clock)))
    if found.tracker is not None:
        checks.append(("tracker", partial(_tracker, found.tracker, clock)))
    if found.encoders is not None:
        checks.append(("encoders", partial(_encoders, found.encoders, clock)))
    if found.robot is not None:
        checks.append(("robot", partial(_robot, found.robot, rig, clock)))
    checks += [(other.name, partial(_other, other, clock)) for other in found.others]
    for name, check in checks:
        try:
            with one_error_tree(name, "checking"):
                yield check()
        except DeviceError as error:
            yield DeviceCheck(name, wrong=str(error))
    if rig.camera is not None:
        try:
            yield _camera(rig, rig.camera, clock)
        except (AcquisitionError, RigFileError, DeviceError) as error:
            yield DeviceCheck("camera", wrong=str(error))


@contextmanager
def _listened(device: Device, clock: Clock) -> Generator[list[Block]]:
    """The connected device's blocks of READ_S; closed at the end."""
    try:
        device.connect()
        blocks = [device.read(FIRST_SAMPLE_S)]
        end_s = clock.now_s() + READ_S
        while clock.now_s() < end_s:
            blocks.append(device.read(FIRST_SAMPLE_S))
        yield blocks
    finally:
        device.close()


def _camera(rig: Rig, camera: Camera, clock: Clock) -> DeviceCheck:
    with camera_sight(rig, clock) as sight, one_error_tree("camera", "checking"):
        begin_s = clock.now_s()
        seen = sum(sight is not None and sight.sees_board() for _ in range(PICTURES))
        rate_hz = PICTURES / (clock.now_s() - begin_s)
    board = f"board in {seen} of {PICTURES} pictures" if seen else "board not in the picture from here"
    what = f"{camera.width_px} x {camera.height_px} from {camera.source}"
    return DeviceCheck("camera", what, rate_hz=rate_hz, noise=board)


def _psd(device: PsdDevice, rig: Rig, clock: Clock) -> DeviceCheck:
    psd = psd_driver(device, rig, clock)
    with _listened(psd, clock) as blocks:
        identity = psd.identity
        window = psd_window(blocks)
        spots_m = psd_view(psd, device).each(window)
    dark = [k + 1 for k in (0, 1) if np.isnan(spots_m[:, 2 * k]).mean() > 0.5]
    text = "no light on either face" if len(dark) == 2 else f"noise {1e6 * sample_noise(spots_m):.2f} µm a sample"
    rate_hz, wrong = sample_rate(blocks, device.rate_hz)
    if (window.flags & (Flag.PSD1_SATURATED | Flag.PSD2_SATURATED)).any():
        wrong = wrong or "a face is saturated: reduce the laser's power or the gain"
    if identity is not None:
        wrong = wrong or uneven_layers(identity.faces, [k + 1 not in dark for k in (0, 1)], window.current_a)
    what = "" if identity is None else f"{identity.model} {identity.serial_number}"
    return DeviceCheck("psd", what, "" if identity is None else identity.firmware, rate_hz, text, wrong)


def _tracker(device: TrackerDevice, clock: Clock) -> DeviceCheck:
    tracker = tracker_driver(device, clock)
    with _listened(tracker, clock) as blocks:
        position_m = np.concatenate([block.values["position_m"] for block in blocks])
    good_m = position_m[np.isfinite(position_m).all(axis=1)]
    rate_hz, wrong = _tracker_rate(blocks, device.rate_hz)
    if tracker.bad_lines and tracker.last_bad is not None:
        wrong = wrong or f"lines that cannot be read: {tracker.bad_lines}, the last: {tracker.last_bad.reason}"
    what = f"{device.driver.value} from {place_of(device)}"
    if len(good_m) < 2:
        return DeviceCheck("tracker", what, "", rate_hz, "", "no valid reading: let it see the target")
    x, y, z = good_m.mean(axis=0)
    text = f"noise {1e6 * sample_noise(good_m):.2f} µm a sample, target at ({x:.3f}, {y:.3f}, {z:.3f}) m"
    if len(good_m) < len(position_m):
        wrong = wrong or f"{len(position_m) - len(good_m)} of {len(position_m)} readings are not valid: free the beam"
    return DeviceCheck("tracker", what, "", rate_hz, text, wrong)


def _other(other: OtherDevice, clock: Clock) -> DeviceCheck:
    """Of a plug-in's instrument all that can be determined is that it sends, and how fast."""
    (found,) = other_drivers((other,), clock)
    try:
        found.device.connect()
        block = found.device.read(found.silence_s)
        channels = ", ".join(channel.name for channel in found.device.describe())
        begin_s, count = clock.now_s(), 0
        while clock.now_s() - begin_s < READ_S:
            block = found.device.read(found.silence_s)
            count += len(block.host_s)
        rate_hz = count / max(float(block.host_s[-1]) - begin_s, READ_S)
    finally:
        found.device.close()
    return DeviceCheck(other.name, f"{channels} by {found.package}", rate_hz=rate_hz)


def _tracker_rate(blocks: Sequence[Block], wanted_hz: float) -> tuple[float, str]:
    """As `sample_rate`; of an instrument without a clock by this machine's."""
    if all(np.isfinite(block.device_s).all() for block in blocks):
        return sample_rate(blocks, wanted_hz)
    return sample_rate([replace(block, device_s=block.host_s) for block in blocks], wanted_hz)


def _encoders(device: EncodersDevice, clock: Clock) -> DeviceCheck:
    driver = encoder_driver(device, clock)
    with _listened(driver, clock) as blocks:
        q_rad = np.concatenate([block.values["position_rad"] for block in blocks])
        identities = identities_of(driver)
    asked_hz = device.sync_hz if device.driver is EncoderDriver.CIA406 else 0.0  # others send at a pace of their own
    rate_hz, wrong = sample_rate(blocks, asked_hz)
    registers = {int(identity["node"]): int(identity["error_register"]) for identity in identities}
    wrong = bus_trouble(blocks[-1], registers) or wrong
    wrong = unread(blocks) or wrong
    numbers = ", ".join(str(identity.get("serial_number", "?")) for identity in identities)
    what = f"{q_rad.shape[1]} encoders on {device.interface} {device.channel}"
    what += f" (serial numbers {numbers})" if numbers else ""
    firmware = "/".join(sorted({f"{identity.get('revision', 0):#x}" for identity in identities}))
    return DeviceCheck("encoders", what, firmware, rate_hz, f"noise {1e6 * sample_noise(q_rad):.2f} µrad", wrong)


def _robot(device: RobotDevice, rig: Rig, clock: Clock) -> DeviceCheck:
    robot = robot_of(device, clock)
    with _listened(robot.reader, clock) as blocks:
        q_rad = np.concatenate([block.values["actual_q_rad"] for block in blocks])
    rate_hz, wrong = sample_rate(blocks, device.rate_hz)
    what, firmware = f"Modbus controller with {len(device.registers)} registers in the map", ""
    if device.driver is RobotDriver.UR_RTDE and isinstance(robot.reader, UrReader) and device.host is not None:
        version = robot.reader.version
        firmware = "" if version is None else f"{version.major}.{version.minor}.{version.bugfix}.{version.build}"
        what, state = _ur(device.host)
        wrong = state or wrong
    elif device.driver is RobotDriver.MODBUS:
        robot.arm().close()  # DeviceRefused when the map cannot move it
        wrong = _stopped(blocks[-1]) or wrong
    wrong = wrong or _misplaced(rig, q_rad[-1])
    return DeviceCheck("robot", what, firmware, rate_hz, f"noise {1e6 * sample_noise(q_rad):.2f} µrad", wrong)


def _ur(host: str) -> tuple[str, str]:
    """What the dashboard reports that it is, and why it would not move."""
    dashboard = UrDashboard(host)
    identity, state = dashboard.identity(), dashboard.state()
    what = f"{identity.model} {identity.serial_number}"
    if state.safety_status != "NORMAL":
        return what, f"safety is {state.safety_status}: clear the cause and unlock on the pendant"
    if state.robot_mode != "RUNNING":
        return what, f"the arm is in {state.robot_mode}: power on and release the brakes"
    return what, "" if state.remote_control else "it is in local control: switch to remote control on the pendant"


def _stopped(block: Block) -> str:
    """Why it would not move, as far as its register map shows."""
    if block.values.get("emergency_stopped", np.zeros(1))[-1]:
        return "emergency stop: release it and switch the motors on at the controller"
    if block.values.get("protective_stopped", np.zeros(1))[-1]:
        return "protective stop: clear the cause and unlock it at the controller"
    return ""


def _misplaced(rig: Rig, q_rad: NDArray[np.float64]) -> str:
    """Joint readings that the rig states cannot be: another arm, or a wrong register map."""
    if len(q_rad) != rig.n_joints:
        return f"it has {len(q_rad)} joints, the rig file {rig.n_joints}: correct the rig file"
    for number, (q, joint) in enumerate(zip(q_rad, rig.arm.joints, strict=True), start=1):
        if not joint.lower_rad <= q <= joint.upper_rad:
            return (
                f"joint {number} reads {q:.3f} rad, its range in the rig file is {joint.lower_rad:.3f} to "
                f"{joint.upper_rad:.3f}: correct the range, the unit or the register map"
            )
    return ""
