"""What reaches the terminal: text of files and devices never moves its cursor, hides a line or becomes markup.

Two ways lead there, `print` and `Console`; `clean_streams` is put in front of the one, and the other cleans what it
renders. Escape sequences of the program itself, colours and progress bars, are made behind both.
"""

import sys
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from typing import IO, Any, TextIO

import rich.console
from rich.console import ConsoleOptions, RenderableType
from rich.segment import Segment

from acquisition.recording.files import cleaned


class Console(rich.console.Console):
    """Rich's, with markup only where a call asks for it."""

    def __init__(self, *, markup: bool = False, **options: Any) -> None:
        super().__init__(markup=markup, **options)

    @property
    def file(self) -> IO[str]:
        """The stream behind the filter of `clean_streams`."""
        found = rich.console.Console.file.__get__(self)
        while isinstance(found, CleanStream):
            found = found.inner
        return found

    @file.setter
    def file(self, new_file: IO[str]) -> None:
        rich.console.Console.file.__set__(self, new_file)

    def on_broken_pipe(self) -> None:
        """Rich ends the process with 1; who has read enough is no error, as the command line has it."""
        raise BrokenPipeError

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """As Rich's, cleaned."""
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else cleaned(text), style, control)


class CleanStream:
    """A text stream that cleans what is written to it; everything else is the inner stream's."""

    def __init__(self, inner: TextIO) -> None:
        self.inner: Any = inner

    def write(self, text: str) -> int:
        return self.inner.write(cleaned(text))

    def writelines(self, lines: Iterable[str]) -> None:
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)


@contextmanager
def clean_streams() -> Generator[None]:
    """Standard output and error with the filter before them."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (CleanStream(stream) for stream in before)  # pyright: ignore[reportAttributeAccessIssue]
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before
