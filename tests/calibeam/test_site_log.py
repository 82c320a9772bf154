"""The log of what happens on site: where it stands, what is in it, and that no job ends by it."""

import errno
import logging
import os
import re
import threading
from collections.abc import Callable, Iterator
from io import StringIO
from pathlib import Path

import pytest

from acquisition.errors import StoppedError
from acquisition.wires.streams import Supervisor
from calibeam import site_log
from calibeam.outcome import PartialResult
from calibeam.site_log import SITE_LOG, LogLevel, SiteLogFile, site_log_of
from drivers.errors import DeviceLost

LINE = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z (DEBUG|INFO|WARNING|ERROR) [a-z_.]+: .+")
driver = logging.getLogger("drivers.ur.reader")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "r.log"


@pytest.fixture
def recorded(path: Path) -> Callable[..., list[str]]:
    """The lines of a command in which this happened."""

    def ran(happens: Callable[[], object], level: LogLevel = "info") -> list[str]:
        with SITE_LOG.heard(level):
            SITE_LOG.begin(path)
            happens()
        return path.read_text(encoding="utf-8").splitlines() if path.exists() else []

    return ran


def every_level() -> None:
    for level in (logging.DEBUG, logging.INFO, logging.WARNING, logging.ERROR):
        driver.log(level, "the tool speaks: %s", logging.getLevelName(level))


@pytest.fixture(autouse=True)
def as_before() -> Iterator[None]:
    """A log leaves no handler, level or thread behind."""
    before = list(logging.getLogger().handlers)
    yield
    assert logging.getLogger().handlers == before
    assert {logging.getLogger(name).level for name in site_log.OWN} == {logging.NOTSET}
    assert not [thread for thread in threading.enumerate() if "_monitor" in thread.name]


@pytest.mark.parametrize(
    ("level", "kept"),
    [
        ("debug", ["DEBUG", "INFO", "WARNING", "ERROR"]),
        ("info", ["INFO", "WARNING", "ERROR"]),
        ("warning", ["WARNING", "ERROR"]),
        ("error", ["ERROR"]),
        ("off", []),
    ],
)
def test_lines_below_the_level_are_left_out(recorded, level: LogLevel, kept: list[str]) -> None:
    lines = recorded(every_level, level)
    assert [line.split()[1] for line in lines if "the tool speaks" in line] == kept
    assert all(LINE.fullmatch(line) for line in lines)


def test_off_writes_no_file(recorded, path: Path) -> None:
    recorded(every_level, "off")
    assert not path.exists()


def test_it_begins_with_the_program_its_machine_and_the_command_line_without_the_word_of_the_page(
    recorded, monkeypatch
) -> None:
    monkeypatch.setattr("sys.argv", ["calibeam", "session", "my rig.toml", "--live-token", "swordfish"])
    first, *_, last = recorded(every_level)
    assert "calibeam " in first
    assert "Python 3" in first
    assert "session 'my rig.toml' --live-token ..." in first
    assert last.endswith("the command is done")


def test_what_happened_before_the_recording_stands_first(path: Path) -> None:
    with SITE_LOG.heard("info"):
        driver.info("asked for its version")
        SITE_LOG.begin(path)
        driver.info("connected")
    said = path.read_text()
    assert said.index("asked for its version") < said.index("connected")


def test_a_command_that_begins_no_recording_leaves_no_log(tmp_path: Path) -> None:
    with SITE_LOG.heard("info"):
        every_level()
    assert list(tmp_path.iterdir()) == []


def test_a_second_run_goes_on_below_the_first(recorded) -> None:
    first = recorded(lambda: driver.info("day one"))
    second = recorded(lambda: driver.info("day two"))
    assert second[: len(first)] == first
    assert "day two" in second[-2]


def test_a_full_log_is_put_aside(recorded, path: Path, monkeypatch) -> None:
    monkeypatch.setattr(site_log, "SIZE_BYTES", 1000)
    lines = recorded(lambda: [driver.info("pose %04d", number) for number in range(200)])
    assert max(len(lines), 1) < 20
    there = sorted(file.name for file in path.parent.iterdir())
    assert there == ["r.log", *(f"r.log.{number}" for number in range(1, site_log.EARLIER + 1))]
    assert all(file.stat().st_size <= 1000 for file in path.parent.iterdir())


def test_a_folder_that_takes_no_file_ends_nothing_and_is_said_once(tmp_path: Path, capsys) -> None:
    happened = []
    with SITE_LOG.heard("info"):
        SITE_LOG.begin(tmp_path / "missing" / "r.log")
        every_level()
        happened.append("the session")
    assert happened == ["the session"]
    said = capsys.readouterr().err
    assert said.count("the log cannot be written") == 1
    assert "the job goes on" in said


def test_a_full_disk_ends_nothing_and_is_said_once(recorded, monkeypatch, capsys) -> None:
    class Full(StringIO):
        def write(self, text: str) -> int:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(SiteLogFile, "_open", lambda self: Full())
    recorded(every_level)
    said = capsys.readouterr().err
    assert said.count("No space left on device") == 1


@pytest.mark.parametrize("content", [b"(1436509052.249713) vcan0 044#2A366C2BBA", b"\x89MCAP0\r\n"])
def test_a_file_that_is_no_log_is_left_as_it_is(path: Path, capsys, content: bytes) -> None:
    path.write_bytes(content)
    with SITE_LOG.heard("info"):
        SITE_LOG.begin(path)
        every_level()
    assert path.read_bytes() == content
    assert "no log of this program; no log is written" in capsys.readouterr().err


def test_a_folder_of_that_name_is_left_as_it_is(path: Path, capsys) -> None:
    path.mkdir()
    with SITE_LOG.heard("info"):
        SITE_LOG.begin(path)
    assert list(path.iterdir()) == []
    assert "no log is written" in capsys.readouterr().err


def test_text_of_a_device_forges_no_line(recorded) -> None:
    lines = recorded(lambda: driver.info("ready\n2026-01-01T00:00:00.000Z ERROR drivers: on fire\x1b[2J"))
    assert not [line for line in lines if line.startswith("2026-01-01T00:00:00.000Z")]
    assert "\x1b" not in "".join(lines)


@pytest.mark.parametrize(
    ("why", "level", "traceback"),
    [
        (DeviceLost("robot: no way to the controller"), "ERROR", False),
        (PartialResult("paused; samples kept"), "WARNING", False),
        (ZeroDivisionError("nobody foresaw it"), "ERROR", True),
    ],
)
def test_how_it_ended_is_in_it(recorded, path: Path, why: Exception, level: str, traceback: bool) -> None:
    def fails() -> None:
        raise why

    with pytest.raises(type(why)):
        recorded(fails)
    said = path.read_text()
    assert f"{level} calibeam.site_log: {type(why).__name__}: {why}" in said
    assert ("Traceback" in said) == traceback


def test_ctrl_c_is_in_it(recorded, path: Path) -> None:
    def ends() -> None:
        raise KeyboardInterrupt("SIGTERM")

    with pytest.raises(KeyboardInterrupt):
        recorded(ends)
    assert "WARNING calibeam.site_log: stopped by SIGTERM" in path.read_text()


def test_a_stop_is_in_it_after_the_arm_has_it(recorded) -> None:
    def no_way() -> None:
        raise DeviceLost("robot: no way to the controller")

    def stopped() -> None:
        supervisor = Supervisor(no_way)
        supervisor.failed(DeviceLost("psd: unplugged"))
        with pytest.raises(DeviceLost):
            supervisor.stop(StoppedError("pressed on the page"))

    lines = [line.split(" ", 1)[1] for line in recorded(stopped)]
    assert "WARNING acquisition.wires.streams: the arm was stopped: psd: unplugged" in lines
    assert "WARNING acquisition.wires.streams: STOP: pressed on the page" in lines


def test_it_stands_next_to_the_recording() -> None:
    assert site_log_of(Path("out/centre.mcap")) == Path("out/centre.log")
    assert site_log_of(Path("out/centre.log")) == Path("out/centre.log.log")
