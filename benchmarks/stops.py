"""What stops a session, and how fast: event x state on the emulated controller, by the controller's own time stamps.

`python -m benchmarks stops` prints the table of docs/safety.md. Every cell is a session of its own in a
terminal of its own, in real time. "at rest" is counted from the newest sample of the controller before the event to the
last one in which a joint still moved; "moved after" is the largest joint speed from SETTLED_S after the event on.
"""

import os
import pty
import re
import resource
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.client import HTTPConnection
from pathlib import Path

import numpy as np

from acquisition.recording import RecordingError, read
from acquisition.recording.pose_plan import PlannedBlock, PlannedPose, PosePlan, write_pose_plan
from acquisition.recording.rig import load_rig
from calibeam.emulation import Emulation
from drivers.errors import DeviceError
from drivers.ur.reader import UrReader

CRUISES_RAD_S = 0.9  # the rig's speed is 1 rad/s
MOVES_RAD_S = 1e-3  # a joint that is faster moves
FREEZE_S = 5.0
SETTLED_S = 1.5  # from the event, or from the thaw, after which nothing may move
WATCHED_S = 4.0  # from the event, or from the thaw
ENDS_S = 15.0
PATIENCE_S = 45.0
SEED = 5
GO_CUE = "Type go to move"  # what is typed before it does not count


class Watch:
    """The controller's own stream beside the session: stamps and the fastest joint."""

    def __init__(self, host: str) -> None:
        self._host = host
        self._over = threading.Event()
        self._turn = threading.Lock()
        self._device_s: list[float] = []
        self._speed_rad_s: list[float] = []
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def newest(self) -> tuple[float, float]:
        """Stamp (s) and speed of the fastest joint (rad/s)."""
        with self._turn:
            return (self._device_s[-1], self._speed_rad_s[-1]) if self._device_s else (0.0, 0.0)

    def since(self, device_s: float) -> tuple[np.ndarray, np.ndarray]:
        with self._turn:
            stamps, speeds = np.array(self._device_s), np.array(self._speed_rad_s)
        return stamps[stamps > device_s], speeds[stamps > device_s]

    def close(self) -> None:
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._over.is_set():
            reader = UrReader(self._host)
            try:
                reader.connect()
                while not self._over.is_set():
                    block = reader.read(0.5)
                    speed = np.abs(block.values["actual_qd_rad_s"]).max(axis=1)
                    with self._turn:
                        self._device_s += block.device_s.tolist()
                        self._speed_rad_s += speed.tolist()
            except DeviceError:  # frozen, or disconnected: again
                self._over.wait(0.02)
            finally:
                reader.close()


@dataclass
class Staged:
    """A session in a terminal of its own, with its emulators."""

    folder: Path
    emulation: Emulation
    process: subprocess.Popen[bytes]
    terminal: int
    watch: Watch
    _screen: bytearray = field(default_factory=bytearray)

    @property
    def screen(self) -> str:
        while select.select([self.terminal], [], [], 0.0)[0]:
            try:
                said = os.read(self.terminal, 65536)
            except OSError:
                break
            if not said:
                break
            self._screen += said
        return self._screen.decode(errors="replace")

    @property
    def log(self) -> str:
        path = self.folder / "out" / "session.log"
        return path.read_text() if path.exists() else ""

    def until(self, happened: Callable[[], bool], patience_s: float = PATIENCE_S, *, ended: bool = False) -> bool:
        """Whether it happened; `ended`: it may happen after the session's process has ended."""
        end_s = time.monotonic() + patience_s
        while not happened():
            _ = self.screen  # a terminal that nobody reads fills
            if time.monotonic() > end_s or not (ended or self.process.poll() is None):
                return happened()
            time.sleep(0.002)
        return True

    def type(self, text: str) -> None:
        os.write(self.terminal, text.encode())

    def now_s(self) -> float:
        """Emulated time, as in the controller's stamps: the stream may be read late."""
        return float(self.emulation.ask("world.time"))

    def child(self) -> int:
        """The control child."""
        own = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        threads = Path(f"/proc/{self.process.pid}/task").iterdir()
        pids = {int(pid) for task in threads for pid in (task / "children").read_text().split()} | set(map(int, own))
        return next(pid for pid in pids if b"control_child" in Path(f"/proc/{pid}/cmdline").read_bytes())

    def signal(self, number: int) -> None:
        os.kill(self.process.pid, number)


@contextmanager
def staged(rig: Path, more: Sequence[str] = (), time_scale: float = 1.0, *, travels: bool = False) -> Generator[Staged]:
    """A session that waits at its question, or has begun with --yes in `more`; `travels`: first it goes a long way."""
    folder = Path(tempfile.mkdtemp(prefix="stops-"))
    try:
        alone = folder / "alone.toml"
        alone.write_text(without_encoders(rig.read_text()))
        with Emulation(alone, seed=SEED, time_scale=time_scale) as emulation:
            path = emulated_rig(alone, emulation, folder)
            control = emulation.address["control"]
            ours, theirs = pty.openpty()
            command = [sys.executable, "-m", "calibeam", "session", str(path), "--out", str(folder / "out")]
            if travels:
                command += ["--plan", str(long_way(rig, folder / "plan.toml"))]
            command += ["--control", f"{control['host']}:{control['port']}", "--time-scale", str(time_scale), *more]
            with subprocess.Popen(
                command, stdin=theirs, stdout=theirs, stderr=theirs, preexec_fn=_own_terminal(theirs)
            ) as process:
                os.close(theirs)
                watch = Watch(emulation.address["robot"]["host"])
                try:
                    yield Staged(folder, emulation, process, ours, watch)
                finally:
                    watch.close()
                    with suppress(ProcessLookupError):
                        process.send_signal(signal.SIGCONT)
                    process.kill()
                    with suppress(OSError):
                        os.close(ours)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def long_way(rig: Path, path: Path) -> Path:
    """A plan that begins with a travel of almost three seconds, and needs no light for it."""
    loaded = load_rig(rig)
    far_rad = np.array(loaded.motion.home_rad) + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.5])
    block = PlannedBlock(pose=(PlannedPose(tuple(far_rad.tolist())),), placement=1, first_psd=1)
    write_pose_plan(path, PosePlan(schema=1, rig=loaded.name, block=(block,)))
    return path


def without_encoders(text: str) -> str:
    """Link-side encoders stop no arm, and their emulators want a third of a core."""
    before, _, rest = text.partition("[devices.encoders]")
    return before + rest[rest.index("\n[") :]


def emulated_rig(rig: Path, emulation: Emulation, folder: Path) -> Path:
    """The rig file with the devices where the emulators are."""
    text, where = rig.read_text(), emulation.address
    for old, new in (
        ("out/emulated/psd", where["psd"]["port"]),
        ('host = "127.0.0.2"', f'host = "{where["robot"]["host"]}"'),
    ):
        text = text.replace(old, new, 1)
    (folder / "rig.toml").write_text(text)
    return folder / "rig.toml"


def _own_terminal(theirs: int) -> Callable[[], None]:
    def begin() -> None:
        os.login_tty(theirs)

    return begin


# --- states


def asking(s: Staged) -> bool:
    return s.until(lambda: GO_CUE in s.screen)


def travelling(s: Staged) -> bool:
    return _agreed(s) and s.until(lambda: s.watch.newest()[1] > CRUISES_RAD_S)


def centring(s: Staged) -> bool:
    """The light was found, and the arm makes the small motions that bring it to the middle."""
    return _agreed(s) and s.until(lambda: ": search {" in s.log) and s.until(
        lambda: s.watch.newest()[1] > 0.02
    )  # fmt: skip


def reading(s: Staged) -> bool:
    """A pose was centred, the arm stands, and its reading is averaged."""
    return _agreed(s) and s.until(lambda: "CENTRED" in s.log) and s.until(lambda: s.watch.newest()[1] < MOVES_RAD_S)


def paused(s: Staged) -> bool:
    if not travelling(s):
        return False
    s.type(" ")
    return s.until(lambda: "paused, the arm stands" in s.log)


def _agreed(s: Staged) -> bool:
    if not asking(s):
        return False
    s.type("go\n")
    return True


STATES: dict[str, Callable[[Staged], bool]] = {
    "question": asking,
    "travelling": travelling,
    "centring": centring,
    "reading": reading,
    "paused": paused,
}

# --- events; each returns the seconds that something was frozen for


def ctrl_c(times: int, every_s: float = 0.15) -> Callable[[Staged], float]:
    def press(s: Staged) -> float:
        for k in range(times):
            if k:
                time.sleep(every_s)
            with suppress(OSError):
                s.type("\x03")
        return 0.0

    return press


def key(letter: str) -> Callable[[Staged], float]:
    def press(s: Staged) -> float:
        s.type(letter)
        return 0.0

    return press


def sent(number: int) -> Callable[[Staged], float]:
    def send(s: Staged) -> float:
        s.signal(number)
        return 0.0

    return send


def hang_up(s: Staged) -> float:
    os.close(s.terminal)
    s.terminal = os.open(os.devnull, os.O_RDWR)
    return 0.0


def child_killed(s: Staged) -> float:
    os.kill(s.child(), signal.SIGKILL)
    return 0.0


def frozen(pid_of: Callable[[Staged], int], typed: str = "") -> Callable[[Staged], float]:
    def freeze(s: Staged) -> float:
        pid = pid_of(s)
        os.kill(pid, signal.SIGSTOP)
        time.sleep(0.5)
        if typed:
            s.type(typed)
        time.sleep(FREEZE_S - 0.5)
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)
        return FREEZE_S

    return freeze


def emulator_pid(s: Staged) -> int:
    return s.emulation._process.pid  # type: ignore[union-attr]  # noqa: SLF001 - no verb freezes its own process


def page_stop(s: Staged) -> float:
    found = re.search(r"http://([\d.]+:\d+)", s.screen)
    line = HTTPConnection(found[1] if found else "", timeout=5.0)
    line.request("POST", "/stop", headers={"Origin": f"http://{found[1] if found else ''}"})
    line.getresponse().read()
    line.close()
    return 0.0


def unplugged(s: Staged) -> float:
    s.emulation.inject("psd", "disconnect")
    return 0.0


def protective_stop(s: Staged) -> float:
    s.emulation.ask("robot.protective_stop")
    return 0.0


def silent(s: Staged) -> float:
    s.emulation.ask("robot.silence", on=True)
    return 0.0


def disk_full(s: Staged) -> float:
    size = max(path.stat().st_size for path in (s.folder / "out").glob("*.mcap"))
    resource.prlimit(s.process.pid, resource.RLIMIT_FSIZE, (size, size))
    return 0.0


EVENTS: dict[str, Callable[[Staged], float]] = {
    "Ctrl-C": ctrl_c(1),
    "Ctrl-C twice": ctrl_c(2),
    "Ctrl-C three times": ctrl_c(3),
    "Ctrl-C ten times": ctrl_c(10, 0.05),
    "SPACE": key(" "),
    "a": key("a"),
    "h": key("h"),
    "STOP of the page": page_stop,
    "SIGTERM": sent(signal.SIGTERM),
    "SIGHUP, terminal closed": hang_up,
    "control child killed": child_killed,
    "session killed (SIGKILL)": sent(signal.SIGKILL),
    "controller and devices frozen 5 s": frozen(emulator_pid),
    "controller silent": silent,
    "control child frozen 5 s": frozen(lambda s: s.child()),
    "session frozen 5 s, r typed": frozen(lambda s: s.process.pid, "r"),
    "session frozen 5 s, go typed": frozen(lambda s: s.process.pid, "go\n"),
    "PSD cable pulled": unplugged,
    "protective stop": protective_stop,
    "disk full": disk_full,
}
CELLS: tuple[tuple[str, str], ...] = (
    *(("travelling", event) for event in EVENTS if event != "session frozen 5 s, go typed"),
    *(("centring", event) for event in ("Ctrl-C", "Ctrl-C twice", "SIGTERM", "control child killed",
      "control child frozen 5 s", "session frozen 5 s, r typed", "controller and devices frozen 5 s")),
    *(("reading", event) for event in ("Ctrl-C", "SIGTERM", "control child killed", "session frozen 5 s, r typed")),
    *(("paused", event) for event in ("Ctrl-C", "SIGTERM", "control child killed", "session frozen 5 s, r typed")),
    *(("question", event) for event in ("Ctrl-C", "SIGTERM", "SIGHUP, terminal closed",
      "session frozen 5 s, go typed")),
)  # fmt: skip


@dataclass(frozen=True)
class Cell:
    """What was measured."""

    state: str
    event: str
    rest_s: float  # from the event, or from the thaw
    after_rad_s: float  # the fastest joint from SETTLED_S on
    code: int | None  # None: it goes on, or waits
    asks: bool
    says: str
    samples: int | None  # in the recordings; None: none is readable
    ended_s: float = float("nan")  # from the event until the process had ended
    closed_s: float = float("nan")  # from the event until the recording was written last

    @property
    def line(self) -> str:
        rest = "stood" if self.rest_s == 0.0 else f"{self.rest_s:.2f} s"
        how = (
            f"exit {self.code} after {self.ended_s:.1f} s, recording closed after {self.closed_s:.1f} s"
            if self.code is not None
            else "asks"
            if self.asks
            else "waits"
        )
        kept = "no recording" if self.samples is None else f"{self.samples} samples"
        return (
            f"{self.state:10} | {self.event:34} | {rest:7} | {self.after_rad_s:6.3f} rad/s | {how:20} | {kept} | "
            f"{self.says}"
        )


def measured(rig: Path, state: str, event: str) -> Cell | None:
    """None: the state was not reached."""
    with staged(rig, ("--live", "--live-port", "0"), travels=state in ("travelling", "paused")) as s:
        if not STATES[state](s):
            print(s.screen[-1500:], s.log[-800:], s.process.poll(), file=sys.stderr)
            return None
        begin_s, host_s, said = s.now_s(), time.monotonic(), len(s.log)
        unix_s = time.time()
        frozen_s = EVENTS[event](s)
        watched_from_s = time.monotonic()
        ended_s = float("nan")
        while time.monotonic() < watched_from_s + (ENDS_S if ends(s, said) else WATCHED_S):
            _ = s.screen
            if np.isnan(ended_s) and s.process.poll() is not None:
                ended_s = time.monotonic() - host_s
            if not np.isnan(ended_s) and time.monotonic() > watched_from_s + WATCHED_S:
                break
            time.sleep(0.01)
        stamps, speeds = s.watch.since(begin_s)
        moving = stamps[speeds > MOVES_RAD_S] - begin_s
        # Emulated time stands while the emulators are frozen: what is counted then is the time after the thaw.
        late_s = SETTLED_S + (0.0 if event.startswith("controller and") else frozen_s)
        after = speeds[stamps - begin_s > late_s]
        text = s.log[said:].splitlines()
        says = next((line.partition(": ")[2] for line in text if ": pause: " in line or "STOPPED" in line), "")
        return Cell(
            state,
            event,
            float(moving.max()) if len(moving) else 0.0,
            float(after.max()) if len(after) else 0.0,
            s.process.poll(),
            "goes on" in s.screen and "the recording is closed" in s.screen,
            says or (text[-1].partition(": ")[2] if text else ""),
            _samples(s.folder / "out"),
            ended_s,
            max((path.stat().st_mtime - unix_s for path in (s.folder / "out").glob("*.mcap")), default=float("nan")),
        )


def ends(s: Staged, said: int) -> bool:
    """Whether the session was given up; a busy machine takes seconds until its process has ended."""
    return "ended early: " in s.log[said:]


def _samples(folder: Path) -> int | None:
    try:
        return sum(len(read(path).samples) for path in sorted(folder.glob("*.mcap")))
    except RecordingError:
        return None


def lines(rig: Path, cells: Sequence[tuple[str, str]] = CELLS) -> Iterator[str]:
    for state, event in cells:
        cell = measured(rig, state, event)
        yield f"{state:10} | {event:34} | state not reached" if cell is None else cell.line
