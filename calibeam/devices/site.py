"""Connects the devices of a rig, whether real or emulated, and runs their readers into the recording."""

import itertools
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, TypeVar

from acquisition.errors import StoppedError
from acquisition.recording import Channel, Event, RecordingError, RecordingWriter, RigFileError
from acquisition.recording.rig import Rig
from acquisition.recording.rig.devices import EncodersDevice, OtherDevice, PsdDevice, RobotDevice, TrackerDevice
from acquisition.recording.samples import SPOTS
from acquisition.wires.attaching import Guarded
from acquisition.wires.bench import SILENCE_S, Pumps, Speeds, WiredBench
from acquisition.wires.psd_view import PsdView, psd_window
from acquisition.wires.streams import STALE_S, Pump, Supervisor
from acquisition.wires.tracker_bench import TrackerBench, TrackerPumps
from calibeam.devices.encoders import emulated_encoders, encoder_driver
from calibeam.devices.others import Other, emulated_others, other_drivers
from calibeam.devices.psd import PsdInstrument, emulated_psd, psd_driver, psd_view
from calibeam.devices.recorder import uninterrupted
from calibeam.devices.robot import Robot, emulated_robot, robot_of
from calibeam.devices.tracker_of_rig import VIEWED as TRACKER_VIEWED
from calibeam.devices.tracker_of_rig import emulated_tracker, tracker_driver
from calibeam.live.feed import PAGE_STOP, SILENT, Feed
from calibeam.motion.gate_of_rig import gated_arm
from calibrate.model.dual_psd_rig import fixture_of, laser_of
from drivers.clock import Clock
from drivers.device import Block, Device, Movable
from drivers.errors import DeviceError, DeviceRefused

DRIVEN_JOINTS = 6
VIEWED = {
    "psd": ("flags", "temperature_degC"),
    "robot": ("actual_q_rad", "actual_qd_rad_s"),
    "encoders": ("position_rad",),
    "tracker": TRACKER_VIEWED,
}


Instrument = TypeVar("Instrument", PsdDevice, TrackerDevice)


@dataclass(frozen=True)
class AddressesWith(Generic[Instrument]):
    """Where the devices are. `hurry`: device seconds in one second of this program's clock; 1 on site."""

    instrument: Instrument
    robot: RobotDevice
    encoders: EncodersDevice | None
    hurry: float = 1.0
    others: tuple[OtherDevice, ...] = ()


Addresses = AddressesWith[PsdDevice]
TrackerAddresses = AddressesWith[TrackerDevice]


@dataclass(frozen=True)
class Kept:
    """Where the messages of the devices go."""

    writer: RecordingWriter
    clock: Clock
    supervisor: Supervisor
    feed: Feed


def check_session(rig: Rig) -> None:
    """What a session needs of a rig beyond what every rig file has. DataError, RigFileError; no device is touched."""
    fixture_of(rig)  # refused before an hour of measuring that could not be identified
    laser_of(rig)
    _check_driven(rig)


def _check_driven(rig: Rig) -> None:
    if rig.motion.home_rad is None:
        raise RigFileError(
            f"rig {rig.name}: [motion] has no home_rad; give the joint readings of a pose clear of all obstacles"
        )
    if rig.n_joints != DRIVEN_JOINTS:
        raise RigFileError(f"rig {rig.name}: {rig.n_joints} joints, but the drivers move arms of {DRIVEN_JOINTS}")


def addresses_of(rig: Rig, emulated: Mapping[str, Any] | None = None, hurry: float = 1.0) -> Addresses:
    """The rig's [devices], or the same devices where emulators announced them. DeviceRefused when one is missing."""
    return _addresses(rig, rig.devices.psd, "psd", "the PSD box", emulated_psd, emulated, hurry)


def is_tracked(rig: Rig) -> bool:
    """Whether a session of this rig measures with a tracker."""
    return rig.devices.tracker is not None and rig.devices.psd is None


def check_tracked_session(rig: Rig) -> None:
    """What a session with a tracker needs of a rig. RigFileError; no device is touched."""
    if rig.tool.point_m is None:
        raise RigFileError(f"rig {rig.name}: [tool] has no point_m; give the target's place at the flange")
    _check_driven(rig)


def tracker_addresses_of(rig: Rig, emulated: Mapping[str, Any] | None = None, hurry: float = 1.0) -> TrackerAddresses:
    """As `addresses_of`, of a rig with a tracker."""
    return _addresses(rig, rig.devices.tracker, "tracker", "the tracker", emulated_tracker, emulated, hurry)


def _addresses(
    rig: Rig,
    instrument: Instrument | None,
    key: str,
    name: str,
    place: Callable[[Instrument, Mapping[str, Any]], Instrument],
    emulated: Mapping[str, Any] | None,
    hurry: float,
) -> AddressesWith[Instrument]:
    robot, encoders, others = rig.devices.robot, rig.devices.encoders, rig.devices.others
    if instrument is None or robot is None:
        missing = key if instrument is None else "robot"
        raise DeviceRefused(f"rig {rig.name}: no [devices.{missing}]; a session needs {name} and the controller")
    if emulated is None:
        return AddressesWith(instrument, robot, encoders, hurry, others=others)
    if encoders is not None:
        encoders = emulated_encoders(encoders, emulated["can"])
    robot, others = emulated_robot(robot, emulated["robot"]), emulated_others(others, emulated)
    return AddressesWith(place(instrument, emulated[key]), robot, encoders, hurry, others=others)


@contextmanager
def connected_tracker(
    rig: Rig, addresses: TrackerAddresses, writer: RecordingWriter, clock: Clock, feed: Feed = SILENT
) -> Generator[TrackerBench]:
    """The bench of a tracker on wires, its readers running. At the end the arm is stopped, every port released."""
    with ExitStack() as cleaning:
        robot, arm, kept, beside = _begun(addresses, writer, clock, feed, cleaning)
        tracker = tracker_driver(addresses.instrument, clock, addresses.hurry)
        pumps = TrackerPumps(
            tracker=cleaning.enter_context(_pumped(tracker, kept)),
            robot=cleaning.enter_context(_pumped(robot.reader, kept)),
            encoders=_encoders(addresses, kept, cleaning),
        )
        cleaning.callback(_released, arm)
        _connect_arm(arm, kept.supervisor)
        speeds = Speeds(rig.motion.speed_rad_s, rig.motion.acceleration_rad_s2)
        gated, rate_hz = gated_arm(arm, rig, pumps.robot), addresses.instrument.rate_hz
        yield TrackerBench(gated, pumps, speeds, kept.supervisor, clock, rate_hz, addresses.hurry, beside=beside)


def _begun(
    addresses: AddressesWith[Instrument], writer: RecordingWriter, clock: Clock, feed: Feed, cleaning: ExitStack
) -> tuple[Robot, Movable, Kept, dict[str, Pump]]:
    robot = robot_of(addresses.robot, clock, addresses.hurry)
    arm = robot.arm()
    supervisor = Supervisor(arm.hold, clock)
    cleaning.callback(feed.stops_by, None)
    feed.stops_by(partial(supervisor.stop, StoppedError(PAGE_STOP)))  # while connecting, too
    kept = Kept(writer, clock, supervisor, feed)
    return robot, arm, kept, _others(other_drivers(addresses.others, clock), kept, cleaning)


def _connect_arm(arm: Movable, supervisor: Supervisor) -> None:
    try:
        arm.connect()
    except DeviceError:
        supervisor.check()  # another device failed meanwhile, and its stop ended this too: that is the news
        raise


@contextmanager
def connected(
    rig: Rig,
    addresses: Addresses,
    writer: RecordingWriter,
    clock: Clock,
    place: Callable[[int], None],
    feed: Feed = SILENT,
) -> Generator[WiredBench]:
    """The bench on wires, its readers running. At the end the arm is stopped and every port released."""
    with ExitStack() as cleaning:
        robot, arm, kept, beside = _begun(addresses, writer, clock, feed, cleaning)
        psd = psd_driver(addresses.instrument, rig, clock, addresses.hurry)
        pumps = Pumps(
            psd=cleaning.enter_context(_pumped(psd, kept, _spots_beside(psd, addresses.instrument, writer))),
            robot=cleaning.enter_context(_pumped(robot.reader, kept)),
            encoders=_encoders(addresses, kept, cleaning),
        )
        feed.sees(psd_view(psd, addresses.instrument))
        cleaning.callback(_released, arm)
        _connect_arm(arm, kept.supervisor)
        speeds = Speeds(rig.motion.speed_rad_s, rig.motion.acceleration_rad_s2)
        gated = gated_arm(arm, rig, pumps.robot)
        view, hurry = psd_view(psd, addresses.instrument), addresses.hurry
        yield WiredBench(gated, pumps, view, speeds, kept.supervisor, clock, place, hurry, beside=beside)


def _released(arm: Movable) -> None:
    with uninterrupted():
        arm.close()


def _encoders(addresses: Addresses | TrackerAddresses, kept: Kept, cleaning: ExitStack) -> Pump | None:
    device = addresses.encoders
    if device is None:
        return None
    driver = encoder_driver(device, kept.clock, hurry=addresses.hurry)
    return cleaning.enter_context(_pumped(driver, kept))


def _others(others: Sequence[Other], kept: Kept, cleaning: ExitStack) -> dict[str, Pump]:
    """Readers of the plug-ins' instruments, by name."""
    return {
        one.device.name: cleaning.enter_context(_pumped(one.device, kept, silence_s=one.silence_s)) for one in others
    }


def _spots_beside(psd: PsdInstrument, device: PsdDevice, writer: RecordingWriter) -> Callable[[Block], None]:
    """Spots of every block as a stream of their own, one sample a block: what a viewer shows without set-up."""
    stream = writer.stream("spots", tuple(Channel(name, "m") for name in SPOTS))
    count = itertools.count()
    seen: list[PsdView] = []  # made with the first block: before, the faces are unknown

    def keep(block: Block) -> None:
        if not seen:
            seen.append(psd_view(psd, device))
        spots_m = seen[0].each(psd_window([block])).mean(axis=0)  # a block may hold a single sample: no sigma
        values: dict[str, float] = dict(zip(SPOTS, spots_m.tolist(), strict=True))
        stream.append(block.host_s[-1], block.device_s[-1], next(count), values)

    return keep


def newest_s(pump: Pump) -> float | None:
    """Host time of the newest sample, None before the first."""
    block = pump.latest()
    return None if block is None else float(block.host_s[-1])


@contextmanager
def _pumped(
    device: Device, kept: Kept, beside: Callable[[Block], None] = lambda block: None, silence_s: float = SILENCE_S
) -> Generator[Pump]:
    """The device connected, its blocks going into the recording until left, to the live page and to `beside`."""

    def keep(block: Block) -> None:
        stream.append(block.host_s, block.device_s, block.sequence, block.values)
        kept.feed.heard(device.name, block)
        beside(block)

    def failed(failure: Exception) -> None:
        kept.supervisor.failed(failure)
        kept.feed.lost(device.name, str(failure))
        with suppress(RecordingError):  # it may be the recording itself that failed
            kept.writer.event(Event(kept.clock.now_s(), "device failed", {"device": device.name, "why": str(failure)}))

    guarded = Guarded(device)
    pump = Pump(guarded, kept.clock, keep, failed, stale_s=silence_s)
    try:
        guarded.connect()
        channels = tuple(Channel(c.name, c.unit, c.shape, c.full_scale, c.resolution) for c in device.describe())
        scalars = tuple(channel.name for channel in channels if channel.shape == ())
        viewed = tuple(
            name for name in VIEWED.get(device.name, scalars) if name in {channel.name for channel in channels}
        )
        stream = kept.writer.stream(device.name, channels, viewed)
        pump.start()
        with kept.supervisor.watching(device.name, lambda: newest_s(pump), silence_s * STALE_S / SILENCE_S):
            yield pump
    finally:
        with uninterrupted():
            pump.stop()
