"""A whole session on site, step by step, whatever its instrument: devices, plan, arm, measure, results.

What a person decides is asked where there is one; a script gets what is safe: no motion without --yes unless the
devices are emulated.
"""

from abc import ABC, abstractmethod
from contextlib import nullcontext
from pathlib import Path

from acquisition.recording.mcap import parts
from acquisition.recording.rig import Rig
from calibeam.console import Console
from calibeam.outcome import PartialResult
from calibeam.sessions.person import Person, devices_ready
from calibeam.site_log import SESSION_LOG, SITE_LOG
from drivers.clock import Clock


class OnSite(ABC):
    """The order of the steps. What each does, and which part of the session comes next, is the instrument's."""

    def __init__(self, rig: Rig, out: Path, hurry: float, console: Console, clock: Clock, person: Person) -> None:
        out.mkdir(parents=True, exist_ok=True)
        SITE_LOG.begin(out / SESSION_LOG)
        self._rig, self._out, self._hurry = rig, out, hurry
        self._console, self._clock, self._person, self._reporter = console, clock, person, person.reporter

    def run(self) -> None:
        """Everything, until there is nothing more to be measured. PartialResult, and what its steps raise.

        After a failure every device is connected again, and asked for, into a further recording.
        """
        agreed = broken = False
        while True:
            with self._person.keeping(self._out) if broken else nullcontext():
                if not agreed:
                    devices_ready(self._rig, self._hurry, self._clock, self._person)
                    self._catch_up(failed=broken)
                if not self._next_part():
                    self._reporter.report("everything that was planned is taken")
                    break
                self._preview()
                if not agreed:
                    self._confirm()
                    agreed = True
            try:
                if not self._measure():
                    break
            except PartialResult as early:
                if not self._person.goes_on(early):
                    raise
                agreed, broken = False, True
        self._reporter.step("results")
        files = parts(self._out)
        from calibeam.results.session_results import (
            write_session_results,  # a second of libraries that no device waits for
        )

        write_session_results(files[0] if len(files) == 1 else self._out, self._console)

    @abstractmethod
    def _catch_up(self, *, failed: bool) -> None:
        """Finds what was taken before. `failed`: by this session, which a failure of a device has broken off."""

    @abstractmethod
    def _next_part(self) -> int:
        """Decides what is measured next; how many readings that has."""

    @abstractmethod
    def _preview(self) -> None:
        """Shows what will be taken, before anything moves."""

    def _confirm(self) -> None:
        """The arm may move. NotAgreedError where nobody agrees."""
        self._person.arm()

    @abstractmethod
    def _measure(self) -> bool:
        """Takes it, into a further recording; whether there is to be another part. PartialResult when it ended early:
        the arm stands.
        """
