"""When a reading may be taken: the probe's place counts, not the joints that go round it."""

import numpy as np

from acquisition.guided.stillness import ArmMotion, StillRule, Window

T_S = np.arange(0.0, 0.6, 0.01)


class Slider:
    """A probe on three slides: its place in m is the reading of the first three joints, the others turn it about."""

    lower_rad, upper_rad = np.full(6, -3.0), np.full(6, 3.0)

    def tip_m(self, q_rad):
        return q_rad[:, :3]

    def postures(self, start_rad, point_m):
        return start_rad


def judged(q_rad):
    return StillRule().judge(Slider(), Window(T_S[: len(q_rad)], T_S[: len(q_rad)], q_rad))


def held(noise_m=1e-6, rows=60):
    q = np.zeros((rows, 6))
    q[:, :3] += noise_m * np.random.default_rng(1).standard_normal((rows, 3))
    return q


def test_a_held_probe_is_still_though_its_joints_tremble():
    q = held()
    q[:, 4] = 3e-3 * np.sin(60.0 * T_S)
    assert judged(q) is ArmMotion.STILL


def test_a_probe_that_jumps_is_not_still():
    q = held()
    q[40:, 0] += 2e-4
    assert judged(q) is ArmMotion.MOVING


def test_a_creeping_probe_is_not_still():
    q = held()
    q[:, 1] += 1e-4 * T_S
    assert judged(q) is ArmMotion.MOVING


def test_coarse_readings_do_not_look_like_motion():
    assert judged(held(noise_m=5e-5)) is ArmMotion.STILL


def test_joints_on_their_way_round_a_seated_ball_are_not_still():
    q = held()
    q[:, 5] = 0.1 * T_S
    assert judged(q) is ArmMotion.MOVING


def test_a_short_stretch_says_nothing_yet():
    assert judged(held(rows=20)) is ArmMotion.SHORT
    assert judged(held(rows=5)) is ArmMotion.SHORT
