"""Six encoders, their bus and its adapter as one bench, with the verbs of the side channel.

An encoder that sends by itself, without any protocol above the frame: rigs/encoders-plain.dbc in Python.

Frame 0x100 + node every period: angle i32 little endian, 2^20 a turn, rising counter-clockwise; a counter of frames u8;
a byte whose bit 0 means that the encoder is at fault. Does not imitate: drift of its clock, a start that takes time.
"""

import math
import struct
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from simulators.encoders.bus import CanBus, CanFrame, Node, SlcanAdapter
from simulators.encoders.node import EncoderNode
from simulators.wire import Bench, SerialPort

FIRST_ID = 0x100
UNITS_PER_TURN = 1 << 20
SLACK_S = 1e-6  # sums of seconds in floating point are not exact


class PlainEncoder:
    """A node of `simulators.encoders.bus`: takes nothing, sends on its own time."""

    def __init__(self, node_id: int, angle_rad: Callable[[], float], period_s: float) -> None:
        self.node_id = node_id
        self.silent = False  # fault: as if its plug were pulled
        self._angle_rad = angle_rad
        self._period_s = period_s
        self._next_s = 0.0
        self._counter = 0
        self._fault = 0

    def handle(self, frame: CanFrame, now_s: float) -> list[CanFrame]:
        """No message of others concerns it."""
        return []

    def due(self, now_s: float) -> list[CanFrame]:
        if now_s < self._next_s - SLACK_S:
            return []
        self._next_s = max(self._next_s + self._period_s, now_s)
        units = math.floor(self._angle_rad() / math.tau * UNITS_PER_TURN)
        wrapped = (units + (1 << 31)) % (1 << 32) - (1 << 31)
        data = struct.pack("<iBB", wrapped, self._counter, self._fault)
        self._counter = (self._counter + 1) % 256
        return [] if self.silent else [CanFrame(FIRST_ID + self.node_id, data)]

    def raise_emergency(self, code: int) -> None:
        """Any code but 0 sets the fault bit."""
        self._fault = int(code != 0)

    def reset(self) -> None:
        """A power dip: the counter begins again."""
        self._counter = self._fault = 0


DEFAULT_BITRATE = 1_000_000
DEFAULT_SYNC_HZ = 200.0
PLAIN = "can-dbc"  # the rig's word for encoders that send by themselves


class TurningShafts(Protocol):
    """What encoders need of a world."""

    @property
    def time_s(self) -> float: ...

    def link_encoders_rad(self) -> NDArray[np.float64]: ...


class EncoderBus:
    """An instrument of `simulators.wire`: the nodes' timers and the bus follow the world's time."""

    name = "encoders"

    def __init__(self, world: TurningShafts, bus: CanBus) -> None:
        self._world = world
        self._bus = bus

    def before_step(self, t_s: float) -> None:
        """Nothing: encoders only look."""

    def after_step(self, t_s: float) -> None:
        self._bus.poll_nodes(self._world.time_s)
        self._bus.run(self._world.time_s)


def build(world: TurningShafts, rig: Mapping[str, Any]) -> Bench:
    """One node for each of `rig["devices"]["encoders"]["nodes"]`, the first on joint 1; linked when a path is named.

    With driver "can-dbc" one plain encoder for each of `signals`, nodes 1, 2, ...: those of rigs/encoders-plain.dbc.

    Verbs: "encoders.silence" {node, on}, "encoders.emergency" {node, code} (0 ends it), "encoders.reset" {node} (a
    power dip: boot-up without being asked). ValueError for more nodes than joints or a node twice.
    """
    device = rig["devices"]["encoders"]
    plain = device.get("driver") == PLAIN
    numbers = list(range(1, len(device["signals"]) + 1)) if plain else [int(number) for number in device["nodes"]]
    joints = len(world.link_encoders_rad())
    if len(numbers) > joints or len(set(numbers)) != len(numbers):
        raise ValueError(
            f"devices.encoders.nodes {numbers}: give different nodes, at most one for each of {joints} joints"
        )
    period_s = 1.0 / float(device.get("sync_hz", DEFAULT_SYNC_HZ))
    nodes: list[Node] = [
        PlainEncoder(number, _shaft(world, joint), period_s) if plain else EncoderNode(number, _shaft(world, joint))
        for joint, number in enumerate(numbers)
    ]
    bus = CanBus(int(device.get("bitrate", DEFAULT_BITRATE)), nodes)
    channel = str(device.get("channel", ""))
    port = SerialPort("can", SlcanAdapter(bus, world), channel if "/" in channel else None)
    return Bench((EncoderBus(world, bus),), (port,), _verbs(nodes))


def _shaft(world: TurningShafts, joint: int) -> Callable[[], float]:
    return lambda: float(world.link_encoders_rad()[joint])


def _verbs(nodes: list[Node]) -> dict[str, Callable[..., Any]]:
    def named(number: int) -> Node:
        for node in nodes:
            if node.node_id == number:
                return node
        raise ValueError(f"encoder node {number}: there are {[node.node_id for node in nodes]}")

    def silence(node: int, on: bool = True) -> None:
        named(node).silent = on

    def emergency(node: int, code: int) -> None:
        named(node).raise_emergency(code)

    def reset(node: int) -> None:
        named(node).reset()

    return {"encoders.silence": silence, "encoders.emergency": emergency, "encoders.reset": reset}
