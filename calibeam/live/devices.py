"""The rig's devices read for the page alone: nothing moves, nothing is recorded; one that is lost is tried again."""

import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

from acquisition.recording import RigFileError
from acquisition.recording.rig import Rig
from acquisition.recording.rig.schema import Devices
from acquisition.wires.attaching import Guarded, one_error_tree
from calibeam.devices.encoders import encoder_driver
from calibeam.devices.instruments import psd_driver, psd_view, tracker_driver
from calibeam.devices.others import other_drivers
from calibeam.devices.robot import robot_of
from calibeam.live.feed import Feed
from drivers.clock import Clock
from drivers.device import Device
from drivers.errors import DeviceError, DeviceRefused

READ_S = 0.5  # without a sample a device counts as lost
AGAIN_S = 1.0  # between two tries


@dataclass(frozen=True)
class Watched:
    """A device, and what is done once it is connected."""

    device: Device
    connected: Callable[[], None] = lambda: None
    silence_s: float = READ_S


def devices_of(rig: Rig, clock: Clock, feed: Feed) -> list[Watched]:
    """Those that the rig names; STOP ends what its controller runs.

    RigFileError: it names none. DeviceRefused for values that no driver takes.
    """
    watched: list[Watched] = []
    if rig.devices == Devices():
        raise RigFileError(f"rig {rig.name}: no [devices]; add how the detectors, encoders or controller are reached")
    if rig.devices.psd is not None:
        given, psd = rig.devices.psd, psd_driver(rig.devices.psd, rig, clock)
        watched.append(Watched(psd, lambda: feed.sees(psd_view(psd, given))))
    if rig.devices.tracker is not None:
        watched.append(Watched(tracker_driver(rig.devices.tracker, clock)))
    if rig.devices.encoders is not None:
        watched.append(Watched(encoder_driver(rig.devices.encoders, clock)))
    watched += [Watched(other.device, silence_s=other.silence_s) for other in other_drivers(rig.devices.others, clock)]
    if rig.devices.robot is not None:
        robot = robot_of(rig.devices.robot, clock)
        watched.append(Watched(robot.reader))
        try:
            feed.stops_by(robot.arm().stop)  # never connected: whoever moves the arm keeps it until then
        except DeviceRefused as why:
            feed.said(f"STOP cannot reach the arm: {why}")
    return watched


@contextmanager
def reading(watched: list[Watched], feed: Feed) -> Generator[None]:
    """Inside, a thread reads each device; at the end every port is released."""
    done = threading.Event()
    threads = [threading.Thread(target=_read, args=(w, feed, done), name=f"read {w.device.name}") for w in watched]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        done.set()
        for thread in threads:
            thread.join()


def _read(watched: Watched, feed: Feed, done: threading.Event) -> None:
    device, away = Guarded(watched.device), False
    while not done.is_set():
        try:
            device.connect()
            with one_error_tree(device.name, "connected"):
                watched.connected()
            if away:
                feed.said(f"{device.name}: back")
            while not done.is_set():
                feed.heard(device.name, device.read(watched.silence_s))
        except DeviceError as why:
            feed.lost(device.name, str(why))
            if not away:
                feed.said(str(why))
            away = True
        finally:
            with suppress(DeviceError):  # how it failed was reported, or nobody reads any more; it is tried again
                device.close()
        done.wait(AGAIN_S)
