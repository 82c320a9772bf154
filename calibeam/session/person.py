"""Who is asked: a person at the terminal, or nobody, and then what is safe is taken for the answer."""

from collections.abc import Callable, Generator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext

from rich.console import Console
from rich.prompt import Prompt

from acquisition.errors import AcquisitionError
from calibeam.session.keys import ENTER, Keys, keyboard
from calibeam.session.teller import Teller


class Person:
    """`there`: a terminal that can be read. `agrees`: nothing is asked but what only a person can do (--yes)."""

    def __init__(
        self,
        console: Console,
        teller: Teller,
        *,
        there: bool,
        agrees: bool,
        view: Callable[[], AbstractContextManager[None]] = nullcontext,
    ) -> None:
        """`view` is open while the arm is under way."""
        self._console, self._teller, self._view = console, teller, view
        self.there, self._agrees = there, agrees
        self._keys: Keys | None = None

    @property
    def keyboard(self) -> int | None:
        """File descriptor of the keys, where there are any."""
        return keyboard() if self.there else None

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
        """The arm may move. AcquisitionError where nobody says so."""
        if self._agrees:
            return
        if not self.there:
            raise AcquisitionError(
                "nobody can be asked whether the arm may move, for standard input is no terminal: run the session in "
                "one, or give --yes when the cell is clear"
            )
        self._console.bell()
        try:
            answer = Prompt.ask("THE ARM WILL MOVE. Is the cell clear? Type [bold]go[/bold]", console=self._console)
        except EOFError:
            answer = ""
        if answer.strip().lower() != "go":
            raise AcquisitionError("nothing was moved: the answer was not 'go'")

    def place(self, text: str) -> None:
        """Waits until a person has done this. AcquisitionError where there is nobody; StoppedError when given up."""
        if self._keys is None or not self.there:
            raise AcquisitionError(
                f"{text}: nobody can be asked, standard input is closed or no terminal; run the session in a terminal"
            )
        self._teller.said(text)
        self._teller.asked(f"{text}, then press ENTER")
        try:
            self._keys.wait(ENTER)
        finally:
            self._teller.asked("")

    def choose(self, text: str, choices: Mapping[str, str], default: str) -> str:
        """One of the letters; the default where nobody is asked."""
        if not self.there or self._agrees:
            return default
        for letter, says in choices.items():
            self._console.print(f"   [bold]{letter}[/bold]  {says}", highlight=False)
        try:
            answer = Prompt.ask(text, console=self._console, choices=list(choices), default=default)
        except EOFError:  # the terminal went; what follows from that comes as a signal
            return default
        self._teller.said(f"{text} {answer}", loud=False)
        return answer

    def numbers(self, text: str, count: int) -> tuple[float, ...] | None:
        """So many numbers on one line; asked again until they are. None: Ctrl-D, or the terminal went."""
        while True:
            try:
                words = Prompt.ask(text, console=self._console).replace(",", " ").split()
            except EOFError:
                return None
            try:
                values = tuple(float(word) for word in words)
            except ValueError:
                values = ()
            if len(values) == count:
                return values
            self._console.print(f"   {count} numbers, please, with spaces between", style="yellow")
