"""Forecasts made beside the session, while the arm is on its way: the newest samples count, the session never waits."""

import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass

from acquisition.sample import Sample

END_S = 5.0  # longer than any forecast takes: a tenth of a second at ninety poses


@dataclass(frozen=True)
class Asked:
    """What a forecast is made of."""

    samples: list[Sample]
    taken_of_plan: int  # how many of the plan's poses are behind


class Forecaster:
    """One thread; `make` computes and tells. What it raises is told to `failed`, once, and no more is made."""

    def __init__(self, make: Callable[[Asked], None], failed: Callable[[Exception], None]) -> None:
        self._make, self._failed = make, failed
        self._news = threading.Condition()
        self._asked: Asked | None = None
        self._over = True

    def ask(self, asked: Asked) -> None:
        """Takes the place of what was asked before and is not begun yet."""
        with self._news:
            self._asked = asked
            self._news.notify()

    @contextmanager
    def running(self) -> Generator[None]:
        """Inside, what is asked is made."""
        self._over = False
        thread = threading.Thread(target=self._run, name="forecast", daemon=True)
        thread.start()
        try:
            yield
        finally:
            with self._news:
                self._over = True
                self._news.notify()
            thread.join(END_S)

    def _run(self) -> None:
        while True:
            with self._news:
                self._news.wait_for(lambda: self._over or self._asked is not None)
                asked, self._asked = self._asked, None
                if self._over or asked is None:
                    return
            try:
                self._make(asked)
            except Exception as error:  # a session goes on without forecasts
                self._failed(error)
                return
