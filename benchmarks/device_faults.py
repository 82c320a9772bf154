"""Every fault kind at every device in every phase: each case must end in a defined state within LIMIT_S.

`python -m benchmarks faults`: PSD box, CAN encoders, RTDE and Modbus controller, and a pair of KPA101.

Defined are: the call returned and what it returned is in order, or a DeviceError was raised; and an arm that was moving
stands. A kind that a device cannot have (a clock step where no time is sent) is refused by the emulator, and counted
apart. What the faults do is in docs/protocols/faults.md.
"""

import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from acquisition.recording.rig import Rig, load_rig, plain_rig, rig_text
from acquisition.recording.rig.devices import PsdDriver, RobotDriver
from acquisition.wires.attaching import Guarded
from acquisition.wires.streams import Pump, Supervisor
from calibeam.devices.encoders import emulated_encoders, encoder_driver
from calibeam.devices.instruments import emulated_psd, psd_driver
from calibeam.devices.robot import emulated_robot, robot_of
from drivers.clock import Clock, SystemClock
from drivers.device import Block, Device, Movable
from drivers.errors import DeviceError
from simulators.faults.injector import KINDS
from simulators.process import Emulators, EmulatorsError

RIGS = Path(__file__).parents[1] / "rigs"
DEVICES = {  # a shipped rig, and those of its devices that are tried on it
    "ur5e-dual-psd.toml": ("psd", "can", "rtde"),
    "irb120-modbus.toml": ("modbus",),
    "ur5e-dual-kpa101.toml": ("kpa101",),
}
LIMIT_S = 2.0
WATCHED_S = 0.6  # of a stream under a fault that it survives
READ_S = 0.5  # what a pump waits for a sample
READY_S = 10.0  # for a healthy device to stream: emulators on a busy machine have been seen to stand for half a second
INJECTED = {"psd": "psd", "kpa101": "psd", "can": "can", "rtde": "robot", "modbus": "robot"}  # the emulators' names
PHASES = ("connect", "idle", "stream", "move", "close")
SPEED_RAD_S, ACCELERATION_RAD_S2 = 1.0, 5.0
WAY_RAD = 0.4  # half a second


@dataclass(frozen=True)
class Subject:
    """A device under test: its name to the emulators, how to make its driver, and the arm that moves meanwhile."""

    name: str
    injected: str
    make: Callable[[], Device]
    arm: Callable[[], Movable]
    home_rad: np.ndarray
    emulators: Emulators


@dataclass(frozen=True)
class Outcome:
    """How a case ended: "good", the error's type, "no such fault", or what was wrong with the end itself."""

    device: str
    kind: str
    phase: str
    ended: str
    took_s: float

    @property
    def defined(self) -> bool:
        return not self.ended.startswith("UNDEFINED") and self.took_s < LIMIT_S


@contextmanager
def subjects(rig_name: str) -> Generator[dict[str, Subject]]:
    """The devices of DEVICES on that rig, by name, and their emulators for as long as this lasts."""
    path, clock = RIGS / rig_name, SystemClock()
    rig, plain = load_rig(path), plain_rig(rig_text(path), str(path))
    with tempfile.TemporaryDirectory() as links:  # an unplugged device comes back under the name of its link
        devices = plain["devices"]
        for table, key in (("psd", "port"), ("encoders", "channel")):
            if key in devices.get(table, {}):
                devices[table][key] = f"{links}/{table}"
        if "ports" in devices.get("psd", {}):
            devices["psd"]["ports"] = [f"{links}/psd{unit}" for unit in (1, 2)]
        with Emulators(plain) as emulators:
            makers = _makers(rig, emulators.address, clock)
            arm = _arm(rig, emulators.address, clock)
            home_rad = np.array(rig.motion.home_rad)
            yield {
                name: Subject(name, INJECTED[name], makers[name], arm, home_rad, emulators)
                for name in DEVICES[rig_name]
            }


def run(
    found: Sequence[Subject], kinds: Sequence[str] = KINDS, phases: Sequence[str] = PHASES, count: int | None = None
) -> Iterator[Outcome]:
    """All cases in turn; `count` strikes each, None: until the case has ended."""
    for subject in found:
        for kind in kinds:
            for phase in phases:
                yield _case(subject, kind, phase, count)


def lines() -> Iterator[str]:
    """The table of all cases, as they end."""
    outcomes: list[Outcome] = []
    for rig_name in DEVICES:
        with subjects(rig_name) as found:
            for outcome in run(list(found.values())):
                outcomes.append(outcome)
                if not outcome.defined:
                    case = f"{outcome.device} {outcome.kind} {outcome.phase}"
                    yield f"{case}: {outcome.ended} after {outcome.took_s:.2f} s"
    yield from summary(outcomes)


def summary(outcomes: Sequence[Outcome]) -> Iterator[str]:
    for device in dict.fromkeys(outcome.device for outcome in outcomes):
        mine = [outcome for outcome in outcomes if outcome.device == device]
        ends = ", ".join(f"{n} {end}" for end, n in Counter(outcome.ended for outcome in mine).most_common())
        yield f"{device:8s} {sum(o.defined for o in mine)} of {len(mine)} defined within {LIMIT_S:.0f} s: {ends}"
    slowest = max(outcomes, key=lambda outcome: outcome.took_s)
    yield f"slowest: {slowest.device} {slowest.kind} {slowest.phase} {slowest.took_s:.2f} s"


def _makers(rig: Rig, where: Mapping[str, Any], clock: Clock) -> dict[str, Callable[[], Device]]:
    """How to make the driver of every device that the rig has, by its name in DEVICES."""
    makers: dict[str, Callable[[], Device]] = {}
    psd, encoders = rig.devices.psd, rig.devices.encoders
    if psd is not None:
        given = emulated_psd(psd, where["psd"])
        name = "kpa101" if psd.driver is PsdDriver.KPA101 else "psd"
        makers[name] = lambda: psd_driver(given, rig, clock)
    if encoders is not None:
        bus = emulated_encoders(encoders, where["can"])
        makers["can"] = lambda: encoder_driver(bus, clock)
    robot = emulated_robot(_given(rig.devices.robot), where["robot"])
    name = "modbus" if robot.driver is RobotDriver.MODBUS else "rtde"
    makers[name] = lambda: robot_of(robot, clock).reader
    return makers


def _arm(rig: Rig, where: Mapping[str, Any], clock: Clock) -> Callable[[], Movable]:
    device = emulated_robot(_given(rig.devices.robot), where["robot"])
    return lambda: robot_of(device, clock).arm()


def _case(subject: Subject, kind: str, phase: str, count: int | None) -> Outcome:
    device = Guarded(subject.make())
    before = set(threading.enumerate())
    times_s: list[float] = []  # when the fault came, and, where cleaning up takes its time, when the case had ended

    def inject() -> None:
        subject.emulators.inject(subject.injected, kind, count=count)
        times_s[:] = [time.monotonic()]

    try:
        ended = _PHASES[phase](subject, device, inject, times_s)
    except EmulatorsError:
        ended = "no such fault"
    except DeviceError as error:
        ended = next(t.__name__ for t in type(error).__mro__ if t.__module__ == DeviceError.__module__)
        if not times_s:
            ended = f"UNDEFINED: {ended} before the fault came: {error}"
    except Exception as error:  # what must not happen
        ended = f"UNDEFINED {type(error).__name__}: {error}"
    times_s.append(time.monotonic())
    took_s = times_s[1] - times_s[0] if len(times_s) > 1 else 0.0
    subject.emulators.clear()
    device.close()
    if phase == "move" and took_s > 0.0 and not _stands(subject.emulators):
        ended = f"UNDEFINED: the arm moves ({ended})"
    if _left(before):
        ended = f"UNDEFINED: a thread is left ({ended})"
    _well_again(subject)
    return Outcome(subject.name, kind, phase, ended, took_s)


def _left(before: Collection[threading.Thread]) -> list[threading.Thread]:
    """Threads of the case that do not end although the device is closed; one that is on its way out may arrive."""
    mine = [thread for thread in threading.enumerate() if thread not in before]
    for thread in mine:
        thread.join(READY_S)
    return [thread for thread in mine if thread.is_alive()]


def _well_again(subject: Subject) -> None:
    """Until the device can be reached as before: one that was unplugged comes back after a tenth of a second."""
    device = subject.make()
    try:
        streaming(device)
    finally:
        device.close()


def streaming(device: Device) -> Block:
    """Connected, and its first samples. What a stalled emulator does to it before any fault is no case of ours."""
    end_s = time.monotonic() + READY_S
    while True:
        try:
            device.connect()
            return device.read(READ_S)
        except DeviceError:
            device.close()
            if time.monotonic() > end_s:
                raise


def _connect(subject: Subject, device: Device, inject: Callable[[], None], times_s: list[float]) -> str:
    inject()
    device.connect()
    return _in_order([device.read(READ_S)])


def _idle(subject: Subject, device: Device, inject: Callable[[], None], times_s: list[float]) -> str:
    streaming(device)
    inject()
    return _in_order([device.read(READ_S)])


def _stream(subject: Subject, device: Device, inject: Callable[[], None], times_s: list[float]) -> str:
    blocks = [streaming(device)]
    inject()
    end_s = time.monotonic() + WATCHED_S
    while time.monotonic() < end_s:
        blocks.append(device.read(READ_S))
    return _in_order(blocks)


def _move(subject: Subject, device: Device, inject: Callable[[], None], times_s: list[float]) -> str:
    """A move under a supervisor, as a session makes it; the fault comes when the arm is on its way."""
    inject()  # refused here, when there is no such fault, and not in the timer's thread
    subject.emulators.clear()
    arm = subject.arm()
    supervisor = Supervisor(arm.hold)
    pump = Pump(device, SystemClock(), lambda block: None, supervisor.failed)
    streaming(device)
    try:
        arm.connect()
        arm.move_joints(subject.home_rad, SPEED_RAD_S, ACCELERATION_RAD_S2)
        pump.start()
        threading.Timer(0.1, inject).start()
        with supervisor.watching(device.name, lambda: _newest_s(pump)):
            try:
                arm.move_joints(subject.home_rad + WAY_RAD, SPEED_RAD_S, ACCELERATION_RAD_S2)
            except DeviceError:
                supervisor.check()
                raise
            finally:
                times_s.append(time.monotonic())
        supervisor.check()
    finally:
        for timer in threading.enumerate():
            if isinstance(timer, threading.Timer):
                timer.join()
        subject.emulators.clear()
        arm.close()
        pump.stop()
    return "good"


def _close(subject: Subject, device: Device, inject: Callable[[], None], times_s: list[float]) -> str:
    streaming(device)
    inject()
    device.close()
    return "good"


_PHASES = {"connect": _connect, "idle": _idle, "stream": _stream, "move": _move, "close": _close}


def _in_order(blocks: Sequence[Block]) -> str:
    """Every sample once, in order, in numbers."""
    sequence = np.concatenate([block.sequence for block in blocks])
    return "good" if (np.diff(sequence) > 0).all() else "UNDEFINED: samples twice or out of order"


def _newest_s(pump: Pump) -> float | None:
    block = pump.latest()
    return None if block is None else float(block.host_s[-1])


def _stands(emulators: Emulators) -> bool:
    """Within the time that braking takes."""
    end_s = time.monotonic() + 1.0
    while not emulators.ask("robot.standing"):
        if time.monotonic() > end_s:
            return False
    return True


def _given(device: Any) -> Any:
    if device is None:
        raise ValueError("the rig lacks this device")
    return device
