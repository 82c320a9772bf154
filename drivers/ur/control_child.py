"""The child process that holds ur_rtde's control object: it may hang or crash there without taking anything with it.

    python -m drivers.ur.control_child HOST CALLS_FD STOPS_FD WATCHDOG_HZ

Every motion is started asynchronously and watched, so that a stop never waits behind it. When the parent has gone, the
child stops the arm and ends; when the child has gone, the controller's watchdog stops the arm. When the parent is
stopped or beats no more, or the child itself was frozen, the arm is braked and no call is begun any more: what was
asked for before a freeze is not carried out after it.
"""

import os
import select
import signal
import socket
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any, Protocol

from drivers.ur.control_link import (
    LEASE_S,
    Alive,
    Beat,
    Call,
    Close,
    Ended,
    Freedrive,
    Link,
    MoveJoints,
    Outcome,
    Ready,
    ServoJoints,
    ServoStop,
    Stop,
    is_stopped,
)
from drivers.ur.pulse import Pulse

WATCH_S = 0.001  # between two checks of a running motion; the control object itself learns of its end every 2 ms
ASK_S = 0.05  # between two looks whether the parent was stopped
ALIVE_S = 0.1  # the parent gives up after many of these
KICKS_PER_WATCHDOG = 20  # kicks in the time that the watchdog allows, so that a busy machine may miss many
NO_REAL_TIME_PRIORITY = -1  # the control object would otherwise try to raise its own priority
DEFAULT_FREQUENCY = -1.0
LAST_WORDS_S = 3.0  # for stopping arm and program: a dead controller would be waited for, without end
LONELY_DECELERATION_RAD_S2 = 5.0  # as STOP_DECELERATION_RAD_S2 of drivers/ur/control.py
CAP_PORT = 50002  # of ur_rtde's constructor; not used without the URCap flag


class Control(Protocol):
    """The part of rtde_control.RTDEControlInterface that is used here."""

    def moveJ(self, q: Sequence[float], speed: float, acceleration: float, asynchronous: bool) -> bool: ...
    def servoJ(self, q: Sequence[float], v: float, a: float, t: float, lookahead: float, gain: float) -> bool: ...
    def servoStop(self, a: float) -> bool: ...
    def stopJ(self, a: float) -> None: ...
    def freedriveMode(self) -> bool: ...
    def endFreedriveMode(self) -> bool: ...
    def stopScript(self) -> None: ...
    def setWatchdog(self, min_frequency: float) -> bool: ...
    def kickWatchdog(self) -> bool: ...
    def getAsyncOperationProgress(self) -> int: ...
    def isConnected(self) -> bool: ...
    def isProgramRunning(self) -> bool: ...


class ParentGone(Exception):  # noqa: N818 - an event, no error of the child
    """Nobody is left to obey."""


class ControlChild:
    """Obeys one call at a time, and a stop at any time."""

    def __init__(
        self,
        control: Control,
        calls: Link,
        stops: Link,
        watchdog_hz: float,
        now_s: Callable[[], float],
        silent: Callable[[], bool] = lambda: False,
        parent_stopped: Callable[[], bool] = lambda: False,
    ) -> None:
        """`silent`: whether the controller sends nothing new any more, which the control object notices late."""
        self._control, self._calls, self._stops, self._now_s = control, calls, stops, now_s
        self._silent, self._parent_stopped = silent, parent_stopped
        self._stopped_up_to = 0
        self._kick_every_s = 1.0 / (watchdog_hz * KICKS_PER_WATCHDOG)
        self._kicked_s = self._sent_s = now_s()
        self._beaten_s = self._turned_s = now_s()  # when the parent last beat, and when this process last looked
        self._asked_s = now_s()  # after the parent's state
        self._expired = False
        self._servoing = self._freedrive = False

    def run(self) -> None:
        """Until Close. ParentGone when the other end of a line closes."""
        waiter = select.poll()
        for link in (self._calls, self._stops):
            waiter.register(link.line, select.POLLIN)
        while True:
            waiter.poll(1e3 * self._kick_every_s)
            self._expire()
            self._kick()
            try:
                self._take_stop(0.0)
                request = self._calls.next_request(0.0)
                if isinstance(request, Close):
                    return
                if isinstance(request, Call):
                    self._calls.send(self._obey(request))
            except ConnectionError as error:
                raise ParentGone from error

    def halt(self) -> None:
        """The arm to rest, whatever it does."""
        self._brake(LONELY_DECELERATION_RAD_S2)

    def _obey(self, call: Call) -> Ended:
        if self._expired:
            return Ended(Outcome.EXPIRED)
        if call.number <= self._stopped_up_to:
            return Ended(Outcome.STOPPED)
        fault = self._fault()
        if fault is not None:
            return fault
        try:
            match call.request:
                case MoveJoints(q, speed, acceleration):
                    return self._watch(self._control.moveJ(q, speed, acceleration, True))
                case ServoJoints(q, period, lookahead, gain):
                    self._servoing = True
                    return self._judge(self._control.servoJ(q, 0.0, 0.0, period, lookahead, gain))
                case ServoStop(deceleration):
                    self._servoing = False
                    stopped = self._control.servoStop(deceleration)
                    self._renew()
                    return self._judge(stopped)
                case Freedrive(True):
                    self._freedrive = True  # before it is: also a call that fails may have switched it on
                    return self._judge(self._control.freedriveMode())
                case Freedrive():
                    ended = self._control.endFreedriveMode()
                    self._freedrive = not ended
                    return self._judge(ended)
        except (RuntimeError, ValueError, TypeError) as error:  # what ur_rtde throws for arguments out of range
            return Ended(Outcome.REFUSED, str(error))

    def _watch(self, accepted: bool) -> Ended:
        """Until the motion has ended; ConnectionError when the parent has gone."""
        if not accepted:
            return self._judge(accepted)
        while self._control.getAsyncOperationProgress() >= 0:
            if self._expire():
                return Ended(Outcome.EXPIRED)
            if self._take_stop(WATCH_S):
                return Ended(Outcome.STOPPED)
            self._kick()
            fault = self._fault()
            if fault is not None:
                return fault
            if self._now_s() - self._sent_s > ALIVE_S:
                self._sent_s = self._now_s()
                self._calls.send(Alive())
        return self._fault() or Ended(Outcome.DONE)

    def _judge(self, accepted: bool) -> Ended:
        if accepted:
            return Ended(Outcome.DONE)
        return self._fault() or Ended(Outcome.REFUSED, "the control program did not take the command")

    def _fault(self) -> Ended | None:
        """Return values of ur_rtde alone mean nothing after a loss: its own flags are asked as well."""
        if not self._control.isConnected():
            return Ended(Outcome.DISCONNECTED)
        if self._silent():
            return Ended(Outcome.SILENT)
        return None if self._control.isProgramRunning() else Ended(Outcome.NOT_RUNNING)

    def _expire(self) -> bool:
        """Looked at before anything is read: what waits in the lines after a freeze is older than the freeze."""
        now_s = self._now_s()
        stopped = False
        if now_s - self._asked_s >= ASK_S:
            self._asked_s, stopped = now_s, self._parent_stopped()
        if not self._expired and (stopped or max(now_s - self._beaten_s, now_s - self._turned_s) > LEASE_S):
            self._expired = True
            self._brake(LONELY_DECELERATION_RAD_S2)
        self._turned_s = self._now_s()
        return self._expired

    def _renew(self) -> None:
        """After a call of ur_rtde that waits until the arm stands: nothing was read meanwhile."""
        self._beaten_s = self._turned_s = self._now_s()

    def _take_stop(self, timeout_s: float) -> bool:
        request = self._stops.next_request(timeout_s)
        while isinstance(request, Beat):
            self._beaten_s = self._now_s()
            request = self._stops.next_request(0.0)
        if not isinstance(request, Stop):
            return False
        self._stopped_up_to = max(self._stopped_up_to, request.up_to)
        self._stops.send(Alive())
        fault = self._fault()
        if fault is not None:  # reported before braking, which then waits for an answer that does not come
            self._stops.send(fault)
        self._brake(request.deceleration_rad_s2)
        if fault is None:
            self._stops.send(self._fault() or Ended(Outcome.DONE))
        return True

    def _brake(self, deceleration_rad_s2: float) -> None:
        if self._freedrive:  # a stop ends it, too: nobody expects an arm that was stopped to give way
            with suppress(RuntimeError):  # it brakes all the same
                self._freedrive = not self._control.endFreedriveMode()
        if self._servoing:  # the script's servo thread would go on under a stopj
            self._servoing = False
            self._control.servoStop(deceleration_rad_s2)
        else:
            self._control.stopJ(deceleration_rad_s2)
        self._renew()

    def _kick(self) -> None:
        if self._now_s() - self._kicked_s >= self._kick_every_s:
            self._kicked_s = self._now_s()
            if self._control.isConnected():
                self._control.kickWatchdog()


def main(arguments: Sequence[str]) -> int:
    """Exit code 0 after Close, 1 when there is no control, 3 when the parent has gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C belongs to the parent, which then decides what to do
    host, watchdog_hz = arguments[0], float(arguments[3])
    calls, stops = (Link(socket.socket(fileno=int(fd))) for fd in arguments[1:3])
    try:
        control = _take_control(host, watchdog_hz)
    except Exception as error:  # ur_rtde throws many types; each means that there is no control
        calls.send(Ended(Outcome.REFUSED, str(error)))
        return 1
    pulse = Pulse(host, time.monotonic)
    parent = partial(is_stopped, os.getppid())
    child = ControlChild(control, calls, stops, watchdog_hz, time.monotonic, pulse.silent, parent)
    try:
        calls.send(Ready())
        child.run()
    except (ParentGone, ConnectionError):
        signal.setitimer(signal.ITIMER_REAL, LAST_WORDS_S)  # its default action ends the process, whatever it waits for
        try:
            child.halt()
        finally:
            control.stopScript()
        return 3
    control.stopScript()
    return 0


def _take_control(host: str, watchdog_hz: float) -> Control:
    import rtde_control

    interface: Any = rtde_control.RTDEControlInterface
    flags: int = interface.FLAGS_DEFAULT
    control: Control = interface(host, DEFAULT_FREQUENCY, flags, CAP_PORT, NO_REAL_TIME_PRIORITY)
    if not control.setWatchdog(watchdog_hz):
        raise RuntimeError("the control program does not take the watchdog")
    return control


if __name__ == "__main__":
    code = main(sys.argv[1:])
    os._exit(code)  # not the destructor of the control object: it takes 0.5 s, and may hang
