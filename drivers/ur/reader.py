"""Lossless recorder of a UR controller over RTDE; it never moves anything.

    reader = UrReader("192.168.0.10"); reader.connect(); block = reader.read(0.5)

ur_rtde's own receive object drops samples by design (only the latest counts), so this one has its own codec. No thread
of its own: whoever reads must read often enough for the socket buffer (0.5 s at least), or the controller drops samples
and the gap shows in `sequence`.

`VARIABLES` are the RTDE names, and the names and units under which they are recorded. Source: Universal Robots,
"Real-Time Data Exchange (RTDE) Guide", table of controller outputs (units: rad, rad/s, A, degC, kg; states as
numbers).
"""

import contextlib
import logging
import math
import select
import socket
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from drivers.clock import Clock
from drivers.device import Block, Channel, Stamps, StreamDevice
from drivers.errors import DeviceLost, DeviceRefused, DeviceStale, WireError
from drivers.ur.rtde_codec import (
    DTYPES,
    ControllerVersion,
    Data,
    Message,
    OutputsAnswer,
    ProtocolAnswer,
    RtdeCodec,
    RtdeJunk,
    StartAnswer,
    TextMessage,
    Unknown,
    encode_outputs_request,
    encode_protocol_request,
    encode_start,
    encode_version_request,
)

RTDE_PORT = 30004
ANSWER_TIMEOUT_S = 1.0  # real controllers answer within a few cycles; busy ones within tenths
CONNECT_TIMEOUT_S = 1.5  # a lost first packet is sent again after 1 s
READ_BYTES = 1 << 18
RECEIVE_BUFFER_BYTES = 1 << 20  # about 3 s of this recipe at 500 Hz (349 bytes), if the system grants it
RESTARTED_S = 0.1  # a clock that goes back by more than packages could be late
WAKE_S = 0.01  # wait for so much of the stream: reading one package costs as much as five, and 10 ms hurt nobody

Answer = TypeVar("Answer", ProtocolAnswer, ControllerVersion, OutputsAnswer, StartAnswer)
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Variable:
    """One RTDE variable and its channel."""

    rtde_name: str
    channel: Channel


TIMESTAMP = "timestamp"  # s since the controller's start: the device clock, no channel
SIX = (6,)
VARIABLES = (
    Variable("target_q", Channel("target_q_rad", "rad", SIX)),
    Variable("actual_q", Channel("actual_q_rad", "rad", SIX)),
    Variable("actual_qd", Channel("actual_qd_rad_s", "rad/s", SIX)),
    Variable("actual_current", Channel("actual_current_a", "A", SIX)),
    Variable("joint_temperatures", Channel("joint_temperature_degC", "degC", SIX)),
    Variable("robot_mode", Channel("robot_mode", "1")),
    Variable("safety_mode", Channel("safety_mode", "1")),
    Variable("safety_status_bits", Channel("safety_status_bits", "1")),
    Variable("runtime_state", Channel("runtime_state", "1")),
    Variable("robot_status_bits", Channel("robot_status_bits", "1")),
    Variable("joint_mode", Channel("joint_mode", "1", SIX)),
    Variable("speed_scaling", Channel("speed_scaling", "1")),
    Variable("target_speed_fraction", Channel("speed_slider", "1")),
    Variable("actual_TCP_pose", Channel("actual_tcp_pose_m_rad", "m, rad", SIX)),
    Variable("tcp_offset", Channel("tcp_offset_m_rad", "m, rad", SIX)),  # from PolyScope 5.x on
    Variable("actual_digital_input_bits", Channel("digital_inputs", "1")),
    Variable("actual_digital_output_bits", Channel("digital_outputs", "1")),
    Variable("standard_analog_input0", Channel("analog_input0", "1")),  # V or A, as the installation states
    Variable("standard_analog_input1", Channel("analog_input1", "1")),
    Variable("payload", Channel("payload_kg", "kg")),  # from PolyScope 3.11 / 5.5.1 on
    Variable("payload_cog", Channel("payload_cog_m", "m", (3,))),
)
REQUIRED = (TIMESTAMP, "actual_q")  # without these there is nothing to record
NOT_FOUND = "NOT_FOUND"


class UrReader(StreamDevice[socket.socket]):
    """A `Device`: joints, currents, temperatures and states at up to 500 Hz."""

    stamps: Stamps = "sampled"

    def __init__(
        self,
        host: str,
        rate_hz: float = 500.0,
        *,
        port: int = RTDE_PORT,
        name: str = "robot",
        clock: Clock | None = None,
    ) -> None:
        super().__init__(name, clock)
        self.version: ControllerVersion | None = None
        self.missing: tuple[str, ...] = ()  # variables that this controller does not have
        self._host, self._port, self._rate_hz = host, port, rate_hz
        self._codec = RtdeCodec()
        self._channels: tuple[tuple[str, Channel], ...] = ()
        self._unread: list[Message] = []
        self._first_s: float | None = None  # device time of the first sample: number 0
        self._last_s = -math.inf  # and of the newest

    @property
    def place(self) -> str:
        return f"{self.name} at {self._host}:{self._port}"

    def describe(self) -> tuple[Channel, ...]:
        """The channels of this controller; known after `connect`."""
        return tuple(channel for _, channel in self._channels)

    def read(self, timeout_s: float) -> Block:
        """All samples since the last read, at least one; a package that was sent twice counts once.

        DeviceStale: nothing new within `timeout_s`. DeviceLost: the line is closed, or the controller has started
        again. WireError: bytes that are no RTDE.
        """
        deadline_s = self._clock.now_s() + timeout_s
        while True:
            packages = [message.packages for message in self._take_messages() if isinstance(message, Data)]
            if packages and len(new := self._new(np.concatenate(packages))):
                return self._block(new)
            if not self._receive(self._left_s(deadline_s)):
                raise DeviceStale(
                    f"{self.place}: no sample for {timeout_s:.3g} s while the line is open; "
                    "the controller is hung or its stream is paused: check the pendant, then connect again"
                )

    # --- the line

    def _set_up(self, line: socket.socket) -> None:
        """Start the stream. DeviceStale: no answer. DeviceRefused or WireError: not an RTDE server of version 2."""
        self._negotiate()

    def _release(self, line: socket.socket) -> None:
        line.close()

    def _open(self) -> socket.socket:
        self._codec, self._unread, self._first_s, self._last_s = RtdeCodec(), [], None, -math.inf
        try:
            line = socket.create_connection((self._host, self._port), CONNECT_TIMEOUT_S)
        except OSError as error:
            raise DeviceLost(
                f"{self.place}: cannot connect within {CONNECT_TIMEOUT_S:.3g} s ({error.strerror or error}); "
                "check that the controller is on, the address in [devices.robot] and the network cable"
            ) from error
        line.setblocking(False)
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with contextlib.suppress(OSError):  # a system that grants less is good enough
            line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        return line

    def _receive(self, timeout_s: float) -> bool:
        """Bytes into messages; False when none came in time. DeviceLost when the line is closed."""
        line = self._opened()
        # a timeout with fewer bytes than the low-water mark is no silence: read what there is
        waiter = select.poll()
        waiter.register(line, select.POLLIN)
        waiter.poll(1e3 * max(0.0, timeout_s))
        try:
            data = line.recv(READ_BYTES)
        except BlockingIOError:
            return False
        except OSError as error:
            raise self._lost(error.strerror or str(error)) from error
        if not data:
            raise self._lost("the controller closed the connection")
        self._unread += self._codec.feed(data)
        return True

    def _take_messages(self) -> list[Message]:
        """What has come; text is logged. WireError when it is no RTDE."""
        messages, self._unread = self._unread, []
        for message in messages:
            if isinstance(message, RtdeJunk):
                raise WireError(
                    f"{self.place}: no RTDE at byte {message.offset} of the stream: {message.head.hex(' ')}; "
                    "is this the RTDE port of a UR controller (30004)?"
                )
            if isinstance(message, TextMessage):
                log.info("%s: %s: %s", self.place, message.source, message.text)
        return messages

    def _send(self, data: bytes) -> None:
        try:
            self._opened().sendall(data)  # a few dozen bytes into an empty buffer: never partial
        except OSError as error:
            raise self._lost(error.strerror or str(error)) from error

    def _lost(self, reason: str) -> DeviceLost:
        self.close()
        return DeviceLost(f"{self.place}: {reason}; check power and cable of the controller, then connect again")

    # --- the conversation

    def _negotiate(self) -> None:
        self._send(encode_protocol_request())
        if not self._await(ProtocolAnswer).accepted:
            raise DeviceRefused(
                f"{self.place}: the controller does not speak RTDE version 2; update PolyScope (>= 3.10)"
            )
        self._send(encode_version_request())
        self.version = self._await(ControllerVersion)
        names = (TIMESTAMP, *(variable.rtde_name for variable in VARIABLES))
        answer = self._ask_for(names)
        self.missing = tuple(name for name, kind in zip(names, answer.types, strict=True) if kind == NOT_FOUND)
        if self.missing:
            names = tuple(name for name in names if name not in self.missing)
            answer = self._ask_for(names)
            log.warning("%s: not recorded, this controller does not have: %s", self.place, ", ".join(self.missing))
        self._codec.expect(answer.recipe_id, names, answer.types)
        self._channels = tuple((v.rtde_name, v.channel) for v in VARIABLES if v.rtde_name in names)
        self._check_shapes(dict(zip(names, answer.types, strict=True)))
        self._send(encode_start())
        if not self._await(StartAnswer).accepted:
            raise DeviceRefused(f"{self.place}: the controller refuses to start the stream; restart it")
        size_bytes = 4 + sum(np.dtype(DTYPES[kind]).itemsize for kind in answer.types)
        self._opened().setsockopt(
            socket.SOL_SOCKET, socket.SO_RCVLOWAT, max(1, round(WAKE_S * self._rate_hz)) * size_bytes
        )

    def _ask_for(self, names: Sequence[str]) -> OutputsAnswer:
        """The answer with one known type, or NOT_FOUND, for each name. DeviceRefused when a needed one is missing."""
        self._send(encode_outputs_request(self._rate_hz, names))
        answer = self._await(OutputsAnswer)
        odd = [kind for kind in answer.types if kind not in DTYPES and kind != NOT_FOUND]
        if odd or len(answer.types) != len(names):
            raise WireError(
                f"{self.place}: asked for {len(names)} variables, answered types {','.join(answer.types)!r}; "
                "this controller's RTDE is not the one of the RTDE guide"
            )
        for name in REQUIRED:
            if answer.types[names.index(name)] == NOT_FOUND:
                raise DeviceRefused(f"{self.place}: the controller has no variable {name!r}; it cannot be recorded")
        return answer

    def _check_shapes(self, types: Mapping[str, str]) -> None:
        for name, channel in self._channels:
            if DTYPES[types[name]][1] != channel.shape:
                raise WireError(f"{self.place}: {name} comes as {types[name]}, the shape {channel.shape} is expected")

    def _await(self, kind: type[Answer]) -> Answer:
        """The next message of that kind. DeviceRefused when the controller states otherwise, DeviceStale on silence."""
        deadline_s = self._clock.now_s() + ANSWER_TIMEOUT_S
        while True:
            messages = self._take_messages()
            for index, message in enumerate(messages):
                if isinstance(message, kind):
                    self._unread = messages[index + 1 :] + self._unread
                    return message
                self._refuse(message)
            if not self._receive(self._left_s(deadline_s)):
                raise DeviceStale(
                    f"{self.place}: no {kind.__name__} within {ANSWER_TIMEOUT_S:.3g} s; "
                    "is this the RTDE port of a UR controller (30004)?"
                )

    def _refuse(self, message: Message) -> None:
        if isinstance(message, TextMessage) and message.level <= 1:
            raise DeviceRefused(f"{self.place}: the controller reports: {message.text}")
        if isinstance(message, Unknown):
            raise WireError(
                f"{self.place}: unexpected package of type {message.kind}: {message.payload[:32].hex(' ')}; "
                "is this the RTDE port of a UR controller (30004)?"
            )

    def _new(self, packages: np.ndarray) -> np.ndarray:
        """Those whose time stamp is later than all before."""
        stamps_s = packages[TIMESTAMP].astype(np.float64)
        newest_s = np.maximum.accumulate(np.concatenate(([self._last_s], stamps_s)))
        if (stamps_s < newest_s[:-1] - RESTARTED_S).any():
            raise self._lost(f"its clock went back from {newest_s[-1]:.3f} to {stamps_s.min():.3f} s, it has restarted")
        self._last_s = float(newest_s[-1])
        return packages[stamps_s > newest_s[:-1]]

    def _block(self, packages: np.ndarray) -> Block:
        device_s = packages[TIMESTAMP].astype(np.float64)
        if self._first_s is None:
            self._first_s = float(device_s[0])
        return Block(
            host_s=np.full(len(packages), self._clock.now_s()),
            device_s=device_s,
            sequence=np.round((device_s - self._first_s) * self._rate_hz).astype(np.int64),
            values={channel.name: _native(packages[name]) for name, channel in self._channels},
        )


def _native(values: np.ndarray) -> np.ndarray:
    """Native byte order; floats as float64, states as int64."""
    return values.astype(np.float64 if values.dtype.kind == "f" else np.int64)
