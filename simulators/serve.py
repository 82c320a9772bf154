"""The emulators as a process: a world, its instruments and a side channel, served until stopped.

    serve(rig, ServeOptions(robot_host="auto"), announce=print)

A rig is emulated by one of three worlds: one with a robot, a laser and a fixture, one with a hand
on a measuring arm, or, without an arm, the shaft of encoders alone.
"""

import math
import os
import secrets
import signal
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

from simulators.defects import Defect, defects_of
from simulators.devices import (
    EmulatedDevices,
    addresses,
    build_devices,
    check_private,
    is_loopback,
    with_robot_on,
    without_links,
)
from simulators.encoders.shaft import ShaftWorld, is_shaft, read_shaft
from simulators.errors import HostError, PortBusy, WorldError
from simulators.faults.injector import fault_verbs
from simulators.hand.hand_rig import is_hand_held, read_hand_rig, write_hand_truth
from simulators.hand.world import HandWorld
from simulators.host.loop import Host
from simulators.host.side_channel import Control, side_channel
from simulators.wire import Bench
from simulators.world.rig import read_rig
from simulators.world.truth import Given, write_truth
from simulators.world.world import World


@dataclass(frozen=True)
class EmulatedWorld:
    """A world and what the process that serves it wants to know."""

    physics: World | HandWorld | ShaftWorld
    verbs: Mapping[str, Callable[..., Any]]  # of the side channel, beside those of the devices
    time_scale: float  # as the rig states
    write_truth: Callable[[Path], None]


def world_of(
    rig: Mapping[str, Any], seed: int | None, hidden: Sequence[Defect], given: Given | None = None
) -> EmulatedWorld:
    """The world of a rig as `tomllib` gives it. WorldError for one that cannot be emulated.

    `given`: its geometry in numbers, instead of one that the seed draws.
    """
    if is_shaft(rig):
        return _shaft(rig, seed, hidden, given)
    if not is_hand_held(rig):
        return _driven(rig, seed, hidden, given)
    if given is not None:
        raise WorldError("a hand-held arm has its geometry in [emulation]; leave the model out")
    return _hand_held(rig, seed, hidden)


def _driven(rig: Mapping[str, Any], seed: int | None, hidden: Sequence[Defect], given: Given | None) -> EmulatedWorld:
    home_rad = rig.get("motion", {}).get("home_rad")
    world = World.from_rig(rig, seed=seed, q_rad=home_rad, hidden=hidden, given=given)

    def place(id: int) -> None:  # noqa: A002 - the verb's argument is called id
        world.place_fixture(id)

    time_scale = read_rig(rig).emulation.time_scale
    return EmulatedWorld(world, {"fixture.place": place}, time_scale, partial(write_truth, world.truth))


def _hand_held(rig: Mapping[str, Any], seed: int | None, hidden: Sequence[Defect]) -> EmulatedWorld:
    if hidden:
        kinds = ", ".join(defect.KIND for defect in hidden)
        raise WorldError(f"hidden {kinds}: a hand-held arm has its mechanisms in [emulation]; set them there")
    world = HandWorld.from_rig(rig, seed=seed)
    time_scale = read_hand_rig(rig).emulation.time_scale
    return EmulatedWorld(world, world.verbs, time_scale, partial(write_hand_truth, world.truth))


def _shaft(rig: Mapping[str, Any], seed: int | None, hidden: Sequence[Defect], given: Given | None) -> EmulatedWorld:
    if hidden or given is not None:
        raise WorldError("a rig without an arm has its deviations in [emulation]; leave models and mechanisms out")
    world = ShaftWorld.from_rig(rig, seed=seed)
    return EmulatedWorld(world, world.verbs, read_shaft(rig).time_scale, world.write_truth)


AUTO = "auto"
AUTO_HOSTS = tuple(f"127.0.0.{x}" for x in range(2, 255))  # Linux answers on all of 127/8; elsewhere name 127.0.0.1

Announcement = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class ServeOptions:
    """What a start may set beside the rig; None leaves what the rig states."""

    robot_host: str | None = None  # an address, or "auto": the first 127.0.0.x that is free
    truth_path: Path | None = None  # where the concealed truth is written, outside of any recording
    seed: int | None = None
    time_scale: float | None = None  # emulated seconds per real second
    expose: bool = False  # devices may listen on addresses that other machines reach
    control_host: str = "127.0.0.1"  # of the side channel; anywhere but on loopback it wants a token
    links: bool = True  # make the symbolic links that the rig names as serial ports
    end_with_stdin: bool = False  # stop when stdin closes, so that a parent that dies leaves no emulators behind
    hidden: Sequence[Mapping[str, Any]] = ()  # mechanisms at work in the world, see simulators/defects/mechanisms.py
    mechanisms: Sequence[Defect] = ()  # further ones, as records
    given: Given | None = None  # the rig's geometry in numbers, instead of a drawn one


class _Stop:
    """Set by signals and by the end of stdin; a plain flag, because a signal may come while it is being set."""

    def __init__(self) -> None:
        self.asked = False

    def ask(self) -> None:
        self.asked = True


def serve(rig: Mapping[str, Any], options: ServeOptions, announce: Callable[[Announcement], None]) -> None:
    """Emulates until SIGTERM or SIGINT (or end of stdin); `announce` is called once when every port is open.

    Must run in the main thread, for only that takes signals. Raises WorldError for a rig that cannot be emulated,
    WrittenError for mechanisms that cannot be read, PortBusy and HostError for ports that cannot be opened.
    """
    hidden = (*defects_of(options.hidden), *options.mechanisms)
    world = world_of(rig, options.seed, hidden, options.given)
    time_scale = _time_scale(world, options)
    auto = options.robot_host == AUTO
    devices = build_devices(world.physics, rig, AUTO_HOSTS[0] if auto else options.robot_host)
    if not options.links:
        devices = without_links(devices)
    if not options.expose:
        check_private(devices)
    token = None if is_loopback(options.control_host) else secrets.token_urlsafe(24)
    control = Control(options.control_host, token)
    if options.truth_path is not None:
        world.write_truth(options.truth_path)
    with _stop_on_signals() as stop:
        robot_hosts = AUTO_HOSTS if auto and devices.robot is not None else (None,)
        host, devices = _open_host(devices, world, time_scale, robot_hosts, control)
        try:
            if options.end_with_stdin:
                _stop_at_end_of(sys.stdin.fileno(), host, stop)
            where = addresses(host, devices, rig)
            if control.token is not None:
                where["control"]["token"] = control.token
            announce(where)
            host.run(lambda: stop.asked)
        finally:
            host.close()


def _time_scale(world: EmulatedWorld, options: ServeOptions) -> float:
    time_scale = world.time_scale if options.time_scale is None else options.time_scale
    if not (math.isfinite(time_scale) and time_scale > 0.0):
        raise HostError(f"time scale {time_scale!r}; give emulated seconds per real second, above 0")
    return time_scale


def _open_host(
    devices: EmulatedDevices,
    world: EmulatedWorld,
    time_scale: float,
    robot_hosts: Sequence[str | None],
    control: Control,
) -> tuple[Host, EmulatedDevices]:
    """Opens all ports, the robot's on the first of `robot_hosts` that is free (None: where it was built for).

    Trying is opening, so two emulators that start at the same time cannot choose the same address.
    """
    for robot_host in robot_hosts:
        moved = devices if robot_host is None else with_robot_on(devices, robot_host)
        try:
            return _start_host(moved, world, time_scale, control), moved
        except PortBusy as busy:
            if robot_host is None or busy.host != robot_host:
                raise
    raise HostError(f"robot: no address from {robot_hosts[0]} to {robot_hosts[-1]} is free; stop some emulators")


def _start_host(devices: EmulatedDevices, world: EmulatedWorld, time_scale: float, control: Control) -> Host:
    def pace() -> dict[str, float]:
        return {"ticks": host.ticks, "stalls": host.pace.stalls, "lost_s": host.pace.lost_s}

    verbs: dict[str, Callable[..., Any]] = {
        **world.verbs,
        "world.time": lambda: world.physics.time_s,
        "host.pace": pace,
        **fault_verbs(devices.injectors),
    }
    for bench in devices.benches:
        verbs.update(bench.verbs)
    bench = Bench(
        instruments=[instrument for bench in devices.benches for instrument in bench.instruments],
        ports=[*(port for bench in devices.benches for port in bench.ports), side_channel(verbs, control)],
    )
    host = Host(bench, world.physics, time_scale=time_scale)
    return host


@contextmanager
def _stop_on_signals() -> Generator[_Stop, None, None]:
    """Turns SIGTERM and SIGINT into a wish to stop, so that links are removed and clients see a clean end."""
    stop = _Stop()

    def on_signal(number: int, frame: FrameType | None) -> None:
        stop.ask()

    before = {number: signal.signal(number, on_signal) for number in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _stop_at_end_of(fd: int, host: Host, stop: _Stop) -> None:
    def readable() -> None:
        if not os.read(fd, 4096):
            stop.ask()

    host.watch(fd, readable)
