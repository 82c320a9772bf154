"""Moves an arm behind a PLC by a handshake in registers (docs/protocols/modbus.md).

The stop is a level, not an event: while the stop register is set the controller's program brakes and takes no command,
so a stop can be repeated, and a command that crosses it on the way is refused. While the arm moves, this side counts
`host_life` up; a program that does not see it count brakes by itself.
"""

import contextlib
import math
import threading
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike

from drivers.clock import Clock, SystemClock
from drivers.device import Floats
from drivers.errors import DeviceError, DeviceLost, DeviceRefused, DeviceStale
from drivers.modbus.line import ModbusLine
from drivers.modbus.register_map import ANSWERS, COMMANDS, RegisterMap

POLL_S = 0.02  # between two readings of a running move
LIFE_S = 0.1  # between two counts of host_life, a tenth of what the controller's program waits for
BEGIN_LIMIT_S = 4.0  # from the call to the command's number: four writes of up to 0.75 s each, and room
TAKEN_LIMIT_S = 1.0  # from the command's number to the program's answer: some cycles
STANDING_LIMIT_S = 1.5  # braking from full speed, with room
MARGIN_S = 3.0
SLOWEST_OVERRIDE = 0.1  # an operator may slow the arm down to this without making a move fail
FULL_RANGE_RAD = 4.0 * math.pi
NUMBERS = 65535  # command numbers go from 1 to this, and begin again


class State(IntEnum):
    """What the controller's program reports of the command whose number it shows."""

    NONE = 0
    MOVING = 1
    ARRIVED = 2
    REFUSED = 3
    STOPPED = 4


REASONS = {
    0: "no reason given",
    1: "the stop register is set",
    2: "this program was silent too long",
    3: "a number lies outside what the arm can do",
    4: "protective stop: clear the cause and unlock it at the controller",
    5: "emergency stop: release it and switch the motors on at the controller",
    6: "the motors are off, or the controller is not in automatic mode",
}


class ModbusArm:
    """A `Movable`. One thread moves, any thread may stop. ValueError when the map has no handshake."""

    def __init__(
        self,
        line: ModbusLine,
        registers: RegisterMap,
        *,
        name: str = "robot",
        life_s: float = LIFE_S,
        clock: Clock | None = None,
    ) -> None:
        """`life_s`: host time between two counts of host_life."""
        if registers.missing_for_motion:
            raise ValueError(
                f"{name}: its register map cannot move it, these are missing: {', '.join(registers.missing_for_motion)}"
            )
        self.name = name
        self._line, self._map = line, registers
        self._clock: Clock = clock or SystemClock()
        self._requests = registers.requests(list(ANSWERS))
        self._moving = threading.Lock()
        self._ordering = threading.Lock()  # a stop falls before a command or after it, never between check and number
        self._stops = 0
        self._held = True
        self._delivering = False  # another thread is writing a stop at this moment
        self._number = self._life = 0
        self._life_s, self._counted_s = life_s, -math.inf

    def connect(self) -> None:
        """Takes the motion over. DeviceLost, DeviceStale; DeviceRefused when it still moves for somebody else."""
        stops = self._stops
        self._line.connect()
        state, number, _ = self._answer()
        if state is State.MOVING:
            raise DeviceRefused(f"{self._line.place}: the arm moves; wait until it stands, then connect again")
        self._number = number
        with self._ordering:
            if self._stops != stops:  # stopped while connecting
                raise DeviceRefused(f"{self._line.place}: stopped by stop() while connecting; connect again")
            self._put("command_number", number)  # a command that was never taken must not run when the stop is lifted
            self._put("stop", 0)
            self._held = False

    def move_joints(self, q_rad: ArrayLike, speed_rad_s: float, acceleration_rad_s2: float) -> None:
        """To joint readings (6,) in rad; blocks until the arm has arrived.

        DeviceRefused: stopped, or not taken (the message states why). DeviceLost, DeviceStale: no line any more.
        """
        target_rad = _checked(q_rad, speed_rad_s, acceleration_rad_s2)
        with self._moving:
            stops, begin_s = self._stops, self._clock.now_s()
            try:
                self._put("command_q_rad", target_rad)
                self._put("command_speed_rad_s", speed_rad_s)
                self._put("command_acceleration_rad_s2", acceleration_rad_s2)
                self._count_life()
                self._order(stops, begin_s)
                limit_s = (FULL_RANGE_RAD / speed_rad_s + speed_rad_s / acceleration_rad_s2) / SLOWEST_OVERRIDE
                self._await_arrival(limit_s + MARGIN_S)
            except (DeviceLost, DeviceStale):
                self._give_up()
                raise

    def stop(self, deceleration_rad_s2: float = math.nan) -> None:
        """Brakes, from any thread and in every state; a move that is under way ends with DeviceRefused.

        The handshake has one way to brake, whatever deceleration is asked for.
        DeviceLost when the stop cannot be delivered, DeviceStale when the arm goes on: press the emergency stop.
        """
        self._brake(hold=False)

    def hold(self) -> None:
        """As `stop`; every motion is refused from now on, until `connect`."""
        self._brake(hold=True)

    def close(self) -> None:
        """Leaves the arm standing. The line is closed by who owns it too; safe in every state and more than once."""
        self._line.close()

    # --- inside

    def _order(self, stops: int, begin_s: float) -> None:
        with self._ordering:
            if self._clock.now_s() - begin_s > BEGIN_LIMIT_S:
                raise DeviceStale(
                    f"{self._line.place}: a motion was {self._clock.now_s() - begin_s:.1f} s old before it could be "
                    "sent, and is not carried out; connect again"
                )
            if self._held:
                raise DeviceRefused(f"{self._line.place}: stopped by stop(), or not connected; connect again")
            if self._stops != stops:
                raise DeviceRefused(f"{self._line.place}: the motion was ended by stop() before it began")
            self._number = self._number % NUMBERS + 1
            self._put("command_number", self._number)

    def _give_up(self) -> None:
        """It is unknown whether the command arrived: a program that takes it late must find the stop set.

        On a dead line a stop takes more than a second to be found undeliverable: who is writing one already need not be
        waited for, and does not lift it again, because the arm is held.
        """
        self._held = True
        if self._delivering:
            return
        with self._ordering, contextlib.suppress(DeviceError):
            self._put("stop", 1)

    def _await_arrival(self, limit_s: float) -> None:
        begin_s = self._clock.now_s()
        while True:
            state, number, reason = self._answer()
            waited_s = self._clock.now_s() - begin_s
            if number == self._number and state is State.ARRIVED:
                return
            if number == self._number and state in (State.REFUSED, State.STOPPED):
                how = "is refused" if state is State.REFUSED else "was ended"
                why = REASONS.get(reason, f"code {reason} of the controller's program")
                raise DeviceRefused(f"{self._line.place}: the motion {how}: {why}")
            if number != self._number and waited_s > TAKEN_LIMIT_S:
                raise DeviceStale(
                    f"{self._line.place}: command {self._number} was not taken within {TAKEN_LIMIT_S:.3g} s, it shows "
                    f"{number}; is the controller's motion program running?"
                )
            if waited_s > limit_s:
                raise DeviceStale(f"{self._line.place}: no end of the motion within {limit_s:.3g} s; check its pendant")
            self._count_life()
            self._clock.sleep_s(POLL_S)

    def _brake(self, *, hold: bool) -> None:
        with self._ordering:
            self._stops += 1
            self._held = self._held or hold
            self._delivering = True
            try:
                self._put_stop()
            finally:
                self._delivering = False
        begin_s = self._clock.now_s()
        while self._answer()[0] is State.MOVING:
            if self._clock.now_s() - begin_s > STANDING_LIMIT_S:
                raise DeviceStale(
                    f"{self._line.place}: still moves {STANDING_LIMIT_S:.3g} s after the stop; press the emergency stop"
                )
            self._clock.sleep_s(POLL_S)
        with self._ordering:
            if not self._held:
                self._put("stop", 0)

    def _put_stop(self) -> None:
        try:
            self._put("stop", 1)
        except DeviceError:
            self._once_more()

    def _once_more(self) -> None:
        """The first try may only have found out that the old connection was dead."""
        try:
            self._put("stop", 1)
        except DeviceError as error:
            raise DeviceLost(
                f"{self._line.place}: the stop cannot be delivered; the controller's program brakes when it misses "
                "host_life: press the emergency stop if the arm moves"
            ) from error

    def _answer(self) -> tuple[State, int, int]:
        words: dict[tuple[str, int], int] = {}
        for request in self._requests:
            raw = self._line.read(request.table, request.address, request.count)
            words.update({(request.table, request.address + index): word for index, word in enumerate(raw)})
        state, number, reason = (round(float(self._map.decode(name, words)[0])) for name in ANSWERS)
        if state not in set(State):
            raise DeviceRefused(f"{self._line.place}: state {state} is none of the handshake; check the register map")
        return State(state), number, reason

    def _count_life(self) -> None:
        now_s = self._clock.now_s()
        if now_s - self._counted_s < self._life_s:
            return
        self._counted_s = now_s
        self._life = self._life % NUMBERS + 1
        self._put("host_life", self._life)

    def _put(self, name: str, value: ArrayLike) -> None:
        register = self._map.registers[name]
        values = np.broadcast_to(np.asarray(value, np.float64), (COMMANDS[name],))
        self._line.write(register.address, register.encode(values.tolist()))


def _checked(q_rad: ArrayLike, speed_rad_s: float, acceleration_rad_s2: float) -> Floats:
    target_rad = np.array(q_rad, np.float64)
    if target_rad.shape != (COMMANDS["command_q_rad"],) or not np.isfinite(target_rad).all():
        raise ValueError(f"q_rad = {target_rad.tolist()}: six finite numbers are needed")
    if not (0.0 < speed_rad_s < math.inf and 0.0 < acceleration_rad_s2 < math.inf):
        raise ValueError(f"speed {speed_rad_s}, acceleration {acceleration_rad_s2}: both must be positive and finite")
    return target_rad
