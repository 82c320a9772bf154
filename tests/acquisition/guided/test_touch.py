"""A session of contacts with a scripted person: order, undo, skipping, and what is not taken."""

import numpy as np
import pytest

from acquisition.errors import AcquisitionError
from acquisition.guided.stillness import Window
from acquisition.guided.touch import Advice, Answer, TouchOptions, TouchSession

OPTIONS = TouchOptions(seats=2, places=2, planes=1, postures=4)


class Arm:
    lower_rad, upper_rad = np.full(6, -3.0), np.full(6, 3.0)

    def tip_m(self, q_rad):
        return q_rad[:, :3]


class Person:
    """Watch, person and judge in one: a new posture before each answer, unless it stays."""

    def __init__(self, answers, stays=(), trembles=()):
        self.answers, self.stays, self.trembles = list(answers), stays, trembles
        self.q, self.t, self.count = np.zeros(6), 0.0, 0
        self.shown, self.asked, self.free, self.kept = [], [], [], []

    def answer(self, says, contact, posture_rad):
        self.asked.append(says)
        self.count += 1
        if self.count not in self.stays:
            self.q = self.q + 0.2
        return self.answers.pop(0) if self.answers else Answer.TAKE

    def show(self, text):
        self.shown.append(text)

    def next(self, seconds):
        self.t += seconds
        t = self.t + np.linspace(-seconds, 0.0, 20)
        q = np.tile(self.q, (20, 1))
        if self.count in self.trembles:
            q = q + np.linspace(0.0, 1e-3, 20)[:, None]
        return Window(t, t, q)

    def learn(self, readings):
        return ("the last contradicts",) if len(readings) == 3 else ()

    def advice(self, contact, readings):
        return Advice("turn joint 4", enough=len(readings) >= 5)


def session(person):
    made = TouchSession(
        person,
        Arm(),
        person,
        person,
        lambda taken: person.kept.append([one.target.columns for one in taken]),
        OPTIONS,
        person.free.append,
    )
    made.run()
    return made


def test_all_sockets_of_all_places_then_the_planes():
    person = Person([])
    taken = session(person).taken
    assert [one.row().get("seat") for one in taken] == [1] * 4 + [2] * 4 + [3] * 4 + [4] * 4 + [None] * 4
    assert [one.row().get("plane") for one in taken] == [None] * 16 + [1] * 4
    assert person.asked[0] == "place 1, socket 1 (seat 1), posture 1 of 4; turn joint 4"
    assert person.asked[-1] == "plane 1, posture 4 of 4; turn joint 4"
    assert person.free == [True, False] * 20
    assert [len(rows) for rows in person.kept] == list(range(1, 21))
    assert [text for text in person.shown if text.startswith("enough")] == [person.shown[2]]
    assert person.shown.count("the last contradicts") == 1
    assert np.all(np.diff([one.t_s for one in taken]) > 0.0)


def test_undo_goes_back_to_the_contact_of_the_last_reading():
    person = Person([Answer.UNDO, *[Answer.TAKE] * 4, Answer.UNDO, Answer.TAKE, Answer.FINISH])
    taken = session(person).taken
    assert person.shown[0] == "nothing to undo"
    assert [one.target.id for one in taken] == [1] * 4
    assert [len(rows) for rows in person.kept] == [1, 2, 3, 4, 3, 4]
    assert person.asked[6].startswith("place 1, socket 1 (seat 1), posture 4 of 4")


def test_skipping_goes_on_with_the_next():
    person = Person([Answer.TAKE, Answer.SKIP, Answer.TAKE, Answer.FINISH])
    assert [one.target.id for one in session(person).taken] == [1, 2]


def test_an_arm_that_moves_or_repeats_a_posture_is_not_read():
    person = Person([Answer.TAKE] * 3 + [Answer.FINISH], stays=(3,), trembles=(2,))
    assert [one.q_rad[0] for one in session(person).taken] == pytest.approx([0.2, 0.4])
    assert person.shown[0].startswith("not taken: the arm did not stand still within 10 s")
    person = Person([Answer.TAKE] * 2 + [Answer.FINISH], stays=(2,))
    assert len(session(person).taken) == 1
    assert person.shown == ["not taken: was read here in this posture; turn some joint by 6° or more"]


@pytest.mark.parametrize(
    ("numbers", "says"),
    [
        ({"places": 0}, "nothing to touch"),
        ({"seats": -1}, "nothing to touch"),
        ({"postures": 1}, "take 2 or more"),
        ({"planes": 1, "postures": 3}, "take 4 or more"),
    ],
)
def test_counts_that_determine_nothing_are_refused(numbers, says):
    with pytest.raises(AcquisitionError, match=says):
        TouchOptions(**numbers)
