"""A session of contacts over the wires of an emulated controller: the zeros found, and every way to end early."""

import os
import re
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest
from rich.console import Console

from acquisition.guided.reading import Contact
from acquisition.guided.touch import Answer, TouchOptions, TouchSession
from acquisition.recording import RecordingError
from acquisition.recording.rig import load_rig, parse_rig
from acquisition.recording.session_folder import read_folder
from calibeam.cli import run
from calibeam.devices.robot import emulated_robot
from calibeam.emulation import Emulation
from calibeam.guided.touched import EmulatedPerson, KnownContacts, TouchFolder, run_touch, touch_rig_text
from calibeam.outcome import PartialResult
from simulators.world.truth import read_truth

TRACKER = Path(__file__).parents[3] / "rigs" / "ur5e-tracker.toml"
PACE = 20.0
KNOWN = KnownContacts(0.05, 1e-5, 1e-5, 1e-4)


def ball_rig() -> str:
    """The shipped UR5e with a ball instead of a tracker's target."""
    return re.sub(r"(?ms)^\[device(s\.tracker)?\].*?(?=^\[)", "", TRACKER.read_text())


class Scripted:
    """An emulated person; before answer number `at` the trouble comes."""

    def __init__(self, emulation: Emulation, rig, at: int = 0, trouble: Callable[[], Answer | None] = lambda: None):
        self.shown: list[str] = []
        self.asked: list[str] = []
        self.freedrive: list[str] = []
        self.show = self.shown.append
        self.contact: Contact | None = None  # where the ball is put instead
        self._emulation, self._at, self._trouble, self._count = emulation, at, trouble, 0
        self._person = EmulatedPerson(emulation.ask, self.show, rig.motion.home_rad)

    def answer(self, says: str, contact: Contact, posture_rad) -> Answer:
        self._count += 1
        self.asked.append(says)
        self.freedrive.append(self._emulation.ask("robot.state")["freedrive"])
        wanted = self._trouble() if self._count == self._at else None
        return wanted or self._person.answer(says, self.contact or contact, posture_rad)


class Touching:
    def __init__(self, emulation: Emulation, folder: Path) -> None:
        self.emulation, self.path, text = emulation, folder / "session", ball_rig()
        rig = parse_rig(text, "rig.toml")
        robot = emulated_robot(rig.devices.robot, emulation.address["robot"])
        self.rig = msgspec.structs.replace(rig, devices=msgspec.structs.replace(rig.devices, robot=robot))
        self.text = text

    def run(self, person: Scripted, options: TouchOptions, *, go_on: bool = False, frees: bool = True) -> TouchSession:
        text = touch_rig_text(self.rig, self.text, options, KNOWN)
        folder = TouchFolder(self.path, self.rig, text, go_on=go_on)
        console = Console(quiet=True)
        return run_touch(
            self.rig, folder, options, KNOWN, console, lambda _: person, frees=frees, hurry=PACE, seed=3
        )  # fmt: skip

    def rows(self) -> list[int]:
        return read_folder(self.path).samples.integers("seat", 0).tolist()

    def freedrive(self) -> str:
        return self.emulation.ask("robot.state")["freedrive"]


@pytest.fixture
def touching(tmp_path: Path) -> Iterator[Touching]:
    (tmp_path / "rig.toml").write_text(ball_rig())
    with Emulation(tmp_path / "rig.toml", seed=5, time_scale=PACE, truth=tmp_path / "truth.json") as emulation:
        yield Touching(emulation, tmp_path)


def test_a_whole_session_finds_the_concealed_zeros(touching: Touching, tmp_path: Path) -> None:
    person = Scripted(touching.emulation, touching.rig)
    session = touching.run(person, TouchOptions(places=2, postures=10))
    assert touching.rows() == [seat for seat in range(1, 5) for _ in range(10)]
    assert sum(text.startswith("enough: ") for text in person.shown) == 1
    assert session.advice.open_joints == (1, 6)
    assert set(person.freedrive) == {"ON"}
    assert touching.freedrive() == "OFF"
    assert run(["identify", str(touching.path), "--out", str(tmp_path / "model.json")]) == 0
    model = msgspec.json.decode((tmp_path / "model.json").read_bytes())
    found = {p["name"]: p for p in model["parameters"]}
    truth = read_truth(tmp_path / "truth.json").joint_zero_rad
    for joint in (2, 3, 4, 5):
        zero = found[f"joint{joint}.zero"]
        assert zero["sigma"] < 1e-4
        assert abs(zero["value"] - truth[joint - 1]) < 4.0 * zero["sigma"], joint
        assert abs(truth[joint - 1]) > 10.0 * zero["sigma"]


def test_a_contact_in_the_wrong_socket_is_reported_and_undone(touching: Touching) -> None:
    options = TouchOptions(places=1, postures=8)
    person = Scripted(touching.emulation, touching.rig, 15)
    first, second = options.contacts()

    def wrong() -> None:
        person.contact = first
        person._at, person._trouble = 16, undo

    def undo() -> Answer:
        assert touching.rows() == [1] * 8 + [2] * 7
        person.contact = None
        return Answer.UNDO

    person._trouble = wrong
    touching.run(person, options)
    reported = [text for text in person.shown if "contradicts" in text]
    assert len(reported) == 1
    assert f"reading 15 contradicts the others of {second.says}" in reported[0]
    assert f"it fits {first.says}" in reported[0]
    assert "by 5" in reported[0]  # 50 mm
    assert f"taken back: the last reading of {second.says}" in person.shown
    assert touching.rows() == [1] * 8 + [2] * 8


def test_ctrl_c_keeps_the_rows_and_the_session_goes_on(touching: Touching) -> None:
    options = TouchOptions(places=1, postures=3)
    person = Scripted(touching.emulation, touching.rig, 5, lambda: os.kill(os.getpid(), signal.SIGINT))
    with pytest.raises(PartialResult, match=r"Ctrl-C; contacts kept in .*: 4; --continue goes on"):
        touching.run(person, options)
    assert touching.rows() == [1, 1, 1, 2]
    assert touching.freedrive() == "OFF"
    with pytest.raises(RecordingError, match="holds a session already"):
        touching.run(person, options)
    touching.run(Scripted(touching.emulation, touching.rig), options, go_on=True)
    assert touching.rows() == [1, 1, 1, 2, 2, 2]
    assert np.all(np.diff(read_folder(touching.path).samples.column("t_s")) > 0.0)


@pytest.mark.parametrize("frees", [True, False])
def test_a_lost_controller_keeps_the_rows(touching: Touching, frees: bool) -> None:
    person = Scripted(touching.emulation, touching.rig, 3, lambda: touching.emulation.ask("robot.disconnect"))
    with pytest.raises(PartialResult, match=r"contacts kept in .*: 2; --continue goes on"):
        touching.run(person, TouchOptions(places=1, postures=5), frees=frees)
    assert touching.rows() == [1, 1]
    assert touching.freedrive() == "OFF"


def test_freedrive_is_off_after_a_failure_of_the_program(touching: Touching) -> None:
    def fail() -> None:
        assert touching.freedrive() == "ON"
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        touching.run(Scripted(touching.emulation, touching.rig, 2, fail), TouchOptions(places=1))
    assert touching.freedrive() == "OFF"
    assert touching.rows() == [1]


def test_freedrive_is_off_while_a_reading_is_taken(touching: Touching, monkeypatch: pytest.MonkeyPatch) -> None:
    states: list[str] = []
    still = TouchSession._still

    def looked(session: TouchSession):
        states.append(touching.freedrive())
        return still(session)

    monkeypatch.setattr(TouchSession, "_still", looked)
    touching.run(Scripted(touching.emulation, touching.rig), TouchOptions(places=1, postures=2))
    assert states == ["OFF"] * len(states)
    assert len(states) >= 4


def test_what_cannot_be_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    (tmp_path / "rig.toml").write_text(ball_rig())
    out = ["--out", str(tmp_path / "out")]
    command = ["session", str(tmp_path / "rig.toml"), *out]
    for options, reason in [
        (["--touch"], "--touch asks a person at the terminal"),
        (["--touch", "--seats", "3", "--distance", "0.05"], "--distance with --seats 3"),
        (["--touch", "--postures", "1"], "1 postures: fewer determine nothing"),
        (["--touch", "--accuracy-um", "5"], "--accuracy-um: meant for a session without --touch"),
        (["--freedrive"], "--freedrive: meant for a session by contact"),
    ]:
        assert run([*command, *options]) == 1
        assert reason in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out").exists()


def test_the_rig_copy_states_what_is_known(tmp_path: Path) -> None:
    rig = parse_rig(ball_rig(), "rig.toml")
    text = touch_rig_text(rig, ball_rig(), TouchOptions(places=2), KnownContacts(0.0501, 4e-5))
    (tmp_path / "rig.toml").write_text(text)
    copy = load_rig(tmp_path / "rig.toml")
    assert [(one.from_placement, one.to_placement, one.length_m, one.sigma_m) for one in copy.known_distances] == [
        (1, 2, 0.0501, 4e-5),
        (3, 4, 0.0501, 4e-5),
    ]
    assert copy.noise.seat_m == 2e-4
    assert copy.noise.joint_rad == rig.noise.joint_rad
