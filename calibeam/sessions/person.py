"""Who is asked: a person at the terminal, or nobody, and then what is safe is taken for the answer."""

from collections.abc import Callable, Generator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext

from rich.console import Console

from acquisition.errors import AcquisitionError
from calibeam.asking import YES, Asking, someone
from calibeam.sessions.keys import ENTER, Keys
from calibeam.sessions.reporter import StatusReporter


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
        self._console, self._reporter, self._view = console, reporter, view
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
        self._reporter.report(text)
        self._reporter.asked(f"{text}, then press ENTER")
        try:
            if self._console.is_terminal:
                self._asking.wait_until_seen()
            elif not self._asking.show(f"{text}, then press ENTER"):  # the view is a file
                raise AcquisitionError(f"{text}: nobody can be asked, the terminal cannot be written to")
            self._keys.wait(ENTER)
        finally:
            self._reporter.asked("")

    def choose(self, text: str, choices: Mapping[str, str], default: str, at_end: str) -> str:
        """One of the letters; the default where nobody is asked, `at_end` where the input ends instead."""
        if self._asking is None or self._agrees:
            return default
        answer = self._asking.choice(text, choices, default) or at_end
        self._reporter.report(f"{text} {answer}", on_screen=False)
        return answer

    def numbers(self, text: str, count: int) -> tuple[float, ...] | None:
        """So many numbers. None: the input ended, or nobody can be asked."""
        return None if self._asking is None else self._asking.numbers(text, count)
