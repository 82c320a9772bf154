"""A session on something that is no terminal: plain lines, few of them."""

from rich.console import Console

from calibeam.session.pace import clock_words
from calibeam.session.status import Shown

EVERY = 10  # poses


class PlainView:
    """Implements calibeam.session.status.Listener."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._told, self._step = 0, ""

    def said(self, text: str, loud: bool) -> None:
        if loud:
            self._console.print(text, highlight=False, markup=False, soft_wrap=True)

    def shows(self, shown: Shown) -> None:
        if shown.step != self._step:
            self._step = shown.step
            self.said(shown.step, loud=True)
        progress = shown.progress
        if progress is None or progress.done < self._told + EVERY:
            return
        self._told = progress.done
        left = "" if shown.left_s is None else f", about {clock_words(shown.left_s)} left"
        accuracy = "" if shown.forecast is None else f"; accuracy {shown.forecast.says}"
        self.said(f"{progress.done} of {progress.total} poses{left}{accuracy}", loud=True)
