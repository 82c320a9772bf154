"""A session of contacts that is recorded: the controller read, a person asked, a session folder written row by row.

The folder is what `identify`, `diagnose` and `report` work on: the rig with what is known of the sockets, and one row a
contact. After every row the whole table is on the disk.
"""

import re
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from acquisition.errors import AcquisitionError
from acquisition.guided.reading import Contact, Reading
from acquisition.guided.stillness import WiredEncoderWatch
from acquisition.guided.touch import Answer, TouchOptions, TouchPerson, TouchSession
from acquisition.recording import RecordingError
from acquisition.recording.output import csv_text, table_output, toml_output, write_output
from acquisition.recording.rig import Rig, parse_rig
from acquisition.recording.rig.devices import RobotDriver
from acquisition.recording.samples import PLANE, SEAT
from acquisition.recording.session_folder import CSV, RIG, read_folder
from acquisition.wires.streams import Pump, Supervisor
from calibeam.asking import Asking
from calibeam.console import Console
from calibeam.devices.encoders import encoder_driver, stamp_pace
from calibeam.devices.recorder import Interrupted, uninterrupted
from calibeam.devices.robot import robot_of
from calibeam.emulation import EmulationError
from calibeam.guided.contacts import ContactJudge
from calibeam.guided.recorded import STREAM_MEMORY, AssumedGuidedArm
from calibeam.guided.run import CANNOT
from calibeam.outcome import PartialResult, interruption
from drivers.clock import Clock, SystemClock
from drivers.errors import DeviceError
from drivers.ur.control import WATCHDOG_HZ, UrControl

Free = Callable[[bool], None]
SOCKET_M = 2e-4  # one sigma of a coordinate of a ball in a printed socket (docs/without-a-measuring-device.md)
KEYS = "ENTER or n takes it, u takes the last back, s skips to the next, q ends: "
ANSWERS = {"": Answer.TAKE, "n": Answer.TAKE, "u": Answer.UNDO, "s": Answer.SKIP, "q": Answer.FINISH}


@dataclass(frozen=True)
class KnownContacts:
    """What is known of sockets and joints: lengths and sigmas in m, rad."""

    distance_m: float | None = None  # of the two sockets of the block
    distance_sigma_m: float = 3e-5
    seat_sigma_m: float | None = None  # None: as the rig states, else SOCKET_M
    zero_sigma_rad: float = 2e-4  # of every joint zero: then it is enough


def touch_rig_text(rig: Rig, text: str, options: TouchOptions, known: KnownContacts) -> str:
    """The rig file with `[noise] seat_m` and one `[[known_distance]]` for each place. AcquisitionError."""
    if rig.tool.point_m is None:
        raise AcquisitionError(f"rig {rig.name}: [tool] has no point_m; give the ball's place at the flange, about")
    if known.distance_m is not None:
        if options.seats != 2:
            raise AcquisitionError(f"--distance with --seats {options.seats}: it is that of two sockets; leave it out")
        if rig.known_distances:
            raise AcquisitionError(f"rig {rig.name}: has [[known_distance]] already; leave --distance out")
        for place in range(1, options.places + 1):
            text += (
                f'\n[[known_distance]]\nof = "seat"\nfrom = {2 * place - 1}\nto = {2 * place}\n'
                f"length_m = {known.distance_m!r}\nsigma_m = {known.distance_sigma_m!r}\n"
            )
    stated = rig.noise.seat_m if known.seat_sigma_m is None else known.seat_sigma_m
    if stated != rig.noise.seat_m or stated is None:
        if rig.noise.seat_m is not None:
            raise AcquisitionError(f"rig {rig.name}: [noise] states seat_m already; leave --seat-sigma out")
        line = f"seat_m = {SOCKET_M if stated is None else stated!r}\n"
        text, found = re.subn(r"(?m)^\[noise\][^\n]*\n", lambda head: head[0] + line, text, count=1)
        text += "" if found else f"\n[noise]\n{line}"
    parse_rig(text, RIG)
    return text


class TouchFolder:
    """The session folder; owns its files."""

    def __init__(self, folder: Path, rig: Rig, text: str, *, go_on: bool) -> None:
        """RecordingError where a session is there and nobody wants to go on with it, or it is of another rig."""
        self.path, self._n = folder, rig.n_joints
        self.earlier: list[Reading] = []
        self.offset_s = 0.0
        there = (folder / RIG).exists() or (folder / CSV).exists()
        if there and not go_on:
            raise RecordingError(
                f"{folder}: holds a session already, and no recording is written over; go on with it by --continue, or "
                "choose another --out"
            )
        if there:
            self._read(text)
        else:
            write_output(folder / RIG, text, toml_output(("schema", "arm"), "rig file"))
            self.keep([])

    def keep(self, readings: Sequence[Reading]) -> None:
        """All rows, on the disk when it returns: a table that is cut short is never seen. RecordingError, OSError."""
        names = ["t_s", *(f"q{i + 1}_rad" for i in range(self._n)), SEAT, PLANE]
        rows = [[reading.row().get(name, "") for name in names] for reading in readings]
        write_output(self.path / CSV, csv_text([names, *rows]), table_output(names, "table of samples"))

    def discard(self) -> None:
        """Nothing was taken: the next try may use the same name."""
        for name in (RIG, CSV):
            (self.path / name).unlink(missing_ok=True)
        with suppress(OSError):  # other files are in it
            self.path.rmdir()

    def _read(self, text: str) -> None:
        if (self.path / RIG).read_text(encoding="utf-8") != text:
            raise RecordingError(
                f"{self.path / RIG}: differs from the rig and the options given; go on with the same, or choose "
                "another --out"
            )
        if not (self.path / CSV).read_text(encoding="utf-8").count("\n") > 1:
            return
        samples = read_folder(self.path).samples
        names = {kind: samples.integers(kind, 0) for kind in (SEAT, PLANE) if kind in samples}
        for row, (t_s, q_rad) in enumerate(zip(samples.column("t_s"), samples.joints(), strict=True)):
            kind, numbers = next(((kind, ids) for kind, ids in names.items() if ids[row] > 0), ("", None))
            if numbers is None:
                raise RecordingError(
                    f"{self.path / CSV}: row {row + 1} names no seat and no plane; correct or delete it"
                )
            contact = Contact(PLANE if kind == PLANE else SEAT, int(numbers[row]), f"{kind} {numbers[row]}")
            self.earlier.append(Reading(contact, q_rad, float(t_s), 0.0))
        pause_s = max(0.0, time.time() - (self.path / CSV).stat().st_mtime)
        self.offset_s = self.earlier[-1].t_s + pause_s

    def named(self, contacts: Sequence[Contact]) -> list[Reading]:
        """The earlier readings with the contacts of this session. RecordingError for one that is not asked for."""
        by_number = {(contact.kind, contact.id): contact for contact in contacts}
        out: list[Reading] = []
        for one in self.earlier:
            known = isinstance(one.target, Contact) and by_number.get((one.target.kind, one.target.id))
            if not known:
                raise RecordingError(f"{self.path / CSV}: {one.target.says} is not among those asked for; give more")
            out.append(Reading(known, one.q_rad, one.t_s, one.host_s))
        return out


@contextmanager
def reading_joints(rig: Rig, clock: Clock, hurry: float = 1.0) -> Generator[tuple[WiredEncoderWatch, Supervisor]]:
    """The controller's joint angles, or the rig's own encoders where it has no controller. DeviceError."""
    robot, encoders = rig.devices.robot, rig.devices.encoders
    if robot is not None:
        driver, channel, pace = robot_of(robot, clock, hurry).reader, "actual_q_rad", 1.0
    elif encoders is not None:
        driver, channel = encoder_driver(encoders, clock, hurry=hurry), "position_rad"
        pace = stamp_pace(encoders, hurry)
    else:
        raise AcquisitionError(f"rig {rig.name}: no [devices.robot] or [devices.encoders]; --touch reads one of them")
    supervisor = Supervisor(lambda: None, clock)  # nothing to stop: a person moves the arm
    driver.connect()
    pump = Pump(driver, clock, lambda block: None, supervisor.failed, memory=STREAM_MEMORY)
    pump.start()
    try:
        yield WiredEncoderWatch(pump, supervisor, pace, channel), supervisor
    finally:
        with uninterrupted():
            pump.stop()


@contextmanager
def freedrive(rig: Rig, clock: Clock, hurry: float = 1.0) -> Generator[Free]:
    """Switches the freedrive of a UR; off when left, whatever the way. AcquisitionError for another controller."""
    robot = rig.devices.robot
    if robot is None or robot.driver is not RobotDriver.UR_RTDE or robot.host is None:
        raise AcquisitionError(f"rig {rig.name}: --freedrive is of a UR controller; press the pendant's button instead")
    control = UrControl(robot.host, watchdog_hz=WATCHDOG_HZ / hurry, clock=clock)
    try:
        control.connect()
        yield control.freedrive
    finally:
        with uninterrupted():
            try:
                with suppress(DeviceError):  # a controller that is lost ends the mode by its watchdog
                    control.freedrive(False)
            finally:
                control.close()


class TerminalPerson:
    """Implements acquisition.guided.touch.TouchPerson for a person at the terminal."""

    def __init__(self, asking: Asking, console: Console, supervisor: Supervisor) -> None:
        self._asking, self._console, self._supervisor = asking, console, supervisor

    def answer(self, says: str, contact: Contact, posture_rad: tuple[float, ...] | None) -> Answer:
        question = says
        while (typed := self._asking.ask(question, KEYS, lambda: self._supervisor.failure is not None)) is not None:
            if typed.lower() in ANSWERS:
                return ANSWERS[typed.lower()]
            question = f"'{typed[:20]}' is none of the keys. {says}"
        self._supervisor.check()
        return Answer.FINISH

    def show(self, text: str) -> None:
        self._console.print(text, highlight=False, markup=False, soft_wrap=True)


@dataclass
class EmulatedPerson:
    """Implements acquisition.guided.touch.TouchPerson: guides the emulated arm to sockets that stand about it."""

    ask: Callable[..., Any]
    show: Callable[[str], None]
    home_rad: tuple[float, ...]
    distance_m: float = 0.05  # of the two sockets, truly
    contact_m: float = 0.0  # one sigma of a coordinate by which the ball rests beside its place
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(1))

    def answer(self, says: str, contact: Contact, posture_rad: tuple[float, ...] | None) -> Answer:
        for attempt in range(60):
            near_rad = np.array(self.home_rad if posture_rad is None or attempt > 20 else posture_rad)
            near_rad = near_rad + self.rng.normal(0.0, 0.1 + 0.02 * attempt, len(near_rad))
            try:
                self.ask(
                    "robot.guide",
                    point_m=self._place_m(contact),
                    posture_rad=near_rad.tolist(),
                    contact_m=self.contact_m,
                )
            except EmulationError as refused:
                if CANNOT not in str(refused):
                    raise
                continue
            return Answer.TAKE
        return Answer.SKIP

    def _place_m(self, contact: Contact) -> list[float]:
        """Blocks about the arm at two heights; a plane is touched anywhere."""
        if contact.kind == PLANE:
            x_m, y_m = self.rng.uniform(0.35, 0.6), self.rng.uniform(-0.3, 0.3)
            return [float(x_m), float(y_m), 0.08 + 0.1 * contact.id]
        turn_rad, reach_m = 0.9 * contact.place, 0.42 + 0.06 * (contact.place % 3)
        along = self.distance_m * ((contact.id + 1) % 2)
        x_m, y_m = reach_m * np.cos(turn_rad), reach_m * np.sin(turn_rad)
        height_m = 0.05 if contact.place % 4 else 0.25
        return [float(x_m - along * np.sin(turn_rad)), float(y_m + along * np.cos(turn_rad)), height_m]


def run_touch(
    rig: Rig,
    folder: TouchFolder,
    options: TouchOptions,
    known: KnownContacts,
    console: Console,
    person_of: Callable[[Supervisor], TouchPerson],
    *,
    frees: bool = False,
    hurry: float = 1.0,
    seed: int = 1,
) -> TouchSession:
    """The whole session into `folder`. PartialResult when it ended early: what was taken is kept."""
    clock = SystemClock()
    if options.seats and known.distance_m is None and not rig.known_distances:
        console.print(
            "no --distance: the size of the arm stays open; add [[known_distance]] to the rig file before identify",
            highlight=False,
            markup=False,
        )
    judge = ContactJudge(parse_rig((folder.path / RIG).read_text(encoding="utf-8"), RIG), known.zero_sigma_rad,
                         np.random.default_rng(seed))  # fmt: skip
    earlier = folder.named(options.contacts())
    taken = list(earlier)
    try:
        with reading_joints(rig, clock, hurry) as (watch, supervisor), _freeing(rig, clock, hurry, frees=frees) as free:
            person = person_of(supervisor)
            session = TouchSession(
                watch, AssumedGuidedArm.of_rig(rig), person, judge, folder.keep, options, free, taken,
                offset_s=folder.offset_s,
            )  # fmt: skip
            session.run()
    except (*Interrupted, OSError) as why:
        reason = interruption(why) if isinstance(why, KeyboardInterrupt) else str(why)
        if not taken:
            folder.discard()
            raise
        raise PartialResult(f"{reason}; contacts kept in {folder.path}: {len(taken)}; --continue goes on") from why
    if not taken:
        folder.discard()
        raise PartialResult("no contact was taken; nothing is kept")
    console.print(f"contacts: {len(taken)}, in {folder.path}", highlight=False, markup=False)
    if session.advice.open_joints:
        names = ", ".join(map(str, session.advice.open_joints))
        console.print(f"not determined by contacts: the zeros of joints {names}", highlight=False, markup=False)
    console.print(f"next: calibeam identify {folder.path} --out model.json", highlight=False, markup=False)
    return session


@contextmanager
def _freeing(rig: Rig, clock: Clock, hurry: float, *, frees: bool) -> Generator[Free]:
    if not frees:
        yield lambda on: None
        return
    with freedrive(rig, clock, hurry) as free:
        yield free
