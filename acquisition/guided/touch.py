"""A session of contacts: a person brings the ball at a robot's flange into sockets or against planes, one posture after
the other, and the joint angles are read where it rests. The arm is never moved from here.

A socket block stands at several places; each of its sockets is a seat with a number of its own. Whether a reading
contradicts its seat, and which posture determines most, is judged by who is passed in, for fits are not made here.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import AcquisitionError
from acquisition.guided.reading import Contact, Reading
from acquisition.guided.session import old_posture
from acquisition.guided.stillness import ArmMotion, EncoderWatch, GuidedArm, StillRule, Window

Floats = NDArray[np.float64]
FEWEST = {"seat": 2, "plane": 4}  # contacts; with fewer nothing is determined


@dataclass(frozen=True)
class TouchOptions:
    """How much is taken."""

    seats: int = 2  # sockets of the block
    places: int = 8  # of the block
    planes: int = 0
    postures: int = 30  # in each socket, and touches of each plane

    def __post_init__(self) -> None:
        if min(self.seats, self.places, self.planes) < 0 or not self.contacts():
            raise AcquisitionError(
                f"{self.seats} seats at {self.places} places, {self.planes} planes: nothing to touch; give 1 or more"
            )
        fewest = FEWEST["plane" if self.planes else "seat"]
        if self.postures < fewest:
            raise AcquisitionError(
                f"{self.postures} postures: fewer determine nothing; take {fewest} or more in each socket and plane"
            )

    def contacts(self) -> tuple[Contact, ...]:
        """All of them in the order in which they are taken; numbers count up from 1."""
        sockets = [
            Contact("seat", number, f"place {place}, socket {socket} (seat {number})", place)
            for place in range(1, self.places + 1)
            for socket in range(1, self.seats + 1)
            for number in [(place - 1) * self.seats + socket]
        ]
        return (*sockets, *(Contact("plane", k, f"plane {k}") for k in range(1, self.planes + 1)))


class Answer(Enum):
    """What the person wants."""

    TAKE = "take"
    UNDO = "undo"
    SKIP = "skip"
    FINISH = "finish"


@dataclass(frozen=True)
class Advice:
    """What the readings so far determine, and what to do next."""

    says: str = ""  # how to turn the arm next
    posture_rad: tuple[float, ...] | None = None  # about this one; None: any
    enough: bool = False  # every joint zero that can be determined is known as well as asked
    open_joints: tuple[int, ...] = ()  # whose zero no contact determines, from 1


class TouchPerson(Protocol):
    """Who guides the arm."""

    def answer(self, says: str, contact: Contact, posture_rad: tuple[float, ...] | None) -> Answer:
        """Waits for what the person wants next. DeviceError when the controller is lost meanwhile."""
        ...

    @property
    def show(self) -> Callable[[str], None]: ...


class TouchJudge(Protocol):
    """Learns from all that was taken."""

    def learn(self, readings: Sequence[Reading]) -> tuple[str, ...]:
        """What the readings contradict that was not reported before, in sentences."""
        ...

    def advice(self, contact: Contact, readings: Sequence[Reading]) -> Advice: ...


@dataclass
class TouchSession:
    """The only owner of what was taken. `keep` has all readings on the disk when it returns, `free` lets the arm be
    guided (True) or holds it; both may raise what ends the session.
    """

    watch: EncoderWatch
    arm: GuidedArm
    person: TouchPerson
    judge: TouchJudge
    keep: Callable[[Sequence[Reading]], None]
    options: TouchOptions
    free: Callable[[bool], None] = lambda on: None
    taken: list[Reading] = field(default_factory=list[Reading])  # those of an interrupted session, to begin with
    rule: StillRule = field(default_factory=StillRule)
    patience_s: float = 10.0  # of the controller's time, for the arm to stand still
    offset_s: float = 0.0  # of the time of the rows
    advice: Advice = field(default_factory=Advice, init=False)
    _enough: bool = field(default=False, init=False)  # it was reported
    _start_s: float | None = field(default=None, init=False)

    def run(self) -> None:
        """Until all is taken or the person ends it. DeviceError, RecordingError; what was taken is kept by then."""
        contacts, at = self.options.contacts(), 0
        if self.taken:
            self.judge.learn(self.taken)
        while (at := self._first_open(contacts, at)) < len(contacts):
            contact = contacts[at]
            self._advise(contact)
            self.free(True)
            answer = self.person.answer(self._request(contact), contact, self.advice.posture_rad)
            self.free(False)
            if answer is Answer.FINISH:
                return
            if answer is Answer.TAKE:
                self._take(contact)
            elif answer is Answer.SKIP:
                at += 1
            elif self.taken:
                at = self._undo(contacts)
            else:
                self.person.show("nothing to undo")

    def _first_open(self, contacts: Sequence[Contact], at: int) -> int:
        """From `at` on, the first that has not its share."""
        while at < len(contacts) and self._count(contacts[at]) >= self.options.postures:
            self.person.show(f"{contacts[at].says}: all {self.options.postures} postures are taken")
            at += 1
        return at

    def _count(self, contact: Contact) -> int:
        return sum(reading.target == contact for reading in self.taken)

    def _request(self, contact: Contact) -> str:
        number = self._count(contact) + 1
        says = f"; {self.advice.says}" if self.advice.says else ""
        return f"{contact.says}, posture {number} of {self.options.postures}{says}"

    def _advise(self, contact: Contact) -> None:
        self.advice = self.judge.advice(contact, self.taken)
        if self.advice.enough and not self._enough:
            self._enough = True
            self.person.show("enough: the zeros of all joints that contacts determine are as certain as asked; q ends")

    def _take(self, contact: Contact) -> None:
        window = self._still()
        if window is None:
            self.person.show(f"not taken: the arm did not stand still within {self.patience_s:g} s; let go of it")
            return
        q_rad = window.q_rad.mean(axis=0)
        earlier = [reading.q_rad for reading in self.taken if reading.target == contact]
        if contact.kind == "seat" and (again := old_posture(q_rad, earlier)) is not None:
            self.person.show(f"not taken: {again}")
            return
        t_s = float(window.t_s.mean())
        self._start_s = t_s if self._start_s is None else self._start_s
        self.taken.append(Reading(contact, q_rad, self.offset_s + t_s - self._start_s, float(window.host_s[-1])))
        self.keep(self.taken)
        for contradiction in self.judge.learn(self.taken):
            self.person.show(contradiction)

    def _still(self) -> Window | None:
        """A dwell that began after the answer; None when there is none in time."""
        begun_s: float | None = None
        while True:
            window = self.watch.next(self.rule.dwell_s)
            now_s = float(window.t_s[-1])
            begun_s = now_s if begun_s is None else begun_s
            if now_s - begun_s >= self.rule.dwell_s and self.rule.judge(self.arm, window) is ArmMotion.STILL:
                return window.last(self.rule.dwell_s)
            if now_s - begun_s > self.patience_s:
                return None

    def _undo(self, contacts: Sequence[Contact]) -> int:
        """Where the session goes on."""
        last = self.taken.pop()
        self.keep(self.taken)
        self.judge.learn(self.taken)
        self.person.show(f"taken back: the last reading of {last.target.says}")
        return contacts.index(last.target) if isinstance(last.target, Contact) else 0
