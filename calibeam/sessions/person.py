"""Who is asked: a person at the terminal, or nobody, and then what is safe is taken for the answer."""

from collections.abc import Callable, Generator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path

from acquisition.errors import AcquisitionError
from acquisition.recording.rig import Rig
from calibeam.asking import YES, Asking, someone
from calibeam.console import Console
from calibeam.devices.check import DeviceCheck, check_devices
from calibeam.outcome import INTERRUPTS, PartialResult, interruption
from calibeam.sessions.job import GO_ON
from calibeam.sessions.keys import ENTER, Keys
from calibeam.sessions.reporter import StatusReporter
from drivers.clock import Clock
from drivers.errors import DeviceError, DeviceRefused


class Person:
    """`asking`: the terminal, where there is one. `agrees`: nothing is asked but what only a person can do (--yes)."""

    def __init__(
        self,
        console: Console,
        reporter: StatusReporter,
        asking: Asking | None,
        *,
        agrees: bool,
        view: Callable[[], AbstractContextManager[None]] = nullcontext,
    ) -> None:
        """`view` is open while the arm is under way."""
        self._console, self.reporter, self._view = console, reporter, view
        self._asking, self._agrees = asking, agrees
        self._keys: Keys | None = None

    @property
    def keyboard(self) -> int | None:
        """File descriptor of the keys, where there are any."""
        return None if self._asking is None else self._asking.fd

    @contextmanager
    def at(self, keys: Keys) -> Generator[None]:
        """While the arm is under way, answers are keys; lines would be taken apart by them."""
        self._keys = keys
        try:
            with self._view():
                yield
        finally:
            self._keys = None

    def arm(self) -> None:
        """The arm may move. NotAgreedError where nobody agrees."""
        if not self._agrees:
            someone(self._asking, "whether the arm may move", YES).may_move()

    def place(self, text: str) -> None:
        """Waits until a person has done this. AcquisitionError where there is nobody; StoppedError when given up."""
        if self._keys is None or self._asking is None:
            raise AcquisitionError(
                f"{text}: nobody can be asked, standard input is closed or no terminal; run the session in a terminal"
            )
        self.reporter.report(text)
        self.reporter.asked(f"{text}, then press ENTER")
        try:
            if self._console.is_terminal:
                self._asking.wait_until_seen()
            elif not self._asking.show(f"{text}, then press ENTER"):  # the view is a file
                raise AcquisitionError(f"{text}: nobody can be asked, the terminal cannot be written to")
            self._keys.wait(ENTER)
        finally:
            self.reporter.asked("")

    def choose(self, text: str, choices: Mapping[str, str], default: str, at_end: str) -> str:
        """One of the letters; the default where nobody is asked, `at_end` where the input ends instead."""
        if self._asking is None or self._agrees:
            return default
        answer = self._asking.choice(text, choices, default) or at_end
        self.reporter.report(f"{text} {answer}", on_screen=False)
        return answer

    def numbers(self, text: str, count: int) -> tuple[float, ...] | None:
        """So many numbers. None: the input ended, or nobody can be asked."""
        return None if self._asking is None else self._asking.numbers(text, count)

    def goes_on(self, early: PartialResult) -> bool:
        """A device failed, and the arm was stopped: whether to go on is a person's decision, never the program's."""
        if not isinstance(early.__cause__, DeviceError):
            return False
        INTERRUPTS.heed()
        self.reporter.asked("the arm was stopped; answer at the terminal whether the session goes on")
        try:
            answer = self.choose(
                "the arm was stopped, and the recording is closed:",
                {
                    "g": "go on: check the devices, then ask before the arm moves",
                    "e": "end here; --continue goes on later",
                },
                default="e",
                at_end="e",
            )
        except KeyboardInterrupt:
            return False
        finally:
            self.reporter.asked("")
        if answer != "g":
            INTERRUPTS.close()  # the exit code is decided
        return answer == "g"

    @contextmanager
    def keeping(self, out: Path) -> Generator[None]:
        """After a first part there is something to keep: what ends the session ends it in part."""
        try:
            yield
        except (AcquisitionError, DeviceError, KeyboardInterrupt) as why:
            INTERRUPTS.close()
            reason = interruption(why) if isinstance(why, KeyboardInterrupt) else str(why)
            raise PartialResult(f"{reason}; what was taken is kept in {out}; {GO_ON}") from why


def devices_ready(rig: Rig, hurry: float, clock: Clock, person: Person) -> None:
    """One line each; goes on when all are good, or a person decides so. DeviceRefused where one cannot be had."""
    person.reporter.step("device check")
    if hurry != 1.0:
        person.reporter.report("emulators at another pace than real time: their devices are not judged")
        return
    while True:
        checks = list[DeviceCheck]()
        for check in check_devices(rig, clock):
            person.reporter.report(check.line)
            checks.append(check)
        missing = [check.line for check in checks if check.wrong and not check.what]
        if not any(check.wrong for check in checks):
            return
        answer = person.choose(
            "something is wrong:",
            {"r": "it is mended: try again", "g": "go on all the same", "e": "end"},
            default="e" if missing else "g",
            at_end="e",
        )
        if answer == "e":
            raise DeviceRefused("; ".join(check.line for check in checks if check.wrong))
        if answer == "g":
            return
