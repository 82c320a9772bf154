"""Steps of a session on site, one at a time, without devices."""

from types import SimpleNamespace

import pytest
from rich.console import Console

from acquisition.session.plan import PlanOptions
from acquisition.session.stepping import Summary
from calibeam.asking import Asking
from calibeam.devices.check import DeviceCheck
from calibeam.devices.site import addresses_of
from calibeam.sessions import person
from calibeam.sessions.job import EarlierParts, Job, part_of
from calibeam.sessions.person import devices_ready
from calibeam.sessions.with_detectors import WithDetectors
from calibeam.site_log import SITE_LOG
from drivers.clock import SystemClock
from drivers.errors import DeviceRefused

from .conftest import RIG_FILE


def test_a_forecast_that_cannot_be_made_is_said_and_ends_nothing(rig, tmp_path) -> None:
    def fails() -> None:
        raise ZeroDivisionError("no pose ahead")

    job = Job(rig, RIG_FILE.read_text(), tmp_path, addresses_of(rig), PlanOptions())
    part = part_of(job, EarlierParts(), 0.01)
    with SITE_LOG.heard("info"):
        site = WithDetectors(job, Console(quiet=True), EarlierParts(), asking=None, agrees=True, stands=False)
        site._look(SimpleNamespace(forecast_now=fails), Summary((), (), 2), part)
    log = (tmp_path / "session.log").read_text()
    assert "0 poses; 2 left out" in log
    assert "no forecast: ZeroDivisionError: no pose ahead" in log


def _asked(job: Job, typist) -> WithDetectors:
    asking = Asking(typist.terminal)
    return WithDetectors(job, Console(quiet=True), EarlierParts(), asking=asking, agrees=False, stands=False)


def test_a_terminal_that_goes_instead_of_the_numbers_of_a_place_finishes(rig, tmp_path, typist) -> None:
    job = Job(rig, RIG_FILE.read_text(), tmp_path, addresses_of(rig), PlanOptions())
    site = _asked(job, typist)
    typist.answers("> ", "\x04")
    assert site._new_place(part_of(job, EarlierParts(), 0.01)) is None


def test_devices_that_are_wrong_end_the_session_where_the_input_ends(rig, tmp_path, typist, monkeypatch) -> None:
    job = Job(rig, RIG_FILE.read_text(), tmp_path, addresses_of(rig), PlanOptions())
    site = _asked(job, typist)
    checks = [DeviceCheck("psd", "PSD2001-E", wrong="too few samples")]
    monkeypatch.setattr(person, "check_devices", lambda *_: checks)
    typist.ahead("g\n")
    typist.answers("something is wrong: [r/g/e, ENTER: g] ", "\x04")
    with pytest.raises(DeviceRefused, match="too few samples"):
        devices_ready(rig, 1.0, SystemClock(), site._person)
