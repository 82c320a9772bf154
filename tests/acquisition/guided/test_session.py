"""A guided session on a scripted hand: what is taken, asked for again, left out."""

import numpy as np
import pytest

from acquisition.guided.plan import GuidedVisit
from acquisition.guided.reading import BarEnd, Cone, OffTarget, SphereSpot
from acquisition.guided.session import GuidedSession
from acquisition.guided.stillness import Window
from drivers.errors import DeviceLost

CONE, A, B = Cone(1, (0.5, 0.0, 0.1)), BarEnd(1, 1, "a", (0.0, 0.5, 0.1)), BarEnd(1, 1, "b", (0.0, -0.5, 0.1))


class Slides:
    """The probe's place in m is the reading of the first three joints; the others are posture."""

    lower_rad, upper_rad = np.full(6, -3.0), np.full(6, 3.0)

    def tip_m(self, q_rad):
        return q_rad[:, :3]

    def postures(self, start_rad, point_m):
        return np.column_stack([np.tile(point_m, (len(start_rad), 1)), start_rad[:, 3:]])


class Hand:
    """Watch and guide in one: stands where it was asked to, off by `off_m` at chosen requests."""

    def __init__(self, off_m=None, gone_after=None, absent=()):
        self.q, self.t, self.requests, self.progress = np.zeros(6), 0.0, [], []
        self.off_m, self.gone_after, self.absent = off_m or {}, gone_after, absent

    def ask(self, request):
        self.requests.append(request)
        number = len(self.requests)
        if number in self.absent:
            return False
        self.q = request.posture_rad + np.array([self.off_m.get(number, 0.0), 0, 0, 0, 0, 0])
        return True

    def tell(self, progress):
        self.progress.append(progress)

    def next(self, seconds):
        if self.gone_after is not None and len(self.requests) > self.gone_after:
            raise DeviceLost("encoders: node 3 is gone")
        self.t += 1.0
        t = self.t + np.linspace(0.0, seconds, 20)
        return Window(t, t, np.tile(self.q, (20, 1)))


class Ruler:
    """A judge that doubts what is more than 0.1 mm from where it was asked."""

    repeatability_m = 3e-6

    def __init__(self):
        self.learned = []

    def learn(self, readings):
        self.learned.append(len(readings))

    def off_target(self, visit):
        miss = max(float(np.linalg.norm(r.q_rad[:3] - np.array(r.target.point_m))) for r in visit)
        return OffTarget(miss, 20.0) if miss > 1e-4 else None


class Journal:
    def __init__(self):
        self.rows, self.events = [], []

    def readings(self, readings):
        self.rows += [reading.row() for reading in readings]

    def event(self, kind, detail):
        self.events.append((kind, detail))


def session(hand, **kinds):
    journal = Journal()
    made = GuidedSession(hand, Slides(), hand, Ruler(), journal, np.random.default_rng(1), **kinds)
    return made, journal


def test_a_still_probe_is_read_and_the_row_says_where_it_was():
    made, journal = session(Hand())
    summary = made.run([GuidedVisit((CONE,)), GuidedVisit((A, B)), GuidedVisit((CONE,))])
    assert len(summary.readings) == made.taken == 4
    assert [row.get("bar_end") for row in journal.rows] == [None, "a", "b", None]
    assert journal.rows[0]["seat"] == 1
    assert journal.rows[0]["t_s"] == 0.0
    assert journal.rows[3]["t_s"] > journal.rows[1]["t_s"] > 0.0


def test_a_slip_is_not_kept_but_asked_for_again():
    hand = Hand(off_m={2: 5e-4})
    made, journal = session(hand)
    summary = made.run([GuidedVisit((CONE,)), GuidedVisit((CONE,))])
    assert (len(summary.readings), summary.slips) == (2, 1)
    assert [kind for kind, _ in journal.events] == ["slip"]
    assert hand.requests[2].attempt == 2


def test_both_ends_are_taken_again_when_their_length_cannot_be():
    hand = Hand(off_m={2: 5e-4})
    made, journal = session(hand)
    made.run([GuidedVisit((A, B))])
    assert [request.target.end for request in hand.requests] == ["a", "b", "a", "b"]
    assert len(journal.rows) == 2


def test_what_stays_uncertain_is_taken_and_reported():
    made, journal = session(Hand(off_m=dict.fromkeys(range(1, 10), 5e-4)))
    summary = made.run([GuidedVisit((CONE,))])
    assert (len(summary.readings), summary.slips, summary.doubted) == (1, 3, 1)
    assert journal.events[-1][0] == "doubted"


def test_a_probe_that_does_not_come_is_left_out_in_the_end():
    made, journal = session(Hand(absent=range(1, 10)))
    summary = made.run([GuidedVisit((CONE,))])
    assert (len(summary.readings), summary.skipped) == (0, 1)
    assert journal.events == [("skipped", {"target": "cone 1", "why": "no reading in 4 attempts"})]


def test_a_still_probe_at_another_place_is_reported_and_waited_for():
    hand = Hand(off_m=dict.fromkeys(range(1, 10), 0.2))
    made, _ = session(hand, patience_s=5.0)
    assert made.run([GuidedVisit((CONE,))]).skipped == 1
    assert "200 mm from cone 1" in hand.progress[0].says


def test_the_same_standstill_is_read_once():
    hand = Hand()
    made, _ = session(hand, patience_s=5.0)
    still = (0.5, 0.0, 0.1, 0.2, 0.3, 0.4)
    summary = made.run([GuidedVisit((CONE,), still), GuidedVisit((CONE,), still)])
    assert (len(summary.readings), summary.skipped) == (1, 1)


class Copies(Hand):
    """Comes a little away from where it stood before, whatever posture it was asked for, for so many requests."""

    def __init__(self, times, **kinds):
        super().__init__(**kinds)
        self.times = times

    def ask(self, request):
        before = self.q.copy()
        super().ask(request)
        if 1 < len(self.requests) <= 1 + self.times:
            self.q = before + 0.05
            self.q[:3] = self.requests[-1].posture_rad[:3]
        return True


def test_a_cone_is_not_read_twice_in_one_posture():
    hand = Copies(times=1)
    made, _ = session(hand, patience_s=5.0)
    first, second = made.run([GuidedVisit((CONE,)), GuidedVisit((CONE,))]).readings
    assert np.abs(first.q_rad - second.q_rad).max() > 0.1
    assert "turn some joint by 6°" in hand.progress[0].says


def spot(x, y, z):
    return SphereSpot(1, (0.0, 0.0, 1.0), 0, (x, y, z))


class Sways(Hand):
    """Holds the probe a little otherwise each time."""

    def ask(self, request):
        came = super().ask(request)
        self.q = self.q + np.array([0, 0, 0, 0, 0.01 * len(self.requests), 0])
        return came


def test_a_sphere_is_not_touched_twice_at_one_spot():
    hand = Sways()
    made, _ = session(hand, patience_s=5.0)
    nearby = [spot(0.5, 0.0, 0.1), spot(0.5, 0.0012, 0.1), spot(0.5, 0.003, 0.1)]
    summary = made.run([GuidedVisit((one,)) for one in nearby])
    assert (len(summary.readings), summary.skipped) == (2, 1)
    assert "2 mm or more beside every earlier spot" in hand.progress[0].says


def test_a_touch_that_leaves_all_in_one_plane_is_refused_and_the_session_goes_on():
    hand = Sways()
    made, _ = session(hand, patience_s=5.0)
    ring = [spot(0.5 + 0.01 * np.cos(a), 0.01 * np.sin(a), 0.1) for a in np.arange(5.0)]
    summary = made.run([GuidedVisit((one,)) for one in (*ring, spot(0.5, 0.0, 0.11))])
    assert (len(summary.readings), summary.skipped) == (5, 1)
    assert any("in one plane" in progress.says for progress in hand.progress)


def test_what_was_taken_before_the_encoders_went_is_kept():
    made, journal = session(Hand(gone_after=2))
    with pytest.raises(DeviceLost):
        made.run([GuidedVisit((CONE,))] * 4)
    assert made.taken == len(journal.rows) == 2
