"""Moves a UR arm through ur_rtde, which runs in a child process that may hang or crash without harm.

    control = UrControl("192.168.0.10"); control.connect(); control.move_joints(q_rad, 1.0, 3.0); control.close()

How a stop reaches the arm: the child watches a line of its own for it and brakes; if it does not answer within tenths,
the program is stopped through the dashboard, which needs neither the child nor RTDE. If that fails too, the child is
killed and the controller's watchdog, which nobody kicks any more, ends the program. A child that is frozen or gone
is noticed within tenths, and the arm stopped the same way; a program that is frozen is noticed by its child.
After any fault the child is killed: call `connect` again, it starts a new one.
"""

import contextlib
import math
import threading

import numpy as np
from numpy.typing import ArrayLike

from drivers.clock import Clock, SystemClock
from drivers.device import Floats
from drivers.errors import DeviceError, DeviceLost, DeviceRefused, DeviceStale
from drivers.ur.control_link import Ended, Freedrive, Motion, MoveJoints, Outcome, ServoJoints, ServoStop
from drivers.ur.dashboard import UrDashboard
from drivers.ur.pulse import check_stream
from drivers.ur.supervised import SupervisedChild

WATCHDOG_HZ = 1.0
CONNECT_LIMIT_S = 15.0  # ur_rtde itself waits 5 s for its program to run
MARGIN_S = 3.0  # settling, round trips, a busy machine
SLOWEST_SPEED_SLIDER = 0.1  # an operator may slow the arm down to this without making a move fail
FULL_RANGE_RAD = 4.0 * math.pi  # -360..360 deg: the longest way of a joint
STOP_DECELERATION_RAD_S2 = 5.0  # from 1 rad/s within 0.1 rad; feels right for a laser on the flange
N_JOINTS = 6


class UrControl:
    """A `Movable`. One thread moves, any thread may stop."""

    def __init__(
        self,
        host: str,
        *,
        name: str = "robot",
        watchdog_hz: float = WATCHDOG_HZ,
        dashboard: UrDashboard | None = None,
        clock: Clock | None = None,
    ) -> None:
        """`watchdog_hz`: the arm stops when this program was silent for one period of it."""
        self.name = name
        self._host, self._watchdog_hz = host, watchdog_hz
        self._clock: Clock = clock or SystemClock()
        self._dashboard = dashboard or UrDashboard(host)
        self._child: SupervisedChild | None = None
        self._calling = threading.Lock()
        self._stopping = threading.Lock()
        self._holds = 0
        self._q_rad: Floats | None = None  # where the last move ended, when known

    @property
    def place(self) -> str:
        return f"{self.name} at {self._host}"

    def connect(self, limit_s: float = CONNECT_LIMIT_S) -> None:
        """Starts the child and the control program.

        Ends the program that runs there. DeviceRefused: stopped, switched off, or not in remote control. DeviceLost,
        DeviceStale: no controller there.
        """
        self.close()
        holds = self._holds
        self._check_state()
        check_stream(self._host, self.place, self._clock)
        with contextlib.suppress(
            DeviceRefused
        ):  # none runs; to end one whose client died ur_rtde would wait for minutes
            self._dashboard.stop()
        child = SupervisedChild(self._host, self._watchdog_hz, self.place, self._clock)
        try:
            answer = child.wait_ready(limit_s)
            if isinstance(answer, Ended):
                raise DeviceRefused(f"{self.place}: no control: {answer.text}; check the pendant, then connect again")
        except BaseException:
            child.kill()
            child.release()
            raise
        with self._stopping:
            if self._holds != holds:  # held while connecting
                child.hold()
            self._child = child

    def move_joints(self, q_rad: ArrayLike, speed_rad_s: float, acceleration_rad_s2: float) -> None:
        """To joint readings (6,) in rad; blocks until the arm has arrived.

        DeviceRefused: stopped meanwhile (the message states by what), or the controller does not take the numbers.
        DeviceLost, DeviceStale: no control any more; the arm was stopped by another way.
        """
        target_rad = _six_numbers(q_rad, "q_rad")
        _check_rates(speed_rad_s, acceleration_rad_s2)
        way_rad = FULL_RANGE_RAD if self._q_rad is None else float(np.abs(target_rad - self._q_rad).max())
        self._q_rad = None
        request = MoveJoints(target_rad.tolist(), speed_rad_s, acceleration_rad_s2)
        self._call(request, _limit_s(way_rad, speed_rad_s, acceleration_rad_s2))
        self._q_rad = target_rad

    def servo_joints(
        self, q_rad: ArrayLike, period_s: float = 0.002, lookahead_s: float = 0.1, gain: float = 300.0
    ) -> None:
        """One set-point (6,) of a stream; returns at once. `servo_stop` ends the stream. Raises as `move_joints`."""
        self._q_rad = None
        target_rad = _six_numbers(q_rad, "q_rad")
        self._call(ServoJoints(target_rad.tolist(), period_s, lookahead_s, gain), MARGIN_S)

    def servo_stop(self, deceleration_rad_s2: float = STOP_DECELERATION_RAD_S2) -> None:
        """Ends a stream of set-points; blocks until the arm stands. Raises as `move_joints`."""
        self._call(ServoStop(deceleration_rad_s2), MARGIN_S)

    def freedrive(self, on: bool) -> None:
        """Lets a person guide the arm, or holds it again. Raises as `move_joints`.

        `stop`, `close`, the end of this program and a lost connection end it, too: it is a mode of the control program.
        Source: Universal Robots, "URScript": freedrive_mode, end_freedrive_mode; the mode ends with the program.
        """
        self._q_rad = None
        self._call(Freedrive(on), MARGIN_S)

    def stop(self, deceleration_rad_s2: float = STOP_DECELERATION_RAD_S2) -> None:
        """Brakes, from any thread and in every state; a move that is under way ends with DeviceRefused.

        DeviceLost when no way to the controller is left: press the emergency stop.
        """
        self._brake(deceleration_rad_s2)

    def hold(self) -> None:
        """As `stop`; every motion from now on ends with DeviceRefused, until `connect`."""
        with self._stopping:
            self._holds += 1
            if self._child is not None:
                self._child.hold()
        self._brake()

    def close(self) -> None:
        """Ends the control program and the child; safe in every state and more than once."""
        child, self._child = self._child, None
        self._q_rad = None
        if child is None:
            return
        if not self._calling.acquire(blocking=False):  # a move of another thread: it ends with DeviceRefused
            child.kill()
            return
        try:
            child.end()
            child.kill()
            child.release()
        finally:
            self._calling.release()

    # --- inside

    def _brake(self, deceleration_rad_s2: float = STOP_DECELERATION_RAD_S2) -> None:
        with self._stopping:  # the child answers one at a time; the dashboard is asked by each for itself
            child = self._child
            if child is not None and child.stop(deceleration_rad_s2):
                return
            self._child = None  # who waits here finds it given up, and does not wait for it again
        self._stop_independently(child)

    def _call(self, request: Motion, limit_s: float) -> None:
        with self._calling:
            child = self._child
            if child is None:
                raise DeviceLost(f"{self.place}: not connected; call connect() first")
            try:
                ended = child.call(request, limit_s)
            except DeviceError as error:
                if child.killed:  # by stop() or close() of another thread
                    child.release()
                    raise DeviceRefused(f"{self.place}: the motion was ended by stop(); connect again") from error
                self._give_up(child)
                raise
            if ended.outcome is not Outcome.DONE:
                raise self._explained(child, ended)

    def _explained(self, child: SupervisedChild, ended: Ended) -> DeviceError:
        match ended.outcome:
            case Outcome.STOPPED:
                return DeviceRefused(f"{self.place}: the motion was ended by stop()")
            case Outcome.DISCONNECTED:
                self._give_up(child)
                return DeviceLost(
                    f"{self.place}: ur_rtde has lost the controller; check power and cable, then connect again"
                )
            case Outcome.SILENT:
                self._give_up(child)
                return DeviceStale(
                    f"{self.place}: the controller has sent nothing new for half a second; check the pendant, "
                    "then connect again"
                )
            case Outcome.EXPIRED:
                self._give_up(child)
                return DeviceStale(
                    f"{self.place}: this program or its control process was frozen; the arm was braked, and "
                    "what was commanded before is not carried out: connect again"
                )
            case Outcome.NOT_RUNNING:
                self._give_up(child)
                return self._why_not_running()
            case _:
                return DeviceRefused(f"{self.place}: {ended.text}")

    def _why_not_running(self) -> DeviceError:
        """What the dashboard reports of it."""
        try:
            self._check_state()
        except DeviceError as error:
            return error
        return DeviceRefused(
            f"{self.place}: the control program was stopped (pendant, dashboard, stop() or watchdog); connect again"
        )

    def _check_state(self) -> None:
        state = self._dashboard.state()
        if state.safety_status != "NORMAL":
            raise DeviceRefused(f"{self.place}: safety is {state.safety_status}; {_remedy(state.safety_status)}")
        if state.robot_mode != "RUNNING":
            raise DeviceRefused(
                f"{self.place}: the arm is in {state.robot_mode}; power on, release the brakes, then connect again"
            )
        if not state.remote_control:
            raise DeviceRefused(f"{self.place}: it is in local control; switch to remote control on the pendant")

    def _give_up(self, child: SupervisedChild) -> None:
        """The arm stopped by the other way, the child killed."""
        with contextlib.suppress(DeviceError):
            self._dashboard.stop()
        self._forget(child)
        child.release()

    def _stop_independently(self, child: SupervisedChild | None) -> None:
        try:
            self._dashboard.stop()
        except DeviceError as error:
            raise DeviceLost(
                f"{self.place}: neither ur_rtde nor the dashboard takes the stop; the watchdog ends the program within "
                f"{1.0 / self._watchdog_hz:.3g} s: press the emergency stop if the arm moves"
            ) from error
        finally:
            if child is not None:
                child.kill()
                if self._calling.acquire(blocking=False):  # otherwise the thread whose call has just ended does it
                    child.release()
                    self._calling.release()

    def _forget(self, child: SupervisedChild) -> None:
        if self._child is child:
            self._child = None
        child.kill()


def _six_numbers(values: ArrayLike, what: str) -> Floats:
    array = np.array(values, dtype=np.float64)
    if array.shape != (N_JOINTS,) or not np.isfinite(array).all():
        raise ValueError(f"{what} = {array.tolist()}: six finite numbers are needed")
    return array


def _check_rates(speed: float, acceleration: float) -> None:
    if not (0.0 < speed < math.inf and 0.0 < acceleration < math.inf):
        raise ValueError(f"speed {speed}, acceleration {acceleration}: both must be positive and finite")


def _limit_s(way: float, speed: float, acceleration: float) -> float:
    """How long a move over at most `way` may take: trapezoidal time law, slowed down by the operator's slider."""
    return (way / speed + speed / acceleration) / SLOWEST_SPEED_SLIDER + MARGIN_S


def _remedy(safety_status: str) -> str:
    if "EMERGENCY" in safety_status:
        return "release the emergency stop, power on and release the brakes on the pendant, then connect again"
    return "clear the cause, unlock on the pendant, then connect again"
