"""The parent's hold on the control child: start it, talk to it with limits, kill it."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading

from drivers.clock import Clock
from drivers.errors import DeviceLost, DeviceStale
from drivers.ur.control_link import (
    BEAT_S,
    Alive,
    Answer,
    Beat,
    Call,
    Close,
    Ended,
    Link,
    Motion,
    Outcome,
    Ready,
    Request,
    Stop,
    is_stopped,
)

SILENCE_LIMIT_S = 2.0  # twenty heartbeats of the child; ur_rtde itself blocks up to 4 s when no answer comes
LOOK_S = 0.1  # between two looks whether the child was stopped by a signal
STOP_NOTICE_S = 0.3  # the child checks its stop line every millisecond; a busy machine may take tenths
STOP_LIMIT_S = 1.0  # braking from full speed at 5 rad/s2 takes 0.63 s; after this the other way is taken
UNREACHED = (Outcome.DISCONNECTED, Outcome.SILENT)  # then it is unknown whether the arm brakes
CLOSE_LIMIT_S = 1.0
FROM_OUTSIDE = (signal.SIGKILL, signal.SIGTERM, signal.SIGHUP, signal.SIGINT)  # a crash has other signals
CHILD_MODULE = "drivers.ur.control_child"
SHOWN_BYTES = 300  # of what ur_rtde printed last


class SupervisedChild:
    """One child; after a fault it is killed and never used again."""

    def __init__(self, host: str, watchdog_hz: float, place: str, clock: Clock) -> None:
        self._place, self._clock = place, clock
        self.killed = False
        self._ordering = threading.Lock()  # a stop falls before a call or after it
        self._over = threading.Event()
        self._writing = threading.Lock()  # of the stop line: beats and stops
        self._number = 0
        self._held = False
        calls, child_calls = socket.socketpair()
        stops, child_stops = socket.socketpair()
        self._calls, self._stops = Link(calls), Link(stops)
        self._printed = tempfile.TemporaryFile()  # noqa: SIM115 - closed in `release`; a pipe could fill and block it
        with child_calls, child_stops:
            fds = (child_calls.fileno(), child_stops.fileno())
            self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and module; no shell
                [sys.executable, "-m", CHILD_MODULE, host, str(fds[0]), str(fds[1]), str(watchdog_hz)],
                pass_fds=fds,
                stdin=subprocess.DEVNULL,
                stdout=self._printed,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C in the terminal must not reach it before its parent
            )
        threading.Thread(target=self._beat, name=f"beat of {place}", daemon=True).start()

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def wait_ready(self, limit_s: float) -> Ready | Ended:
        """The first answer. DeviceStale when there is none in time, DeviceLost when the child died."""
        answer = self._next_answer(self._calls, limit_s)
        if isinstance(answer, Ready | Ended):
            return answer
        raise DeviceStale(
            f"{self._place}: no control within {limit_s:.3g} s; the controller answers but sends no data: "
            "restart it, then connect again"
        )

    def call(self, request: Motion, limit_s: float) -> Ended:
        """A call and its end; STOPPED at once when held.

        DeviceStale: no sign of life, or no end within `limit_s`. DeviceLost: the child died.
        """
        deadline_s = self._clock.now_s() + limit_s
        with self._ordering:
            if self._held:
                return Ended(Outcome.STOPPED)
            self._number += 1
            self._send(self._calls, Call(self._number, request))
        name, heard_s = type(request).__name__, self._clock.now_s()
        while True:
            answer = self._next_answer(self._calls, min(LOOK_S, deadline_s - self._clock.now_s()))
            if isinstance(answer, Ended):
                return answer
            now_s = self._clock.now_s()
            heard_s = heard_s if answer is None else now_s
            if now_s >= deadline_s:
                raise DeviceStale(f"{self._place}: {name} has not ended within {limit_s:.3g} s; see its pendant")
            if answer is None and is_stopped(self._process.pid):
                raise DeviceStale(
                    f"{self._place}: {name}: the control process of this program ({self.pid}) was frozen, and the "
                    "arm was stopped through the dashboard; connect again"
                )
            if now_s - heard_s >= SILENCE_LIMIT_S:
                raise DeviceStale(f"{self._place}: {name} is silent for {SILENCE_LIMIT_S:.3g} s; connect again")

    def hold(self) -> None:
        """No call is sent any more."""
        with self._ordering:
            self._held = True

    def stop(self, deceleration_rad_s2: float) -> bool:
        """From any thread, also in the middle of a call. False when the child did not obey in time."""
        try:
            while self._stops.next_answer(0.0) is not None:
                pass  # late answers to a stop that was given up
            with self._ordering, self._writing:
                self._stops.send_now(Stop(deceleration_rad_s2, self._number))
            if not isinstance(self._stops.next_answer(STOP_NOTICE_S), Alive):
                return False
            ended = self._stops.next_answer(STOP_LIMIT_S)
            return isinstance(ended, Ended) and ended.outcome not in UNREACHED
        except (OSError, ValueError):  # ValueError: another thread has given the child up, and closed the line
            return False

    def end(self) -> None:
        """Asks it to end, and waits for that; no call may be under way."""
        with contextlib.suppress(OSError, subprocess.TimeoutExpired):
            self._calls.send(Close())
            self._process.wait(CLOSE_LIMIT_S)

    def kill(self) -> None:
        """SIGKILL; safe in every state and from any thread: a call that is under way ends with DeviceLost."""
        self.killed = True
        self._over.set()
        if self.alive:
            self._process.kill()
        self._process.wait()

    def release(self) -> None:
        """Closes the lines; no call may be under way."""
        self._over.set()
        self._calls.close()
        with self._writing:
            self._stops.close()
        self._printed.close()

    def _beat(self) -> None:
        """Shows the child that this process runs; a child that reads nothing finds later that it was frozen."""
        while not self._over.wait(BEAT_S):
            try:
                with self._writing:
                    self._stops.send_now(Beat())
            except BlockingIOError:
                continue
            except OSError:
                return

    def _send(self, link: Link, request: Request) -> None:
        try:
            link.send(request)
        except OSError as error:
            raise self._died() from error

    def _next_answer(self, link: Link, timeout_s: float) -> Answer | None:
        try:
            return link.next_answer(timeout_s)
        except OSError as error:
            raise self._died() from error

    def _died(self) -> DeviceLost:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(CLOSE_LIMIT_S)
        code = self._process.returncode
        how = (
            "still ends"
            if code is None
            else f"signal {signal.Signals(-code).name}"
            if code < 0
            else f"exit code {code}"
        )
        remedy = "see the pendant and that line, then connect again"
        if code is not None and -code in FROM_OUTSIDE:
            remedy = "not the controller: see who ended it, or whether this machine was out of memory; connect again"
        return DeviceLost(
            f"{self._place}: the control process of this program ({self.pid}) has gone ({how})"
            f"{self._last_words()}; {remedy}"
        )

    def _last_words(self) -> str:
        with contextlib.suppress(OSError, ValueError):
            size = self._printed.seek(0, os.SEEK_END)
            self._printed.seek(max(0, size - SHOWN_BYTES))
            text = self._printed.read().decode(errors="replace").strip()
            return f', its last line "{text.splitlines()[-1]}"' if text else ""
        return ""
