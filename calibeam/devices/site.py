"""Connects the devices of a rig, whether real or emulated, and runs their readers into the recording."""

import itertools
from collections.abc import Callable, Generator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, TypeVar

from acquisition.errors import StoppedError
from acquisition.motion.under_way import GatedArm
from acquisition.recording import Channel, Event, RecordingError, RecordingWriter, RigFileError
from acquisition.recording.rig import Rig
from acquisition.recording.rig.devices import EncodersDevice, OtherDevice, PsdDevice, RobotDevice, TrackerDevice
from acquisition.recording.samples import SPOTS
from acquisition.wires.attaching import Guarded
from acquisition.wires.bench import SILENCE_S, Pumps, Speeds, WiredBench
from acquisition.wires.psd_view import PsdView, psd_window
from acquisition.wires.streams import STALE_S, Pump, Supervisor
from acquisition.wires.tracker_bench import TrackerBench
from calibeam.devices.encoders import emulated_encoders, encoder_driver
from calibeam.devices.instruments import VIEWED as TRACKER_VIEWED
from calibeam.devices.instruments import (
    PsdInstrument,
    emulated_psd,
    emulated_tracker,
    psd_driver,
    psd_view,
    tracker_driver,
)
from calibeam.devices.others import emulated_others, other_drivers
from calibeam.devices.recorder import uninterrupted
from calibeam.devices.robot import emulated_robot, robot_of
from calibeam.live.feed import PAGE_STOP, SILENT, Feed
from calibeam.motion.gate_of_rig import gated_arm
from calibrate.model.dual_psd_rig import fixture_of, laser_of
from drivers.clock import Clock
from drivers.device import Block, Device, Movable, stamps_of
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
    tracker = tracker_driver(addresses.instrument, clock, addresses.hurry)
    with _wires(rig, addresses, writer, clock, feed, partial(pumped, tracker)) as wires:
        yield TrackerBench(*wires, rate_hz=addresses.instrument.rate_hz)


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
    psd = psd_driver(addresses.instrument, rig, clock, addresses.hurry)

    @contextmanager
    def read(kept: Kept) -> Generator[Pump]:
        with pumped(psd, kept, _spots_writer(psd, addresses.instrument, writer)) as pump:
            feed.sees(psd_view(psd, addresses.instrument))
            yield pump

    with _wires(rig, addresses, writer, clock, feed, read) as wires:
        yield WiredBench(*wires, view=psd_view(psd, addresses.instrument), place=place)


@contextmanager
def _wires(
    rig: Rig,
    addresses: Addresses | TrackerAddresses,
    writer: RecordingWriter,
    clock: Clock,
    feed: Feed,
    read: Callable[[Kept], AbstractContextManager[Pump]],
) -> Generator[tuple[GatedArm, Pumps, Speeds, Supervisor, Clock, float, dict[str, Pump]]]:
    """Everything beside what the instrument needs of its own, as a bench takes it. `read`: runs its reader."""
    with ExitStack() as cleaning:
        robot = robot_of(addresses.robot, clock, addresses.hurry)
        arm = robot.arm()
        supervisor = Supervisor(arm.hold, clock)
        cleaning.callback(feed.stops_by, None)
        feed.stops_by(partial(supervisor.stop, StoppedError(PAGE_STOP)))  # while connecting, too
        kept = Kept(writer, clock, supervisor, feed)
        also = {
            one.device.name: cleaning.enter_context(pumped(one.device, kept, silence_s=one.silence_s))
            for one in other_drivers(addresses.others, clock)
        }
        instrument = cleaning.enter_context(read(kept))
        pump, encoders = cleaning.enter_context(pumped(robot.reader, kept)), None
        if addresses.encoders is not None:
            driver = encoder_driver(addresses.encoders, clock, hurry=addresses.hurry)
            encoders = cleaning.enter_context(pumped(driver, kept))
        cleaning.callback(released, arm)
        try:
            arm.connect()
        except DeviceError:
            supervisor.check()  # another device failed meanwhile, and its stop ended this too: that is the news
            raise
        speeds = Speeds(rig.motion.speed_rad_s, rig.motion.acceleration_rad_s2)
        pumps = Pumps(instrument, pump, encoders)
        yield gated_arm(arm, rig, pump), pumps, speeds, supervisor, clock, addresses.hurry, also


def released(arm: Movable) -> None:
    with uninterrupted():
        arm.close()


def _spots_writer(psd: PsdInstrument, device: PsdDevice, writer: RecordingWriter) -> Callable[[Block], None]:
    """Spots of every block as a stream of their own, one sample a block: what a viewer shows without set-up."""
    stream = writer.stream("spots", tuple(Channel(name, "m") for name in SPOTS), stamps=stamps_of(psd))
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
def pumped(
    device: Device, kept: Kept, also: Callable[[Block], None] = lambda block: None, silence_s: float = SILENCE_S
) -> Generator[Pump]:
    """The device connected, its blocks going into the recording until left, to the live page and to `also`."""

    def keep(block: Block) -> None:
        stream.append(block.host_s, block.device_s, block.sequence, block.values)
        kept.feed.heard(device.name, block)
        also(block)

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
        stream = kept.writer.stream(device.name, channels, viewed, stamps=stamps_of(device))
        pump.start()
        with kept.supervisor.watching(device.name, lambda: newest_s(pump), silence_s * STALE_S / SILENCE_S):
            yield pump
    finally:
        with uninterrupted():
            pump.stop()
